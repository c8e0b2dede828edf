"""Where the city stands: the same town gives the same light anywhere on Earth."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards
from thorough import mark_cases
from towns import city_of_polygons, draw_town, moved

from citypv.core.city.build_scene import build_scene
from citypv.core.city.transform_crs import UNITS
from citypv.core.commands.plain_scenes import box, room

SUNS = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3], [0.1, -0.9, 0.1]])
SQUARE = 10_240.0  # [m] of the ground's grid: what is moved by whole ones stands on the same ground
PLACES = {
    "UTM": lambda points: moved(points, [39 * SQUARE, 568 * SQUARE, 30]),
    "3000 m up": lambda points: moved(points, [-SQUARE, SQUARE, 3000.123]),
    "feet": lambda points: moved(points, [98 * SQUARE, 0, 0]) / 0.3048 * UNITS["ft"],
}


@pytest.mark.parametrize("place", mark_cases(PLACES, kept=1))
def test_the_same_town_and_its_ground_anywhere(place):
    """The same vertices, and so the same light."""
    city = city_of_polygons(*(rows[: 6 * 36] for rows in draw_town(across=6)))  # the houses alone
    moved_city = replace(city, points=PLACES[place](city.points))
    before, scene = (build_scene(one, 52.5, 13.4) for one in (city, moved_city))
    assert np.array_equal(scene.triangles, before.triangles)
    assert scene.vertices == pytest.approx(before.vertices, abs=1e-9)


@pytest.mark.parametrize(
    ("away", "cells"), [(0.0, 1), (3_000.0, 100), (45_000.0, 1), (45_000.0, 100)]
)
def test_a_house_in_a_terrain_of_100_km(away, cells):
    """A box of 10 m on an endless plain: roof 1, walls half the sky and half the lit ground."""
    plain = [
        strip([-5e4, y, 0], [1e5, 0, 0], [0, 1e5 / cells, 0], 1)
        for y in np.linspace(-5e4, 5e4, cells + 1)[:-1]
    ]
    house = [
        (moved(points, [away, -0.37 * away, 0]), faces)
        for points, faces in box((-5, -5, 0), (5, 5, 10))
    ]
    scene = join([*plain, *house])
    suns = suns_towards([[0.3, -0.8, 0.6], [0, 0, 1]])
    transfer = run_gather(
        scene, suns, samples=4096, shadow_samples=64, far_ground=False, report="all"
    )
    roof, floor, south = (np.arange(2) + 2 * cells + 2 * side for side in (0, 1, 2))
    assert transfer.sky_view_factor[roof] == pytest.approx(1, abs=1e-6)
    assert transfer.visible_share[roof] == pytest.approx(1, abs=1e-6)
    assert transfer.sky_view_factor[south] == pytest.approx(0.5, abs=0.005)
    assert transfer.visible_share[south, 0] == pytest.approx(1, abs=1e-6)
    assert transfer.covered_share[south].max() == 0
    assert transfer.sky_view_factor[floor].max() < 1e-6
    # The ground around it is lit as if the house were not there, but for its footprint.
    assert (
        np.average(transfer.sky_view_factor[: 2 * cells], weights=scene.surfaces.area[: 2 * cells])
        > 0.9999
    )


def test_a_courtyard_far_from_the_origin_stays_dark():
    """A closed box 50 km out: float32 knows its corners to 4 mm only, and still nothing
    leaks in.
    """
    inside = [(moved(points, [5e4, 3e4, 0]), faces) for points, faces in room((0, 0, 0), (4, 5, 3))]
    scene = join([strip([-5e4, -5e4, -1], [1e5, 0, 0], [0, 1e5, 0], 1), *inside])
    transfer = run_gather(scene, SUNS, samples=16384, shadow_samples=1024, report="all")
    for values in (
        transfer.sky_view_factor,
        transfer.far_ground_view_factor,
        transfer.visible_share,
    ):
        assert values[2:].max() < 1e-6
