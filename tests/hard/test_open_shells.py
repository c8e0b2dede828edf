"""Open shells: models have missing faces; no wall is brightened or blackened by them beyond what
its own rays meet.
"""

from dataclasses import replace

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards
from thorough import mark_cases

from citypv.core.commands.plain_scenes import box, room

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0.9, 0.1, 0.15]])
GROUND = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 24)
HOUSE = box((-5, -5, 0), (5, 5, 10))
NEIGHBOUR = box((9, -5, 0), (19, 5, 12))
SIDES = ("roof", "floor", "south", "north", "east", "west")


def trace(parts, gone=(), **settings):
    """Light of a scene, or of one that lacks some triangles, whose rows stay."""
    settings = {
        "samples": 4096,
        "shadow_samples": 64,
        "effects": {"sky-rays": True, "shadow-rays": True},
    } | settings
    scene = join(parts)
    kept = np.setdiff1d(np.arange(len(scene.triangles)), gone)
    rows = {
        name: getattr(scene, name)[kept]
        for name in ("triangles", "triangle_surface", "footprint", "closure")
    }
    return run_gather(replace(scene, **rows), SUNS, **settings)


def of_side(transfer, house, side):
    """The two triangles of one side of a house; the ground comes first, then the houses."""
    first = 48 + 12 * house + 2 * SIDES.index(side)
    return np.arange(first, first + 2)


@pytest.fixture(scope="module")
def whole():
    return trace([GROUND, *HOUSE, *NEIGHBOUR])


@pytest.mark.parametrize("missing", mark_cases(["floor", "roof", "south", "east", "west"], kept=2))
def test_a_house_with_a_face_missing_lights_no_other(whole, missing):
    """Outer faces that cannot see the hole get what they always got; inside faces are not units of
    results.
    """
    found = trace([GROUND, *HOUSE, *NEIGHBOUR], of_side(whole, 0, missing))
    for side in set(SIDES) - {"floor", missing}:
        faces = of_side(whole, 0, side)
        assert found.sky_view_factor[faces] == pytest.approx(
            whole.sky_view_factor[faces], abs=1e-6
        ), side
        assert found.covered_share[faces].max() == 0, side
        assert found.visible_share[faces] == pytest.approx(whole.visible_share[faces], abs=1e-6), (
            side
        )
        assert found.diffuse_relative[faces] == pytest.approx(
            whole.diffuse_relative[faces], abs=0.01
        ), side
    for name in ("diffuse_relative", "sky_view_factor", "direct_reflected"):
        assert np.isfinite(getattr(found, name)).all()


@pytest.mark.slow
@pytest.mark.parametrize("height", [-0.02, 0, 0.001])
def test_a_wall_that_looks_into_an_open_house_keeps_the_rest_of_its_light(whole, height):
    """The neighbour's west wall sees the backs of the house through the missing east wall: those
    rays carry nothing, all others what they always did; it is not taken for covered.

    The ground lies above the house's floor, or below, or in its plane, where the processor decides
    which rays meet.
    """
    ground = strip([-60, -60, height], [120, 0, 0], [0, 120, 0], 24)
    found = trace([ground, *HOUSE, *NEIGHBOUR], of_side(whole, 0, "east"))
    wall = of_side(whole, 1, "west")
    assert (
        found.covered_share[wall].max() < 0.15
    )  # where the opening fills most of what a point sees
    # Through the opening no more sky is seen than beyond the house: none, for its other walls
    # stand.
    assert found.sky_view_factor[wall] == pytest.approx(whole.sky_view_factor[wall], abs=0.002)
    assert (found.diffuse_relative[wall] <= whole.diffuse_relative[wall] + 0.005).all()
    assert (found.diffuse_relative[wall] >= whole.diffuse_relative[wall] - 0.1).all()


@pytest.mark.slow
def test_all_walls_inverted(whole):
    """Walls turned inside out receive what falls on their fronts, inside; the neighbour and the
    ground around are not brightened, and what they lose is only what these walls reflected."""
    inverted = [HOUSE[0], HOUSE[1], *room((-5, -5, 0), (5, 5, 10))[2:]]
    found = trace([GROUND, *inverted, *NEIGHBOUR])
    for side in ("south", "north", "east", "west"):
        faces = of_side(whole, 0, side)
        assert found.sky_view_factor[faces].max() == 0, side
        assert found.visible_share[faces].max() == 0, side
    wall = of_side(whole, 1, "west")
    assert found.sky_view_factor[wall] == pytest.approx(whole.sky_view_factor[wall], abs=1e-6)
    assert found.visible_share[wall] == pytest.approx(whole.visible_share[wall], abs=1e-6)
    assert (found.diffuse_relative[wall] <= whole.diffuse_relative[wall] + 1e-3).all()
    assert (
        found.covered_share[wall].max() <= 0.25
    )  # where the backs beside it fill most of what it sees
