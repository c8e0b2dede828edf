"""Reflected light of walls that touch other houses, and of roofs, against paths followed one by
one.

A wall that goes on inside its neighbour's house is lit in one part and dark in the other. Rays from
the dark part of one such wall meet the dark parts of others: with light taken for even over a
patch, they get 10 to 20 % too much of the second reflection on.

Each path starts at a random point and goes on, at random, from the very place that it meets; there
suns are looked for. Nothing is taken for even, and of the code that is tested only tree, fronts and
cover are used.
"""

import numpy as np
import pytest
from real_cities import SUNS, city_and_alone
from scenes import run_gather
from test_gather_is_forward import SAMPLES, light_of

from citypv.core.light.measure_cover import find_cover
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.trace_all import prepare_gather
from citypv.core.rays.sample_points import Cells, cosine_direction
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

BOUNCES = 3
PATHS, SETS, SEEDS = 120, 6, 3  # paths from each patch in each set, and runs of gather
PATCHES_AT_ONCE = 4000
ERRORS = 4.0

pytestmark = pytest.mark.thorough


def follow_paths(tracing, covered, chosen, generator):
    """Irradiance after each reflection, of patches `chosen`: (BOUNCES + 1, c, 2) under the sky and
    the suns.
    """
    light = np.zeros((BOUNCES + 1, len(chosen), 2))
    for first in range(0, len(chosen), PATCHES_AT_ONCE):
        part = slice(first, first + PATCHES_AT_ONCE)
        light[:, part] = follow_some(tracing, covered, chosen[part], generator)
    return light / PATHS


def follow_some(tracing, covered, chosen, generator):
    """Sums over the paths of a few patches: (BOUNCES + 1, c, 2)."""
    patches, trees = tracing.patches, tracing.ray_scene
    count, light = len(chosen), np.zeros((BOUNCES + 1, len(chosen), 2))
    root = np.repeat(np.arange(count), PATHS)
    weight = np.ones(len(root))
    u, v = np.sqrt(generator.random(len(root))), generator.random(len(root))
    place = chosen[root], (u * (1 - v)).astype(np.float32), (u * v).astype(np.float32)
    lit_ground = tracing.request.ground_albedo * np.array([1, SUNS.weight @ SUNS.direction[:, 2]])
    for bounce in range(BOUNCES + 1):
        local = np.stack(cosine_direction(*generator.random((2, len(root)), dtype=np.float32)))
        origins, directions = patches.leave(place, local)
        received = trace_shadow_rays(trees, patches.normal[place[0]], origins)
        light[bounce, :, 1] += np.bincount(root, weight * received, count)
        hit, b1, b2 = trees.trace_places(origins, directions)
        sky, far = (
            (hit < 0) & (directions[:, 2] > 0),
            np.flatnonzero((hit < 0) & (directions[:, 2] <= 0)),
        )
        light[bounce, :, 0] += np.bincount(root[sky], weight[sky], count)
        # What lies below the ground sees no lit ground.
        start = tuple(part[far] for part in place)
        below = (
            covered[start[0], Cells(8).of_point(*start[1:])]
            | patches.lie_in_earth(trees, origins[far][None])[0]
        )
        if bounce < BOUNCES:
            seen = np.bincount(root[far[~below]], weight[far[~below]], count)
            light[bounce + 1] += seen[:, None] * lit_ground
        going = (hit >= 0) & ~patches.meets_back(hit, directions) & patches.receives[hit]
        root, place = root[going], (hit[going], b1[going], b2[going])
        weight = weight[going] * patches.albedo[place[0]]
    return light


def trace_shadow_rays(trees, normal, origins):
    """What places receive of the suns, by weight: (m,) float64."""
    received = np.zeros(len(origins))
    for direction, weight in zip(SUNS.direction.astype(np.float32), SUNS.weight, strict=True):
        incidence = normal @ direction
        front = np.flatnonzero(incidence > 0)
        free = front[~trees.trace_blocked(origins[front], direction)]
        received[free] += weight * incidence[free]
    return received


def reflections_by_paths(scene, members):
    """Mean over some surfaces of what reflections add: (SETS, 2)."""
    prepared = prepare_scene(scene, Request())
    tracing = prepare_gather(prepared, Request(), silent)
    covered = find_cover(
        tracing.ray_scene, tracing.patches, tracing.patches.receives, tracing.threads
    )
    surface = prepared.scene.triangle_surface  # with the backs of sheets
    chosen = np.flatnonzero((surface >= 0) & members[surface] & tracing.patches.receives)
    area = tracing.patches.area[chosen] / scene.surfaces.area[members].sum()
    generator = np.random.default_rng(5)
    found = np.array(
        [area @ follow_paths(tracing, covered, chosen, generator) for _ in range(SETS)]
    )
    return found[:, 1:].sum(axis=1)


def reflections_by_gather(scene, members):
    """The same by gather: (SEEDS, 2)."""
    found, area = [], scene.surfaces.area[members]
    for seed in range(SEEDS):
        first, whole = light_of(
            run_gather(scene, SUNS, seed=seed, samples=SAMPLES, max_bounces=BOUNCES, report="all")
        )
        found.append(np.average((whole - first)[members], axis=0, weights=area))
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "group", "bias"),
    [("Manhattan", "walls", 0.005), ("Berlin", "walls", 0.005), ("Berlin", "roofs", 0.01)],
)
def test_reflected_light_is_that_of_paths(name, group, bias):
    scene, alone = city_and_alone(name, False)
    kinds = {"walls": ["facade"], "roofs": ["flat", "roof", "steep"]}[group]
    members = np.isin(scene.surfaces.kind, kinds) & (alone == (group == "roofs"))
    gather, paths = reflections_by_gather(scene, members), reflections_by_paths(scene, members)
    difference = gather.mean(axis=0) / paths.mean(axis=0) - 1
    variance = sum(runs.var(axis=0, ddof=1) / len(runs) for runs in (gather, paths))
    error = np.sqrt(variance) / paths.mean(axis=0)
    for light, one, other in zip(("sky", "suns"), difference, error, strict=True):
        print(f"{name} {group} {light} {100 * one:+.2f} ± {100 * other:.2f} %")
    assert (np.abs(difference) <= bias + ERRORS * error).all()
    assert error.max() < bias  # it says something
