"""Gather and forward, two estimators that share no ray, find the same light."""

import numpy as np
import pytest
from scenes import run_forward, run_gather, scene_of_triangles, suns_towards
from test_closed_forms import direct_relative
from test_tracing import three_houses
from thorough import mark_cases

from citypv.core.city.split_edges import refine_triangles

SUNS = suns_towards(
    [[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3], [0.3, -0.9, 0.1], [0, 0, 1]]
)


def refined(scene, patch_size):
    """The same surfaces, cut into smaller patches."""
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, patch_size)
    return scene_of_triangles(vertices, triangles, parent)


def group_means(transfer, least=3):
    """Of each group of surfaces: label, mean and standard error of diffuse and of annual direct
    light.

    Surfaces count as independent. A photon reflected from one to the other makes that a little too
    small.
    """
    surfaces = transfer.surfaces
    light = np.stack([transfer.diffuse_relative, direct_relative(transfer) @ transfer.suns.weight])
    error = np.stack(
        [transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error]
    )
    found = {}
    for label in sorted(set(zip(surfaces.kind, surfaces.orientation, strict=True))):
        chosen = (surfaces.kind == label[0]) & (surfaces.orientation == label[1])
        if chosen.sum() >= least:
            share = surfaces.area[chosen] / surfaces.area[chosen].sum()
            found[label] = np.stack(
                [light[:, chosen] @ share, np.sqrt(error[:, chosen] ** 2 @ share**2)], axis=1
            )
    return found


def compare(scene, suns, gather, forward):
    """Group by group: gather less forward, and the standard error of that, (g, 2) each, of diffuse
    and of annual direct light."""
    one, other = (
        group_means(run_gather(scene, suns, **gather)),
        group_means(run_forward(scene, suns, **forward)),
    )
    assert list(one) == list(other)
    assert len(one) >= 3
    one, other = (np.array([*groups.values()]) for groups in (one, other))  # (g, 2, 2)
    return one[..., 0] - other[..., 0], np.hypot(one[..., 1], other[..., 1])


@pytest.mark.slow
@pytest.mark.parametrize("bounces", mark_cases([0, 1, 3], kept=1))
def test_three_houses(bounces):
    scene = refined(three_houses(), 4.0)
    settings = {"max_bounces": bounces}
    difference, error = compare(
        scene, SUNS, settings | {"samples": 256}, settings | {"samples": 100}
    )
    assert error.max() < 0.01  # one reflection adds 0.03 to 0.1 on the walls
    assert (np.abs(difference) <= 4 * error + 1e-6).all()
