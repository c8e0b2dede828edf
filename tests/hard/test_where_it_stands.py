"""Where the city stands: the same town gives the same light anywhere on Earth."""

import numpy as np
import pytest
from closed import box, room
from scenes import join, run_gather, strip, suns_towards
from towns import BOX, city_of_polygons, draw_town, moved, turned

from citypv.core.city.build_scene import build_scene
from citypv.core.city.transform_crs import convert_to_metres
from citypv.core.patches.patches import patches_of_scene
from citypv.core.rays.hemisphere_rays import hemisphere_rays
from citypv.core.rays.ray_scene import RayScene
from citypv.core.rays.sample_points import sobol_digits

SUNS = np.array([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3], [0.1, -0.9, 0.1]])
FIELDS = ("sky_view_factor", "diffuse_relative", "visible_share", "direct_reflected", "covered_share")

SQUARE = 10_240.0  # [m] of the ground's grid: what is moved by whole ones stands on the same ground
PLACES = {
    "UTM": lambda points: moved(points, [39 * SQUARE, 568 * SQUARE, 30]),
    "3000 m up": lambda points: moved(points, [-SQUARE, SQUARE, 3000.123]),
    "feet": lambda points: convert_to_metres(moved(points, [98 * SQUARE, 0, 0]) / 0.3048, None, "ft")[0],
    "turned by 37°": lambda points: moved(turned(points, 37), [390_000, 5_818_000, 30]),
}


def build_town(place=None, ground="none", across=6):
    """Houses with ground of their own, or with none, at a place of the Earth."""
    polygons, thematic, building = draw_town(across, tiles=4)
    kept = len(polygons) if ground == "none" else len(BOX) * across**2
    city = city_of_polygons(polygons[:kept], thematic[:kept], building[:kept])
    city.points = city.points if place is None else PLACES[place](city.points)
    return build_scene(city, 52.5, 13.4, ground=ground)


def trace_town(scene, suns=SUNS, **settings):
    """Gather with all surfaces sampled alike: which are eligible depends on size and orientation."""
    return run_gather(scene, suns_towards(suns), **{"samples": 64, "report": "all"} | settings)


def answers(scene):
    """Surface met by each of many hemisphere rays; -1 for none."""
    patches = patches_of_scene(scene, np.full(len(scene.triangles), 0.25), 0)
    origins, directions, _ = hemisphere_rays(patches, np.arange(len(patches)), sobol_digits(32))
    hit = RayScene(scene.vertices, scene.triangles).trace_closest(origins.reshape(-1, 3), directions.reshape(-1, 3))
    return np.where(hit >= 0, scene.triangle_surface[hit], -1)


def test_a_turned_town_has_the_same_light():
    """And of many thousand rays each meets the surface that it met before. What is only moved has the same vertices."""
    before, scene = build_town(), build_town("turned by 37°")
    reference, transfer = trace_town(before), trace_town(scene, turned(SUNS, 37))
    area = scene.surfaces.area
    assert area == pytest.approx(before.surfaces.area, rel=1e-6)
    assert 0.3 < np.average(reference.diffuse_relative, weights=area) < 0.8
    for name in FIELDS:
        found, wanted = (np.average(getattr(one, name), weights=area, axis=0) for one in (transfer, reference))
        assert found == pytest.approx(wanted, abs=1e-5), name
    assert (answers(scene) != answers(before)).mean() <= 1e-5


@pytest.mark.parametrize("place", ["UTM", "3000 m up", "feet"])
def test_the_same_town_and_its_ground_anywhere(place):
    """The same vertices, and so the same light."""
    before, scene = build_town(ground="auto"), build_town(place, ground="auto")
    assert np.array_equal(scene.triangles, before.triangles)
    assert scene.vertices == pytest.approx(before.vertices, abs=1e-9)


@pytest.mark.parametrize(("away", "cells"), [(0.0, 1), (3_000.0, 100), (45_000.0, 1), (45_000.0, 100)])
def test_a_house_in_a_terrain_of_100_km(away, cells):
    """A box of 10 m on an endless plain: roof 1, walls half the sky and half the lit ground."""
    plain = [strip([-5e4, y, 0], [1e5, 0, 0], [0, 1e5 / cells, 0], 1) for y in np.linspace(-5e4, 5e4, cells + 1)[:-1]]
    house = [(moved(points, [away, -0.37 * away, 0]), faces) for points, faces in box((-5, -5, 0), (5, 5, 10))]
    scene = join([*plain, *house])
    transfer = trace_town(scene, [[0.3, -0.8, 0.6], [0, 0, 1]], samples=4096, shadow_samples=64, far_ground=False)
    roof, floor, south = (np.arange(2) + 2 * cells + 2 * side for side in (0, 1, 2))
    assert transfer.sky_view_factor[roof] == pytest.approx(1, abs=1e-6)
    assert transfer.visible_share[roof] == pytest.approx(1, abs=1e-6)
    assert transfer.sky_view_factor[south] == pytest.approx(0.5, abs=0.005)
    assert transfer.visible_share[south, 0] == pytest.approx(1, abs=1e-6)
    assert transfer.covered_share[south].max() == 0
    assert transfer.sky_view_factor[floor].max() < 1e-6
    # The ground around it is lit as if the house were not there, but for its footprint.
    assert np.average(transfer.sky_view_factor[: 2 * cells], weights=scene.surfaces.area[: 2 * cells]) > 0.9999


def test_a_courtyard_far_from_the_origin_stays_dark():
    """A closed box 50 km out: float32 knows its corners to 4 mm only, and still nothing leaks in."""
    inside = [(moved(points, [5e4, 3e4, 0]), faces) for points, faces in room((0, 0, 0), (4, 5, 3))]
    scene = join([strip([-5e4, -5e4, -1], [1e5, 0, 0], [0, 1e5, 0], 1), *inside])
    transfer = trace_town(scene, samples=16384, shadow_samples=1024)
    for values in (transfer.sky_view_factor, transfer.far_ground_view_factor, transfer.visible_share):
        assert values[2:].max() < 1e-6
