"""Walls a hand's breadth apart, and small undersides: patches of ten metres spread light where it
does not come.

Such places are not refined; the error of the surface says how much it may be. Held against paths
followed one by one and against small patches.
"""

import numpy as np
import pytest
from own_rays import OwnRays
from real_cities import SUNS
from scenes import run_gather
from test_closed_forms import direct_relative
from thorough import mark_cases
from towns import boxes, city_of_polygons

from citypv.core.city.build_scene import build_scene
from citypv.core.light.light_errors import remaining_error
from citypv.core.patches.patches import Patches

ERRORS = 3.0  # stated ones that gather may be off by
SEEDS = 3
PATHS = 1 << 16


def boxes_apart(gap, patch_size=10.0):
    """Two boxes, the second one taller: the east wall of the first, surface 3, looks into the gap
    between them.
    """
    return boxes([((0, 0, 0), (20, 12, 12)), ((20 + gap, 0, 0), (40, 12, 20))], patch_size)


def balconies():
    """A house with a slab of 3 × 1.5 m, 3 m up, and one of 6 × 2 m above it: undersides 7
    and 13.
    """
    return boxes(
        [((0, 0, 0), (12, 10, 12)), ((4, -1.5, 3), (7, 0, 3.2)), ((3, -2, 6), (9, 0, 6.2))],
        whole=True,
    )


def arcade():
    """An upper storey that stands out by 3 m on two posts, 4 m up: its underside is 7."""
    posts = [((x, -3, 0), (x + 0.5, -2.5, 4)) for x in (0, 19.5)]
    return boxes([((0, 0, 0), (20, 10, 14)), ((0, -3, 4), (20, 0, 14)), *posts], whole=True)


def light_by_gather(scene, surface, **settings):
    """Means over seeds of diffuse and direct light, and rms of their stated errors: two (2,)."""
    runs = [run_gather(scene, SUNS, seed=seed, **settings) for seed in range(SEEDS)]
    light, stated = np.swapaxes([light_of(run, surface) for run in runs], 0, 1)
    return light.mean(axis=0), np.sqrt((stated**2).mean(axis=0))


def light_of(transfer, surface):
    """Diffuse and direct light of a surface, and its stated errors: two (2,)."""
    direct = direct_relative(transfer)[surface] @ SUNS.weight
    errors = (
        transfer.diffuse_relative_standard_error[surface],
        transfer.direct_annual_standard_error[surface],
    )
    return np.array([[transfer.diffuse_relative[surface], direct], errors])


def light_by_paths(scene, surface):
    """The same by paths of the test's own, with the error of their mean."""
    own = OwnRays(scene, Patches.of_scene(scene, np.zeros(len(scene.triangles)), 0).offset)
    rows = np.flatnonzero(scene.triangle_surface == surface)
    return own.light(rows, PATHS, np.random.default_rng(7), bounces=3, suns=SUNS)


CASES = {
    "0.1 m": (lambda: boxes_apart(0.1), 3),
    "0.3 m": (lambda: boxes_apart(0.3), 3),
    "1 m": (lambda: boxes_apart(1.0), 3),
    "balcony of 3 m": (balconies, 7),
    "balcony of 6 m": (balconies, 13),
    "arcade": (arcade, 7),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(CASES, kept=3))
def test_the_stated_error_holds_what_patches_spread(name):
    """Three times of it, and it is not vast."""
    make, surface = CASES[name]
    scene = make()
    found, stated = light_by_gather(scene, surface)
    known, error = light_by_paths(scene, surface)
    assert (np.abs(found - known) <= ERRORS * np.hypot(stated, error)).all()
    assert (error < stated).all() and (stated < 0.6 * known).all()


@pytest.mark.thorough
def test_small_patches_leave_little_of_it():
    """Patches of 0.7 m in a gap of 0.3 m are right, and say so."""
    scene = boxes_apart(0.3, 0.7)
    known, error = light_by_paths(boxes_apart(0.3), 3)
    found, stated = light_by_gather(scene, 3, samples=64)
    large = light_by_gather(boxes_apart(0.3), 3)[1]
    assert (np.abs(found - known) <= ERRORS * np.hypot(stated, error)).all()
    assert (stated < 0.5 * large).all()


def room(scene, **settings):
    """Shares without room for a module of a run with hardly a ray, and the clearances that they are
    for.
    """
    transfer = run_gather(scene, SUNS, samples=16, shadow_samples=1, max_bounces=0, **settings)
    return transfer.no_room, transfer.covered_share, transfer.clearances


@pytest.mark.parametrize(
    ("gap", "within"), [(0.005, ()), (0.02, (0.05, 0.3)), (0.2, (0.3,)), (0.29, (0.3,)), (0.31, ())]
)
def test_a_gap_has_no_room_for_modules(gap, within):
    """The wall of the lower box and 12 of 20 m of the other's; what touches is covered, not short
    of room as well.
    """
    shares, covered, clearances = room(boxes_apart(gap), clearance=0.05)
    assert clearances == (0.01, 0.05, 0.3)
    for column, length in enumerate(clearances):
        expected = np.zeros(len(shares))
        expected[[3, 11]] = (1, 0.6) if length in within else 0
        np.testing.assert_allclose(shares[:, column], expected, atol=0.03)
    assert covered[3] == pytest.approx(float(gap < 0.01), abs=0.03)


@pytest.mark.parametrize(("angle", "cramped"), [(0, True), (24, True), (28, False)])
def test_a_face_must_be_turned_against_it(angle, cramped):
    """A panel 0.15 m before the middle of a wall, turned about the upright axis: up to 25.8° it
    leaves no room.
    """
    turn, middle, up = np.radians(angle), np.array([0, 0.15, 3]), np.array([0, 0, 2.0])
    half = 0.2 * np.array([np.cos(turn), np.sin(turn), 0])
    panel = [middle - half - up, middle + half - up, middle + half + up, middle - half + up]
    wall = [[-2, 0, 0.5], [-2, 0, 5.5], [2, 0, 5.5], [2, 0, 0.5]]
    city = city_of_polygons([wall, panel], building=[0, 1])
    shares, covered, _ = room(build_scene(city, 52, 13, ground="none", patch_size=1.0))
    assert covered[0] == 0
    assert shares[0, -1] == pytest.approx(0.4 * np.cos(turn) * 4 / 20 * cramped, abs=0.02)


def test_what_is_left_after_two_steps():
    """Of errors that fall with the first or second power of length, by the sum of the geometric
    series.
    """
    first = np.array([1.0, 1.0, -1.0, 0.0])
    second = np.array([1 / 2, 1 / 4, -1 / 4, 0.0])
    left = remaining_error(np.stack([second, first], axis=1), np.zeros(4))
    np.testing.assert_allclose(left, [0.5, 1 / 12, -1 / 12, 0])
    assert (
        np.abs(remaining_error(np.stack([second, first], axis=1), np.full(4, 9.0))) == 0
    ).all()  # drowned in noise
