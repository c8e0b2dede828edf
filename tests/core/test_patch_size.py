"""Patches are chosen as small as the error asked for wants them."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scenes import suns_towards

from citypv.core.choose_patch_size import LEAST, MOST, choose_patch_size
from citypv.core.errors import InputError
from citypv.core.light.trace_transfer import trace_transfer
from citypv.core.progress import silent
from citypv.core.request import Request, check_request
from citypv.core.study import place_city, read_buildings

ROOT = Path(__file__).parents[2]
SUNS = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3]])


def berlin():
    city = read_buildings([ROOT / "examples" / "berlin" / "berlin_3910_5817.gml"], Request())
    return partial(place_city, city)


@pytest.mark.slow
def test_berlin_gets_what_it_needs():
    """Half a percent is had with patches of more than ten metres; a quarter needs half the length."""
    stand = berlin()
    wide, expected = choose_patch_size(stand, Request(patch_error=0.5))
    narrow, _ = choose_patch_size(stand, Request(patch_error=0.25))
    assert 10 < wide < MOST
    assert expected == pytest.approx(0.5)
    assert narrow == pytest.approx(wide / 2)
    # What is measured between patches and their cells, with all samples and under suns, says the same.
    request = Request(patch_size=wide)
    settings = trace_transfer(stand(request), SUNS, request, silent).settings
    left = 100 * max(map(abs, settings["change_by_even_patches"].values())) / 3
    assert 0.25 < left < 0.7


def test_limits():
    stand = berlin()
    few = replace(Request(), seed=1)
    assert choose_patch_size(stand, replace(few, patch_error=1e-6))[0] == LEAST
    assert choose_patch_size(stand, replace(few, patch_error=1e6))[0] == MOST


@pytest.mark.parametrize("error", [0.0, -1.0, np.nan])
def test_no_error_is_refused(error):
    with pytest.raises(InputError, match="--patch-error"):
        check_request(Request(patch_error=error))
