"""Building a scene, and planning what is traced, tell how far they are, and end where they are told to."""

from itertools import pairwise
from pathlib import Path

import pytest

from citypv.core.effects.table import PLANNING, TABLE
from citypv.core.read.read_city import read_city
from citypv.core.settings.progress import CancelledError
from citypv.core.settings.request import Request
from citypv.core.study import prepare_study, read_year, stand_city

CITY = Path(__file__).parents[1] / "data/citygml/berlin_opendata_part_v1.gml.gz"


@pytest.fixture(scope="module")
def city():
    return read_city(CITY)


@pytest.fixture(scope="module")
def traced(city):
    """Scene of the city, and the shares that were reported on the way."""
    shares = []
    return stand_city(city, Request(), shares.append), shares


def test_classifying_tells_many_shares_that_rise_from_nothing_to_all(traced):
    shares = traced[1]
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert shares == sorted(shares)
    assert max(b - a for a, b in pairwise(shares)) < 0.25
    assert len(shares) > 15


@pytest.mark.parametrize("last", [0.0, 0.3, 0.5, 0.7])
def test_classifying_ends_at_a_report_that_raises(city, last):
    told = []

    def report_share(share):
        told.append(share)
        if share >= last:
            raise CancelledError

    with pytest.raises(CancelledError):
        stand_city(city, Request(), report_share)
    assert [share for share in told if share >= last] == told[-1:]


def test_the_plan_tells_each_effect(traced):
    scene, told = traced[0], []
    request = Request(weather="clear-sky", suns="days:2")
    prepare_study(scene, read_year(scene.site, request), request, progress=lambda *report: told.append(report))
    planned = [report[1:3] for report in told if report[0] == PLANNING]
    assert planned == [(done, len(TABLE)) for done in range(len(TABLE))]
