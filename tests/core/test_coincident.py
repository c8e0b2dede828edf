"""Faces that lie in one place, and places inside and under buildings: which of them light
reaches.
"""

import numpy as np
import pytest
from scenes import RUNS, join, run_gather, strip, suns_towards
from shapely.geometry import Polygon
from thorough import mark_cases

from citypv.core.commands.plain_scenes import box
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.patches.patches import Patches
from citypv.core.rays.find_coincident import MOST_PAIRS, find_coincident
from citypv.core.rays.ray_scene import RayScene

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0.5, 0.7, 0.2]])
SAMPLES = {"gather": 1024, "forward": 8000}
both = pytest.mark.parametrize("estimator", SAMPLES)


def trace(estimator, parts, footprint=(), **settings):
    """Transfer of some parts, of whose triangles some are known as footprints."""
    scene = join(parts)
    scene.footprint[list(footprint)] = True
    return RUNS[estimator](scene, SUNS, **{"samples": SAMPLES[estimator]} | settings)


def turned_over(part):
    points, faces = part
    return points, np.asarray(faces)[:, ::-1]


def in_pairs(found):
    """The pairs as a set."""
    one = np.repeat(np.arange(len(found.start) - 1), np.diff(found.start))
    return set(zip(one.tolist(), found.other.tolist(), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("seed", mark_cases(range(3), law=(0,)))
def test_pairs_are_those_that_overlap(seed):
    """Triangles of 1 cm to 100 m in three planes, turned any way: those whose overlap shapely
    knows.
    """
    generator = np.random.default_rng(seed)
    size = 10 ** generator.uniform(-2, 2, (300, 1, 1))
    flat = generator.uniform(-30, 30, (300, 1, 2)) * np.sqrt(size / 100) + size * generator.uniform(
        -1, 1, (300, 3, 2)
    )
    plane = generator.integers(0, 3, 300)
    corners = np.concatenate(
        [flat, np.broadcast_to(plane[:, None, None] * 0.5, (300, 3, 1))], axis=2
    )
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    found = find_coincident(corners @ turn.T, np.full(300, 1e-4))
    shapes = [Polygon(points) for points in flat]
    known, unsure = set(), set()
    for one in range(300):
        for other in range(300):
            if one != other and plane[one] == plane[other]:
                common = shapes[one].intersection(shapes[other])
                width = 2 * common.area / max(common.length, 1e-30)
                (known if width > 1e-3 else unsure if common.area > 0 else set()).add((one, other))
    assert len(known) > 200
    assert known <= in_pairs(found) <= known | unsure


@pytest.mark.parametrize("across", range(3))
def test_two_triangles_in_one_plane_are_a_pair_across_each_axis(across):
    """A half of a square and a half of the same square cut the other way have a quarter in common;
    the same triangle a metre away lies in another plane.
    """
    halves = np.array(
        [
            [[0.0, 0, 0], [10, 0, 0], [0, 10, 0]],
            [[0, 0, 0], [10, 0, 0], [10, 10, 0]],
            [[0, 0, 1], [10, 0, 1], [0, 10, 1]],
        ]
    )
    corners = np.roll(halves, across + 1, axis=2)
    assert in_pairs(find_coincident(corners, np.full(3, 1e-4))) == {(0, 1), (1, 0)}


def test_faces_that_touch_or_stand_apart_are_no_pairs():
    plain = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 24)
    above = strip([-10, -10, 0.01], [20, 0, 0], [0, 20, 0], 3)
    leaning = strip([-60, -60, 0], [120, 0, 0], [0, 120, 2], 2)
    scene = join([plain, above, leaning])
    corners = scene.vertices[scene.triangles]
    assert len(find_coincident(corners, np.full(len(corners), 1e-4))) == 0


@pytest.mark.slow
def test_threads_and_order_do_not_matter():
    generator = np.random.default_rng(2)
    corners = generator.uniform(0, 60, (40_000, 1, 3)) + generator.uniform(-2, 2, (40_000, 3, 3))
    corners[:, :, 2] = np.round(corners[:, :1, 2])
    one, other = (
        find_coincident(corners, np.full(len(corners), 1e-4), threads) for threads in (1, 3)
    )
    assert len(one) > 10_000
    assert (one.other == other.other).all() and (one.places == other.places).all()
    order = generator.permutation(len(corners))
    again = find_coincident(corners[order], np.full(len(corners), 1e-4))
    assert {(order[a], order[b]) for a, b in in_pairs(again)} == in_pairs(one)


@pytest.mark.slow
def test_thousands_of_faces_in_one_place_are_not_millions_of_pairs():
    corners = np.tile([[[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]], (1000, 1, 1))
    found = find_coincident(corners, np.full(1000, 1e-3))
    assert (np.diff(found.start) > 0).all()
    assert len(found) <= 2 * MOST_PAIRS * 1000


def test_rays_meet_the_front_of_a_sheet_from_either_side():
    """Two faces cut in different ways, the one a little turned in its plane: 20,000 rays from above
    and from below.
    """
    up = strip([-10, -10, 5], [20, 0, 0], [0, 20, 0], 3)
    down = turned_over(strip([-12, -9, 5], [24, -1, 0], [1, 21, 0], 4))
    scene = join([up, down])
    patches = Patches.of_scene(scene, np.zeros(len(scene.triangles)), 0)
    patches.receives[:] = True
    tree = FacingScene(scene, patches)
    generator = np.random.default_rng(4)
    for height, fronts in ((9.0, range(6)), (1.0, range(6, 14))):
        target = np.column_stack([generator.uniform(-9, 9, (20_000, 2)), np.full(20_000, 5.0)])
        target = target[target[:, 1] > -8]
        start = np.column_stack(
            [generator.uniform(-9, 9, (len(target), 2)), np.full(len(target), height)]
        )
        directions = (target - start) / np.linalg.norm(target - start, axis=1, keepdims=True)
        hit, b1, b2 = tree.trace_places(start.astype("f4"), directions.astype("f4"))
        assert np.isin(hit, fronts).all()
        corners = scene.vertices[scene.triangles[hit]]
        place = np.einsum("mk,mkx->mx", np.column_stack([1 - b1 - b2, b1, b2]), corners)
        assert np.abs(place - target).max() < 1e-4
        plain = RayScene(scene.vertices, scene.triangles).trace_closest(
            start.astype("f4"), directions.astype("f4")
        )
        known = RayScene.trace_places(tree, start.astype("f4"), directions.astype("f4"))[0]
        assert (known == plain).all()
        assert (
            not np.isin(plain, fronts).all() or height < 5
        )  # it says something: either may be met


def test_party_walls_are_no_sheets():
    """Three houses in a row and a board drawn from both sides: light reaches the fronts of the
    board only.
    """
    houses = [
        face for first in (0, 6, 12) for face in box((first, 0, 0), (first + 6, 10, 8 + first))
    ]
    board = strip([30, 0, 1], [0, 10, 0], [0, 0, 8], 2)
    plain = strip([-50, -50, 0], [100, 0, 0], [0, 100, 0], 8)
    scene = join([*houses, board, turned_over(board), plain])
    scene.footprint[2:4] = True  # the floor of the first house
    patches = Patches.of_scene(scene, np.zeros(len(scene.triangles)), 0)
    left = in_pairs(FacingScene(scene, patches).coincident)
    found = in_pairs(find_coincident(scene.vertices[scene.triangles], patches.offset))
    sheet = set(range(36, 44))
    assert {(one, other) for one, other in found if {one, other} <= sheet} == left
    assert len(left) == 8  # both sides are cut in the same way; each pair in both orders
    assert len({(one, other) for one, other in found if max(one, other) < 36}) >= 16


@pytest.mark.slow
@both
def test_a_floor_drawn_on_a_roof_leaves_the_roof_lit(estimator):
    """A floor that is known as a footprint, of a house that has nothing else."""
    roof, floor = (
        strip([-10, -10, 5], [20, 0, 0], [0, 20, 0], 2),
        strip([-8, -7, 5], [17, 0, 0], [0, 14, 0], 3),
    )
    transfer = trace(estimator, [roof, turned_over(floor)], footprint=range(4, 10), max_bounces=0)
    assert transfer.diffuse_relative[:4] == pytest.approx(1, abs=0.02)
    assert transfer.visible_share[:4] == pytest.approx(1, abs=0.02)


@both
def test_a_court_drawn_from_both_sides_lights_a_wall(estimator):
    """It reflects as one drawn once: beyond half of the sky the wall gets 0.5 · F of the court."""
    court = turned_over(strip([-10, 0, 0], [20, 0, 0], [0, -10, 0], 2))
    below = strip([-12, 0, 0], [24, 0, 0], [0, -13, 0], 1)
    wall = strip([-10, 0, 0], [20, 0, 0], [0, 0, 10], 1)
    transfer = trace(estimator, [court, below, wall], max_bounces=1, albedo=0.5, far_ground=False)
    reflected = transfer.diffuse_relative[-2:].mean() - transfer.sky_view_factor[-2:].mean()
    once = trace(
        "gather", [court, wall], max_bounces=1, albedo=0.5, far_ground=False, samples=16384
    )
    known = once.diffuse_relative[-2:].mean() - once.sky_view_factor[-2:].mean()
    assert reflected == pytest.approx(known, rel=0.04)


@pytest.mark.slow
def test_light_on_faces_drawn_twice_is_absorbed_once():
    """What arrives on two faces has been emitted once: nothing is left over."""
    part = strip([0, 0, 5], [10, 0, 0], [0, 10, 0], 2)
    transfer = trace("forward", [part, part, turned_over(part)], max_bounces=2, albedo=0.5)
    for tally in transfer.record.photons.values():
        assert tally["emitted"] == sum(value for name, value in tally.items() if name != "emitted")
    assert transfer.record.photons["sky"]["on_backs"] == 0


SUN = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6]])


def test_covered_parts_stay_dark_without_shadow_rays():
    """A low house stands against half of a wall: of any sun the wall gets half of what it would get
    alone.
    """
    scene = join([*box((0, 0, 0), (10, 10, 10)), *box((0, -10, 0), (10, 0, 5))])
    in_plane = (scene.vertices[scene.triangles][:, :, 1] == 0).all(axis=1)
    wall = np.flatnonzero((scene.surfaces.surface_azimuth == 180) & in_plane)
    transfer = run_gather(scene, SUN, effects={"shadow-rays": False})
    assert len(wall) == 2 and transfer.covered_share[wall].mean() == pytest.approx(0.5, abs=0.02)
    seen = transfer.visible_share[wall, 0]  # the first sun stands before it
    assert seen == pytest.approx(1 - transfer.covered_share[wall], abs=1e-6)


@pytest.mark.slow
def test_covered_ground_hands_on_all_its_light():
    """A wall stands before a plain, whose patches end at the wall or go on under the house: that is
    the same.
    """
    depth = 200.0
    house = box((-depth, 0, 0), (depth, depth, 10))
    whole = join([strip([-depth, -depth, 0], [2 * depth, 0, 0], [0, 2 * depth, 0], 65), *house])
    half = join([strip([-depth, -depth, 0], [2 * depth, 0, 0], [0, depth, 0], 32), *house])
    walls = []
    for scene in (whole, half):
        transfer = run_gather(scene, SUN, samples=16384, max_bounces=1, far_ground=False)
        south = np.flatnonzero(
            (transfer.surfaces.surface_azimuth == 180) & (transfer.surfaces.surface_tilt == 90)
        )
        walls.append(np.average(transfer.diffuse_relative[south] - transfer.sky_view_factor[south]))
    assert walls[1] > 0.09
    assert walls[0] == pytest.approx(walls[1], rel=0.02)
