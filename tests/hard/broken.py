"""A house on a plain, values to break its arrays with, and what an error must say."""

import numpy as np
import pytest
from scenes import join, strip, suns_towards

from citypv.core.commands.plain_scenes import box
from citypv.core.settings.errors import InputError

HOUSE = join([strip([-20, -20, 0], [40, 0, 0], [0, 40, 0], 2), *box((-5, -5, 0), (5, 5, 10))])
COUNT = len(HOUSE.triangles)
SUNS = suns_towards(
    [[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0, 0, 1], [0.9, 0.1, 0.15], [0.2, 0.2, 0.9]]
)
NUMBERS = [np.nan, np.inf, -np.inf, 1e38, -1e300, 1e10]
CURES = ["ask", "check", "complete", "give", "leave", "let", "look", "see", "take", "trace", "use"]


def spoiled(values, place, number):
    """A copy as float64 with another number at a place."""
    values = np.array(values, float)
    values[place] = number
    return values


def refused(words, door, *arguments, **settings):
    """An error of one line that ends with a cure."""
    with pytest.raises(InputError, match=words) as caught:
        door(*arguments, **settings)
    assert str(caught.value).count("\n") == 0
    assert caught.value.cure.split()[0] in CURES
