"""Which sun: on the horizon, in the plane of a wall, along a street, never up; and clocks that jump."""

import numpy as np
import pandas as pd
import pytest
from scenes import join, run_gather, strip, suns_towards
from towns import turned

from citypv.core.commands.plain_scenes import box
from citypv.core.sun.solar_position import solar_position
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.sun.suns import Suns

HOUR = pd.Timedelta(hours=1)
GROUND = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 6)
HOUSE = join([GROUND, *box((-5, -5, 0), (5, 5, 10))])
SOUTH, NORTH, EAST, WEST = (12 + np.arange(2) + 2 * side for side in (2, 3, 4, 5))
ROOF = np.array([12, 13])


def visible(directions, scene=HOUSE, **settings):
    return run_gather(scene, suns_towards(directions), shadow_samples=64, **settings)


def test_on_the_horizon():
    """No light on level faces, full light on the wall that faces the sun; nothing is NaN."""
    transfer = visible([[0, -1, 0], [0, -1, 1e-9], [0, -1, -1e-9]], max_bounces=3)
    assert transfer.visible_share[ROOF].max() == 0
    assert transfer.visible_share[:12].max() == 0
    assert transfer.visible_share[SOUTH] == pytest.approx(1)
    assert np.isfinite(transfer.direct_reflected).all()
    assert transfer.direct_reflected.min() >= 0


@pytest.mark.parametrize(("turn", "elevation"), [(0.0, 5.0), (17.3, 45.0), (45.0, 5.0), (89.99, 45.0)])
def test_exactly_in_the_plane_of_a_wall(turn, elevation):
    """Both walls beside the sun receive nothing, as the sun's cosine is 0 there; the wall that faces it everything."""
    parts = [(turned(points, turn), faces) for points, faces in [GROUND, *box((-5, -5, 0), (5, 5, 10))]]
    e = np.radians(elevation)
    transfer = visible(turned([[0, -np.cos(e), np.sin(e)]], turn), join(parts))
    assert transfer.visible_share[EAST].max() == transfer.visible_share[WEST].max() == 0
    assert transfer.visible_share[SOUTH] == pytest.approx(1)


@pytest.mark.parametrize("elevation", [2.0, 30.0])
def test_exactly_along_a_street(elevation):
    """A street of 10 m between two blocks: its floor is lit over its whole length, its walls not at all."""
    blocks = box((-50, 5, 0), (50, 15, 20)) + box((-50, -15, 0), (50, -5, 20))
    floor = strip([-50, -5, 0], [100, 0, 0], [0, 10, 0], 4)
    e = np.radians(elevation)
    transfer = visible([[np.cos(e), 0, np.sin(e)]], join([floor, *blocks]), max_bounces=0)
    assert transfer.visible_share[:8] == pytest.approx(1)
    towards_street = [8 + 4, 8 + 5, 8 + 12 + 6, 8 + 12 + 7]
    assert transfer.surfaces.normal[towards_street, 1] == pytest.approx([-1, -1, 1, 1])
    assert transfer.visible_share[towards_street].max() == 0


def test_no_sun_above_the_horizon():
    """Polar night: no direct light, no NaN, the sky shines all the same."""
    none = np.zeros(0, np.int32)
    transfer = run_gather(HOUSE, Suns("hourly", np.zeros((0, 3)), np.zeros(0), none, none))
    assert transfer.visible_share.shape == transfer.direct_reflected.shape == (len(HOUSE.surfaces), 0)
    assert transfer.direct_annual_standard_error == pytest.approx(0)
    assert transfer.diffuse_relative[ROOF] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("zone", ["Europe/Berlin", "Australia/Lord_Howe"])
def test_summer_time_moves_no_sun(zone):
    """The same instants, named in a zone whose clocks jump."""
    times = pd.date_range("2021-01-01", "2022-01-01", freq=HOUR, inclusive="left", tz="UTC")
    utc = solar_position(times, HOUR, 52.5, 13.4).to_numpy()
    assert np.array_equal(solar_position(times.tz_convert(zone), HOUR, 52.5, 13.4).to_numpy(), utc)
    one, other = (choose_suns("typical-days:4", axis, HOUR, 52.5, 13.4) for axis in (times, times.tz_convert(zone)))
    assert np.array_equal(one.direction, other.direction)
