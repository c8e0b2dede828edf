"""Boxes from outside and from inside, and light in them."""

from contextlib import contextmanager

import numpy as np
import pytest

from citypv.core.commands.plain_scenes import box
from citypv.core.light import trace_hemisphere


def room(low, high):
    """The six rectangles of a box, facing inwards."""
    return [(points, np.asarray(faces)[:, ::-1]) for points, faces in box(low, high)]


@contextmanager
def lit_inside():
    """As if light got into closed rooms, which else are covered all over: nothing is."""
    find = trace_hemisphere.find_covered_cells
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_hemisphere, "find_covered_cells", lambda *given: np.zeros_like(find(*given)))
        yield
