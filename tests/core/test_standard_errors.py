"""Standard errors are as large as the errors and fall with the number of samples."""

from functools import cache

import numpy as np
import pytest
from scenes import join, rms, run_gather, scene_of_triangles, strip, suns_towards
from scipy import stats
from test_closed_forms import SUNS, direct_relative
from test_tracing import box, three_houses
from thorough import mark_cases

from citypv.core.city.split_edges import refine_triangles
from citypv.core.light.direct_errors import variance_of_neighbours
from citypv.core.light.shadow_points import grid_of, place_points, points_of_grid
from citypv.core.light.trace_gather import trace_gather
from citypv.core.rays.sample_points import DIGITS
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

SEEDS = (1, 2, 3)
TOO_SMALL = 1.10  # how far errors may exceed what is reported
DIFFUSE, DIRECT = 0, 1
ANYWHERE, ALIGNED = "anywhere", "aligned"


def patches_as_surfaces(scene):
    """Patches of four metres, each a surface."""
    vertices, triangles, _ = refine_triangles(scene.vertices, scene.triangles, 4.0)
    return scene_of_triangles(vertices, triangles)


@cache
def scene_and_suns(name):
    """Houses anywhere on their ground under five suns; houses that stand on whole patches, the sun
    in the zenith.
    """
    if name == ANYWHERE:
        return patches_as_surfaces(three_houses()), SUNS
    ground = strip([-32, -32, 0], [64, 0, 0], [0, 64, 0], 1)
    houses = (
        box((-16, -16, 0), (0, 0, 12)) + box((8, -8, 0), (16, 8, 20)) + box((-8, 8, 0), (8, 16, 8))
    )
    return patches_as_surfaces(join([ground, *houses])), suns_towards([[0, 0, 1]])


@cache
def traced(seed, samples, shadow_samples, bounces, name=ANYWHERE):
    """Of diffuse and annual direct light: (2, n) values and (2, n) standard errors."""
    scene, suns = scene_and_suns(name)
    request = Request(
        samples=samples, shadow_samples=shadow_samples, max_bounces=bounces, seed=seed, report="all"
    )
    transfer = trace_gather(scene, suns, request, silent)
    annual = direct_relative(transfer) @ suns.weight
    values = np.stack([transfer.diffuse_relative, annual])
    return values, np.stack(
        [transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error]
    )


def errors_of(part, known, settings):
    """Rms over all surfaces and seeds: reported, and against what is known."""
    runs = [traced(seed, *settings) for seed in SEEDS]
    return rms([errors[part] for _, errors in runs]), rms(
        [values[part] - known for values, _ in runs]
    )


LADDERS = {  # part, settings with 1, 4 and 16 times the samples, and those of a long run
    "sky": (DIFFUSE, [(n, 4, 0) for n in (64, 256, 1024)], (8192, 4, 0)),
    "sky and reflections": (DIFFUSE, [(n, 16, 3) for n in (64, 256, 1024)], (8192, 576, 3)),
    "suns": (DIRECT, [(64, n, 0) for n in (4, 16, 64)], (64, 1024, 0)),
    "suns and reflections": (DIRECT, [(16 * n, n, 3) for n in (4, 16, 64)], (8192, 576, 3)),
    "reflections": (
        DIRECT,
        [(n, 16, 3, ALIGNED) for n in (64, 256, 1024)],
        (16384, 16, 3, ALIGNED),
    ),  # no shadows
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    mark_cases(LADDERS, kept=1),
)
def test_errors_fall_and_are_reported(name):
    """With sixteen times the samples to a quarter at least; of some thousand surfaces and three
    seeds.
    """
    part, ladder, long = LADDERS[name]
    known = traced(9, *long)[0][part]
    assert len(known) > 2000
    reported, actual = np.array([errors_of(part, known, settings) for settings in ladder]).T
    assert (actual <= TOO_SMALL * reported).all()
    assert (reported < 1.6 * actual).all()
    for errors in (reported, actual):
        assert (np.diff(errors) < 0).all()
        assert np.log(errors[0] / errors[-1]) / np.log(16) >= 0.5


@pytest.mark.slow
def test_errors_of_patches_partly_under_a_house_are_not_missed_by_chance():
    """Few points stand on both sides of a wall's line: where they agree, they must not tell that
    nothing is unknown.
    """
    scene, suns = scene_and_suns(ANYWHERE)
    steps = []
    known = run_gather(scene, suns, samples=64, shadow_samples=1024, max_bounces=0, seed=9)
    partly = (known.covered_share > 0) & (known.covered_share < 1)
    for seed in range(6):
        transfer = run_gather(scene, suns, samples=64, max_bounces=0, seed=seed)
        difference = (direct_relative(transfer) - direct_relative(known)) @ suns.weight
        error = transfer.direct_annual_standard_error
        noisy = partly & (error > 0)
        assert noisy.sum() >= 0.97 * partly.sum()  # the others are taken to be covered wholly
        steps.append(difference[noisy] / error[noisy])
    steps = np.abs(np.concatenate(steps))
    assert len(steps) > 500
    assert rms(steps) < TOO_SMALL * stats.t.std(8)
    assert np.mean(steps > stats.t.ppf(0.995, 8)) < 0.01 * TOO_SMALL


def lines_across_a_triangle(angle, generator):
    """Straight lines at random places across a right triangle: their normals (2, k), their
    distances from the right angle (k,), and the area beyond them in closed form, as a share of the
    triangle's, (k,)."""
    normal = np.stack([np.cos(angle), np.sin(angle)])
    corners = np.sort(np.stack([np.zeros_like(angle), *normal]), axis=0)
    edge = generator.uniform(corners[0], corners[2])
    low, middle, high = corners
    before = 1 - (edge - low) ** 2 / np.maximum((middle - low) * (high - low), 1e-12)
    beyond = (high - edge) ** 2 / np.maximum((high - low) * (high - middle), 1e-12)
    return normal, edge, np.where(edge < middle, before, beyond)


@pytest.mark.parametrize("count", [2, 4, 8, 16, 64, 256])
def test_what_is_left_of_the_variance_along_the_straight_edge_of_a_shadow(count):
    """Edges at any place and angle across a right triangle, whose lit area is known in
    closed form.
    """
    generator = np.random.default_rng(count)
    normal, edge, area = lines_across_a_triangle(generator.uniform(0, 2 * np.pi, 40000), generator)
    turned = (generator.random((40000, 2)) * (1 << DIGITS)).astype(np.uint32)
    places = np.empty((2, 40000, count), np.float32)
    place_points(turned, (points_of_grid(count), grid_of(count)), places)
    lit = (np.einsum("xn,xnm->nm", normal, places) > edge[:, None]).astype(np.float32)
    actual = np.mean((lit.mean(axis=1, dtype=float) - area) ** 2)
    assert 0.75 < np.sqrt(actual / variance_of_neighbours(lit).mean()) < 1.25


def test_light_that_only_slopes_and_light_that_is_even():
    """A slope of four along the columns: each point stands at the same place of its rectangle, and
    so none is wrong.
    """
    rows, columns = grid_of(16)
    slope = np.tile(np.arange(columns, dtype=np.float32), rows)[None]
    assert (
        variance_of_neighbours(slope) == 0
    )  # the places within rectangles tell, and here there are none
    assert variance_of_neighbours(np.ones((1, 16), np.float32)) == 0
