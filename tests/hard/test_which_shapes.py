"""Which shapes: slivers, needles, shafts and overhangs, each with its closed form."""

import numpy as np
import pytest
from scenes import scene_of_triangles, strip, suns_towards
from test_which_geometry import SUNS, assert_unshaded, trace

from citypv.core.commands.plain_scenes import box


@pytest.mark.parametrize("aspect", [1e3, 1e6])
def test_slivers(aspect):
    """A roof cut into slivers as thin as rounding lets them be: each gets what the whole
    roof gets.
    """
    thin = 100 / aspect
    parts = [strip([0, place * thin, 5], [100, 0, 0], [0, thin, 0], 1) for place in range(20)]
    transfer = trace([*parts, *box((0, -20, 0), (100, -10, 30))], samples=1024)
    slivers = np.arange(40)
    assert np.isfinite(transfer.diffuse_relative).all()
    wide = trace(
        [strip([0, 0, 5], [100, 0, 0], [0, 20 * thin, 0], 1), *box((0, -20, 0), (100, -10, 30))]
    )
    assert transfer.covered_share[slivers].max() == 0
    assert transfer.sky_view_factor[slivers].mean() == pytest.approx(
        wide.sky_view_factor[:2].mean(), abs=0.01
    )
    assert transfer.visible_share[slivers].mean(axis=0) == pytest.approx(
        wide.visible_share[:2].mean(axis=0), abs=0.02
    )


def test_triangles_of_a_tenth_of_a_millimetre():
    """1e-8 m²: a hundred of them on a lawn, in the middle of a city of 2 km."""
    small = 1.41e-4
    specks = [
        strip([3 + 0.01 * place, 2, 0.5], [small, 0, 0], [0, small, 0], 1) for place in range(50)
    ]
    transfer = trace(
        [strip([-1000, -1000, 0], [2000, 0, 0], [0, 2000, 0], 1), *specks], samples=1024
    )
    assert transfer.surfaces.area[2:] == pytest.approx(1e-8, rel=0.02)
    assert_unshaded(transfer, np.arange(2, 102), sample_error=1e-6)
    assert transfer.sky_view_factor[:2] == pytest.approx(1, abs=1e-6)


@pytest.mark.slow
def test_a_triangle_without_area_is_no_number_and_no_light():
    points = np.array([[0, 0, 5], [1, 0, 5], [2, 0, 5], [0, 1, 5], [0.5, 0.5, 5]], float)
    for degenerate in ([0, 1, 2], [0, 0, 1], [3, 3, 3]):
        whole = scene_of_triangles(points, [[0, 2, 3], degenerate], [0, 0])
        transfer = trace(whole)
        assert transfer.diffuse_relative == pytest.approx(1, abs=1e-6)
        alone = scene_of_triangles(points, [[0, 2, 3], [0, 2, 4]], [0, 1])
        alone.triangles[1] = degenerate
        transfer = trace(alone)
        for name in (
            "diffuse_relative",
            "diffuse_relative_standard_error",
            "sky_view_factor",
            "covered_share",
        ):
            assert np.isfinite(getattr(transfer, name)).all(), name
        assert transfer.diffuse_relative[1] == 0
        assert transfer.visible_share[1].max() == 0


@pytest.mark.parametrize("width", [0.1, 0.001])
def test_a_needle_tower(width):
    """300 m high and next to nothing wide: its walls are unshaded, and it shades next to
    nothing.
    """
    ground = strip([-100, -100, 0], [200, 0, 0], [0, 200, 0], 8)
    transfer = trace([ground, *box((0, 0, 0), (width, width, 300))], samples=4096)
    walls = 16 + np.arange(4, 12)
    assert transfer.sky_view_factor[walls] == pytest.approx(0.5, abs=0.01)
    assert transfer.covered_share[walls].max() == 0
    front = transfer.surfaces.normal[walls] @ SUNS.direction.T > 1e-6
    assert transfer.visible_share[walls] == pytest.approx(front.astype(float), abs=1e-6)
    assert np.average(
        transfer.sky_view_factor[:16], weights=transfer.surfaces.area[:16]
    ) > 1 - 0.02 * np.sqrt(width)


def test_a_roof_overhang_of_one_centimetre():
    """The wall below sees the sun but for the overhang's shadow: 1 cm · tan(elevation)."""
    wall = strip([0, 0, 0], [10, 0, 0], [0, 0, 1], 1)
    roof = [
        strip([0, -0.01, 1], [10, 0, 0], [0, 5, 0], 1),
        strip([0, -0.01, 1], [0, 5, 0], [10, 0, 0], 1),
    ]
    elevation = np.radians([30, 60, 80])
    suns = suns_towards(np.column_stack([np.zeros(3), -np.cos(elevation), np.sin(elevation)]))
    transfer = trace([wall, *roof], suns, shadow_samples=1 << 16)
    shadow = 0.01 * np.tan(elevation)
    assert 1 - transfer.visible_share[:2].mean(axis=0) == pytest.approx(shadow, abs=0.001)
    assert transfer.covered_share[:2].max() == 0
