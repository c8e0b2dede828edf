"""Slabs that hang in the air, and faces without thickness: what lies under them is lit, and they
are on both sides.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from own_rays import OwnRays
from radiosity import crossed_strings
from scenes import RUNS, assert_mean, suns_towards
from thorough import mark_cases
from towns import box, city_of_polygons

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.patches.patches import Patches

ROOT = Path(__file__).parents[2]
SUNS = suns_towards([[0.3, -0.8, 0.6]])
PATHS = 1 << 16
ERRORS = 4.5
# of the light: what is uneven within cells of patches of 4 m, under things that hang 2 to 5 m up
CELLS = 0.03


def sheet(start, along, across):
    """A rectangle that faces to where along × across points."""
    start, along, across = (np.array(vector, float) for vector in (start, along, across))
    return [np.array([start, start + along, start + along + across, start + across])]


def posts(size, height):
    """Four posts below the corners of a slab, without tops."""
    corners = [(x, y) for x in (-size / 2, size / 2 - 0.1) for y in (-size / 2, size / 2 - 0.1)]
    return [face for x, y in corners for face in box((x, y, 0), (x + 0.1, y + 0.1, height))[1:]]


PLAIN = sheet([-30, -30, 0], [60, 0, 0], [0, 60, 0])
HOUSE = box((-5, 0, 0), (5, 8, 8))


def scene_of(*objects, plain=PLAIN, ground="none", patch_size=4.0, terrain=None):
    """Scene of a named plain, surface 0, and objects that are buildings without names of their
    faces.
    """
    parts = [plain, *objects] if plain else objects
    building = [number for number, part in enumerate(parts) for _ in part]
    thematic = ["TINRelief" if plain and number == 0 else "" for number in building]
    city = city_of_polygons([face for part in parts for face in part], thematic, building)
    return build_scene(
        city,
        52.5,
        13.4,
        ground=ground,
        patch_size=patch_size,
        options=SceneOptions(terrain=terrain),
    )


def trace(scene, estimator="gather", **settings):
    """Transfer of a scene."""
    samples = settings.pop("samples", 512 if estimator == "gather" else 300)
    return RUNS[estimator](scene, SUNS, samples=samples, **settings)


def sheets_of(scene):
    """Surfaces that are taken for sheets, in ascending order."""
    return sorted(set(scene.triangle_surface[scene.sheet].tolist()))


def follow(scene, surface, sheets, **settings):
    """Light of one surface by paths of the test's own: mean and standard error."""
    plain = replace(scene, sheet=None)
    own = OwnRays(plain, Patches.of_scene(plain, np.zeros(len(scene.triangles)), 0).offset)
    rows, both = (
        np.flatnonzero(np.isin(scene.triangle_surface, chosen)) for chosen in ([surface], sheets)
    )
    (light, _), (error, _) = own.light(
        rows, PATHS, np.random.default_rng(surface), sheet=both, **settings
    )
    return light, error


def assert_light(scene, surfaces, sheets, covered=0.0):
    """Gather, forward and single paths agree; covered is what something stands on, and no more."""
    bounces = 3
    by_gather, by_forward = (trace(scene, estimator, max_bounces=bounces) for estimator in RUNS)
    for surface in surfaces:
        light, error = follow(scene, surface, sheets, bounces=bounces)
        for transfer in (by_gather, by_forward):
            found, stated = (
                transfer.diffuse_relative[surface],
                transfer.diffuse_relative_standard_error[surface],
            )
            slack = CELLS * light if transfer is by_gather else 0
            assert abs(found - light) <= ERRORS * np.hypot(error, stated) + slack, (
                surface,
                found,
                stated,
                light,
            )
            assert transfer.covered_share[surface] == pytest.approx(covered, abs=0.003)
            # The slack tells right from wrong: what stays dark below, or beside, misses a quarter
            # and more.
            assert ERRORS * np.hypot(error, stated) + slack < 0.2 * light


def radiosity_below(size, height, albedo, bounces, *, step=0.5, reach=30.0):
    """Light of the underside of a level square and of the ground below, by numbers: mean of the
    underside.

    Squares of half a metre hand light to each other as dA cos cos / (π r²), the ground as far as
    `reach`; beyond it the ground is lit without obstruction.
    """
    under, ground = (np.arange(-half + step / 2, half, step) for half in (size / 2, reach))
    x, y = (grid.ravel() for grid in np.meshgrid(under, under))
    gx, gy = (grid.ravel() for grid in np.meshgrid(ground, ground))
    squared = (x[:, None] - gx) ** 2 + (y[:, None] - gy) ** 2 + height**2
    kernel = step**2 * height**2 / (np.pi * squared**2)  # (under, ground)
    first = 1 - kernel.sum(axis=0)  # of the ground, from the sky
    beyond = 1 - kernel.sum(axis=1)  # of the underside, from the ground beyond
    above, arriving, total = np.zeros(len(x)), first, np.zeros(len(x))
    for bounce in range(bounces):
        above, arriving = (
            albedo * (kernel @ arriving + (beyond if bounce == 0 else 0)),
            albedo * (above @ kernel),
        )
        total += above
    return total.mean()


@pytest.mark.slow
@pytest.mark.parametrize(("size", "stands"), mark_cases([(10, False), (20, True)], kept=1))
def test_a_canopy_is_lit_from_below(size, stands):
    """Underside and the wall beside it; as an object of its own, or in one with its posts."""
    half = size / 2
    slab = box((-half, -half, 3), (half, half, 3.2))
    scene = scene_of(
        slab + posts(size, 3) if stands else slab, box((-half - 8, -half, 0), (-half - 2, half, 6))
    )
    assert not sheets_of(scene)
    assert not scene.footprint[scene.triangle_surface == 2].any()
    east = len(scene.surfaces) - 3  # of the house, below the slab and above it
    assert_light(scene, [2, east], [])


@pytest.mark.slow
@pytest.mark.parametrize("size", mark_cases([10, 20], kept=1))
def test_the_underside_of_a_slab_converges_to_its_radiosity(size):
    """Numeric radiosity in squares of half a metre; patches of 2 to 10 m."""
    expected = radiosity_below(size, 3, 0.25, 3)
    for patch_size, allowed in ((10.0, 0.06), (4.0, 0.03), (2.0, 0.02)):
        scene = scene_of(
            box((-size / 2, -size / 2, 3), (size / 2, size / 2, 3.01)), patch_size=patch_size
        )
        transfer = trace(scene, max_bounces=3, samples=1024)
        assert transfer.diffuse_relative[2] == pytest.approx(expected, rel=allowed)
    forward = trace(scene, "forward", max_bounces=3, samples=100)
    assert_mean(
        forward.diffuse_relative[2],
        forward.diffuse_relative_standard_error[2] + 0.005 * expected,
        expected,
    )


# objects, surfaces to look at (0 is the plain; a box is roof, floor, south, east, north, west),
# sheets
UNDER = {
    "carport that looks down": ([HOUSE, sheet([-3, -7, 2.5], [0, 6, 0], [6, 0, 0])], [3, 7], [7]),
    "sail": ([HOUSE, [np.array([[-3, -7, 3], [3, -7, 4], [0, -1, 5.0]])]], [3, 7], [7]),
    "noise barrier that looks away": (
        [HOUSE, sheet([-15, -4, 0], [30, 0, 0], [0, 0, 5])],
        [3, 7],
        [7],
    ),
    "billboard above ground": ([HOUSE, sheet([-3, -7, 4], [6, 0, 0], [0, 0, 3])], [3, 7], [7]),
    "parapet of single faces": (
        [HOUSE, *([wall] for wall in box((-5, 0, 8), (5, 8, 9), without=["top", "bottom"]))],
        [1, 7],
        [7, 8, 9, 10],
    ),
    "carports one above the other": (
        [sheet([-5, -5, z], [10, 0, 0], [0, 10, 0]) for z in (3, 6)],
        [1, 2],
        [1, 2],
    ),
    "roof under a slab": ([box((-5, 0, 0), (5, 8, 5)), box((-6, -1, 8), (6, 9, 8.3))], [1, 8], []),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(UNDER, kept=1))
def test_gather_is_forward_is_single_paths(name):
    objects, surfaces, sheets = UNDER[name]
    scene = scene_of(*objects)
    assert sheets_of(scene) == sheets
    assert not scene.footprint[np.isin(scene.triangle_surface, surfaces)].any()
    assert_light(scene, surfaces, sheets)


@pytest.mark.slow
def test_a_parapet_that_is_a_closed_body():
    """Its own object, 0.2 m wide on a roof of 8 m."""
    scene = scene_of(HOUSE, box((-5, 0, 8), (5, 0.2, 9)))
    assert not sheets_of(scene) and scene.footprint[scene.triangle_surface == 8].all()
    assert_light(scene, [1], [], covered=0.2 / 8)


@pytest.mark.slow
@pytest.mark.thorough
def test_the_roof_of_a_car_under_a_slab_of_20_m():
    """It sees the sky in the slot only: none of it is covered, and both estimators agree on the
    little that arrives.
    """
    scene = scene_of(
        box((-2, -1, 0), (2, 1, 1.5)), box((-10, -10, 3), (10, 10, 3.4)), patch_size=3.0
    )
    light, error = follow(scene, 1, [], bounces=3)
    for estimator, samples in (("gather", 1024), ("forward", 300)):
        transfer = trace(scene, estimator, samples=samples, max_bounces=3)
        stated = transfer.diffuse_relative_standard_error[1]
        assert transfer.covered_share[1] == 0
        assert transfer.diffuse_relative[1] == pytest.approx(
            light, abs=ERRORS * np.hypot(stated, error)
        )
        assert light > 3 * stated


@pytest.mark.parametrize("towards", [1, -1], ids=["looks away", "looks at the wall"])
@pytest.mark.parametrize(("height", "distance"), [(6.0, 1.5), (8.0, 1.0)])
def test_a_wall_behind_a_board_keeps_its_sky(height, distance, towards):
    """As long as it is high, 400 m: crossed strings from the wall to the slot between both upper
    edges.
    """
    board = sheet([-200 * towards, -distance, 0], [400 * towards, 0, 0], [0, 0, height])
    scene = scene_of(box((-5, 0, 0), (5, 8, height)), board, plain=None, patch_size=None)
    assert sheets_of(scene) == [6]
    transfer = trace(scene, samples=1 << 15, max_bounces=0)
    expected = abs(crossed_strings((0, 0), (0, height), (distance, height), (0, height)))
    assert transfer.covered_share[2] == 0
    assert transfer.sky_view_factor[2] == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("estimator", mark_cases(RUNS, kept=1))
def test_a_board_that_stands_free_is_lit_as_a_front_however_it_is_drawn(estimator):
    """Half of the sky and half of the ground: 0.625, drawn once or from both sides."""
    south, north = (
        sheet([-5, 0, 4], [10, 0, 0], [0, 0, 5]),
        sheet([5, 0, 4], [-10, 0, 0], [0, 0, 5]),
    )
    for objects in ([south], [north], [south, north]):
        scene = scene_of(*objects, plain=None)
        transfer = trace(scene, estimator, samples=4096, max_bounces=1)
        assert transfer.diffuse_relative == pytest.approx(0.625, abs=0.02)
        before = (transfer.surfaces.normal @ transfer.suns.direction.T > 0).astype(float)
        assert transfer.visible_share == pytest.approx(before, abs=0.02)
        assert len(sheets_of(scene)) == len(objects)


@pytest.mark.slow
@pytest.mark.parametrize("ground", ["none", "auto"])
def test_a_slab_above_streets_in_pieces(ground):
    """No piece is known as ground: what lies below a thin thing tells that it hangs."""
    streets = [
        sheet([x, y, 0], [10, 0, 0], [0, 10, 0])
        for x in range(-30, 30, 10)
        for y in range(-30, 30, 10)
    ]
    scene = scene_of(*streets, box((-5, -5, 3), (5, 5, 3.005)), plain=None, ground=ground)
    assert not scene.footprint.any() and not scene.sheet.any()
    assert scene.vertices[:, 2].max() == pytest.approx(3.005, abs=1e-6)
    transfer = trace(scene, max_bounces=3)
    assert transfer.diffuse_relative[37] == pytest.approx(radiosity_below(10, 3, 0.25, 3), rel=0.03)
