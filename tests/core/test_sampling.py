"""Random numbers and sample points against what they must follow."""

import numpy as np
import pytest
from scenes import join, strip
from scipy import stats
from scipy.stats.qmc import Sobol
from thorough import mark_cases

from citypv.core.light.shadow_points import grid_of, points_of_grid
from citypv.core.patches.find_covered import stratified_points
from citypv.core.patches.patches import Patches
from citypv.core.rays.hemisphere_rays import hemisphere_rays
from citypv.core.rays.random_numbers import keys_of_names, uniform
from citypv.core.rays.sample_points import (
    DIGITS,
    Cells,
    additive_recurrence,
    barycentric_of_square,
    cosine_direction,
    sobol_digits,
)

(KEYS,) = keys_of_names([f"surface {number}" for number in range(5000)], 1)


def test_uniform_numbers_are_uniform_and_independent():
    numbers = uniform(KEYS, 8)
    assert numbers.min() >= 0
    assert numbers.max() < 1
    assert stats.kstest(numbers.ravel(), "uniform").pvalue > 0.001
    correlation = np.corrcoef(numbers.T) - np.eye(8)
    assert np.abs(correlation).max() < 5 / np.sqrt(len(KEYS))


def test_keys_follow_name_and_seed_not_place():
    assert keys_of_names(["b", "a"], 1)[0][1] == keys_of_names(["a", "c"], 1)[0][0]
    assert keys_of_names(["a"], 1)[0][0] != keys_of_names(["a"], 2)[0][0]


@pytest.mark.slow
def test_cosine_directions_have_the_moments_of_lambert():
    """For density cos/π: mean of z is 2/3, of z² 1/2, of x² 1/4."""
    points = additive_recurrence(1 << 16, 2)
    x, y, z = (part.astype(float) for part in cosine_direction(points[:, 0], points[:, 1]))
    assert x**2 + y**2 + z**2 == pytest.approx(1, abs=1e-6)
    assert z.mean() == pytest.approx(2 / 3, abs=1e-4)
    assert (z**2).mean() == pytest.approx(1 / 2, abs=1e-4)
    assert (x**2).mean() == pytest.approx(1 / 4, abs=1e-4)
    assert abs((x * y).mean()) < 1e-4


def test_square_maps_onto_the_triangle_with_equal_area():
    """Every congruent sub-triangle gets its share of the points."""
    points = additive_recurrence(1 << 16, 2)
    b1, b2 = barycentric_of_square(points[:, 0], points[:, 1])
    assert b1.min() >= 0
    assert b2.min() >= 0
    assert (b1 + b2).max() <= 1 + 1e-6
    counts = np.bincount(Cells(8).of_point(b1, b2), minlength=64)
    assert len(counts) == 64
    assert counts == pytest.approx(1024, rel=0.02)


@pytest.mark.parametrize("divisions", [1, 2, 3, 4, 8])
def test_stratified_points_lie_in_their_cells(divisions):
    numbers = uniform(KEYS[:200], 2 * divisions**2).reshape(200, divisions**2, 2)
    cells = Cells(divisions).of_point(*stratified_points(*np.moveaxis(numbers, -1, 0), divisions))
    inside = cells == np.arange(divisions**2)
    assert inside.mean() > 0.999  # a point on an edge may round to the neighbour


@pytest.mark.parametrize("count", mark_cases([1, 2, 4, 8, 16, 32, 64, 256, 1 << 18], kept=3))
def test_shadow_points_lie_evenly_in_all_bands(count):
    """One of them in each rectangle of area 1/count, whatever its shape, however the digits are
    turned over.
    """
    rows, columns = grid_of(count)
    points = points_of_grid(count).astype(np.int64)
    rectangle = (points[:, 1] * rows >> 24) * columns + (points[:, 0] * columns >> 24)
    assert (rectangle == np.arange(count)).all()
    turned = points ^ np.array([0xABCDEF, 0x123456])
    for wide in 2 ** np.arange(count.bit_length()):
        band = (turned[:, 0] * wide >> 24) * (count // wide) + (
            turned[:, 1] * (count // wide) >> 24
        )
        assert (np.sort(band) == np.arange(count)).all()


def test_cells_tile_the_triangle():
    corners = Cells(4).corners().astype(float)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert area == pytest.approx(1 / 32)  # all counter-clockwise, all congruent


def test_sobol_points_are_those_of_scipy():
    """Direction numbers of Joe and Kuo, in the order of the Gray code."""
    for count in (1, 2, 64, 1000, 1 << 14):
        points = Sobol(4, scramble=False).random_base2((count - 1).bit_length())[:count]
        assert np.array_equal(
            sobol_digits(count), np.round(points * (1 << DIGITS)).astype(np.uint32)
        )


@pytest.mark.slow
def test_where_a_ray_starts_says_nothing_of_its_direction():
    """The first ray of each patch and replicate: place on the unit square and height by the cosine
    law are three even and independent numbers, undone by hand from origins and directions.
    """
    scene = join([strip([0, 0, 0], [1000, 0, 0], [0, 1, 0], 1000)])
    patches = Patches.of_scene(scene, np.zeros(len(scene.triangles)), 0)
    chosen = np.arange(len(patches))
    origins, directions, _ = hemisphere_rays(patches, chosen, np.zeros((1, 4), np.uint32))
    along = (origins - patches.corner[:, None])[..., :2].astype(float)
    b1, b2 = (
        np.linalg.solve(
            np.swapaxes(patches.edges[:, None, :, :2], 2, 3).astype(float), along[..., None]
        )[..., 0]
        .reshape(-1, 2)
        .T
    )
    one, other = np.where(b2 > b1, 2 * b1, b1 + b2), np.where(b2 > b1, b1 + b2, 2 * b2)
    numbers = np.stack([one, other, 1 - directions[..., 2].ravel() ** 2])
    assert numbers.mean(axis=1) == pytest.approx(0.5, abs=0.02)
    # Four standard errors of the correlation of independent numbers.
    off = np.abs(np.corrcoef(numbers)[np.triu_indices(3, 1)])
    assert off.max() < 4 / np.sqrt(numbers.shape[1])
