"""Gather and forward, two estimators that share no ray, find the same light."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import run_forward, run_gather, scene_of_triangles, suns_towards
from test_closed_forms import direct_relative
from test_tracing import three_houses

from citypv.core.city.refine import refine_triangles

pytestmark = pytest.mark.once

ROOT = Path(__file__).parents[2]
SUNS = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3], [0.3, -0.9, 0.1], [0, 0, 1]])


def refined(scene, patch_size):
    """The same surfaces, cut into smaller patches."""
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, patch_size)
    return scene_of_triangles(vertices, triangles, parent)


def group_means(transfer, least=3):
    """Of each group of surfaces: label, mean and standard error of diffuse and of annual direct light.

    Surfaces count as independent. A photon reflected from one to the other makes that a little too small.
    """
    surfaces = transfer.surfaces
    annual = direct_relative(transfer) @ transfer.suns.weight
    found = {}
    for label in sorted(set(zip(surfaces.kind, surfaces.orientation, strict=True))):
        chosen = (surfaces.kind == label[0]) & (surfaces.orientation == label[1])
        if chosen.sum() < least:
            continue
        share = surfaces.area[chosen] / surfaces.area[chosen].sum()
        pairs = (
            (transfer.diffuse_relative, transfer.diffuse_relative_standard_error),
            (annual, transfer.direct_annual_standard_error),
        )
        found[label] = [
            (share @ value[chosen], np.sqrt(((share * error[chosen]) ** 2).sum())) for value, error in pairs
        ]
    return found


def compare(scene, suns, gather, forward):
    """Group by group: gather less forward, the standard error of that, and the reflected light of gather.

    Returns
    -------
    difference, error : (g, 2) float
        Of diffuse and of annual direct light.
    reflected : (g, 2) float
    """
    one, other = run_gather(scene, suns, **gather), run_forward(scene, suns, **forward)
    dark = group_means(replace(one, direct_reflected=0 * one.direct_reflected, diffuse_relative=one.sky_view_factor))
    one, other = group_means(one), group_means(other)
    assert list(one) == list(other)
    assert len(one) >= 3
    means, errors = (
        np.array([[[pair[part] for pair in side[key]] for key in one] for side in (one, other)]) for part in (0, 1)
    )
    before = np.array([[pair[0] for pair in dark[key]] for key in one])
    return means[0] - means[1], np.hypot(*errors), means[0] - before


@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_three_houses(bounces):
    scene = refined(three_houses(), 4.0)
    settings = {"max_bounces": bounces}
    difference, error, _ = compare(scene, SUNS, settings | {"samples": 256}, settings | {"samples": 100})
    assert error.max() < 0.01  # one reflection adds 0.03 to 0.1 on the walls
    assert (np.abs(difference) <= 4 * error + 1e-6).all()


TOWN_SUNS = [20, 71, 100]


@pytest.mark.thorough
def test_town_against_its_reference():
    """91,764 triangles, traced by another engine."""
    town = np.load(ROOT / "tests" / "data" / "town.npz")
    scene, suns = scene_of_triangles(town["vertices"], town["triangles"]), suns_towards(town["sun"][TOWN_SUNS])
    forward, triangle = run_forward(scene, suns, samples=40, far_ground=False), town["triangle"]
    share = scene.surfaces.area[triangle] / scene.surfaces.area[triangle].sum()
    diffuse = town["diffuse"] + town["diffuse_reflected"]
    direct = (town["direct"] + town["direct_reflected"])[:, TOWN_SUNS] @ suns.weight
    for found, single, known in (
        (forward.diffuse_relative, forward.diffuse_relative_standard_error, diffuse),
        (direct_relative(forward) @ suns.weight, forward.direct_annual_standard_error, direct),
    ):
        error = np.sqrt(((share * single[triangle]) ** 2).sum())
        assert error < 0.002  # the reflected part is 0.01 of direct and 0.06 of diffuse light
        assert abs(share @ found[triangle] - share @ known) < 4 * error
