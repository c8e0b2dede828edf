"""Trails of rays: parts of a city that rays pass, against points along the rays."""

import numpy as np
import pytest
from cities import box, make_city

from citypv.core.patches.patches import patches_of_scene
from citypv.core.rays.ray_scene import HitPlaces, RayScene
from citypv.core.rays.trail import SQUARES, begin_trail, boxes_of_patches
from citypv.core.settings.request import Request
from citypv.core.study import place_city

REQUEST = Request(latitude=50.0, longitude=8.0, threads=1)


@pytest.fixture(scope="module")
def scene():
    houses = [part for k in range(9) for part in box(f"b{k}", 15 * (k % 3), 20 * (k // 3), 8, 9, 0, 5 + 4 * k)]
    return place_city(make_city(houses), REQUEST)


def test_a_box_at_any_point_of_a_ray_asks_its_patch(scene):
    generator, patches = np.random.default_rng(1), patches_of_scene(scene, np.zeros(len(scene.triangles)), 0)
    trail, tracer = begin_trail(scene, boxes_of_patches(patches)), RayScene(scene.vertices, scene.triangles)
    rays = 400
    owner, reach = generator.integers(0, len(patches), rays), scene.vertices.max(axis=0) - scene.vertices.min(axis=0)
    origins = scene.vertices.min(axis=0) + reach * generator.uniform(0, 1, (rays, 3))
    directions = generator.normal(size=(rays, 3)) * [1, 1, generator.choice([0.1, 1.0])]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    origins, directions = origins.astype(np.float32), directions.astype(np.float32)
    directions[:20] = np.tile(np.float32([[0, 0, 1], [1, 0, 0], [0, -1, 0], [0, 0, -1]]), (5, 1))
    hits = tracer.trace_places(origins, directions)
    trail.note((patches.corner, patches.edges), owner, (origins, directions), hits)
    corners = scene.vertices[scene.triangles[hits.triangle]]
    ends = corners[:, 0] + hits.b1[:, None] * (corners[:, 1] - corners[:, 0])
    ends += hits.b2[:, None] * (corners[:, 2] - corners[:, 0])
    length = np.where(hits.triangle >= 0, ((ends - origins) * directions).sum(axis=1), 300.0)
    for share in generator.uniform(0, 1, 5):
        places = origins + (share * length)[:, None] * directions
        for ray in range(rays):
            assert trail.passing(np.stack([places[ray], places[ray]])[None])[owner[ray]]


def test_what_no_ray_passes_asks_nothing_and_what_lies_beyond_asks_all(scene):
    patches = patches_of_scene(scene, np.zeros(len(scene.triangles)), 0)
    trail = begin_trail(scene, boxes_of_patches(patches))
    assert trail.seen.shape == (len(patches), SQUARES, 3)
    assert not trail.passing(np.zeros((0, 2, 3))).any()
    middle = patches.corner[0].astype(float)
    near = trail.passing(np.stack([middle, middle])[None])
    assert near[0]
    assert near.mean() < 0.3  # patches in the same square
    ray = np.float32([[0, 0, 400.0]]), np.float32([[1, 0, 0]])
    nothing = HitPlaces(np.array([-1], np.int32), *np.zeros((2, 1), np.float32))
    trail.note((patches.corner, patches.edges), np.array([0]), ray, nothing)
    assert not trail.passing(np.array([[[0.0, 0, 0], [1, 1, 1]]])).all()
    assert trail.passing(np.array([[[1e5, 0, 0], [1e5, 1, 1]]])).all()
    moved = trail.of_others(boxes_of_patches(patches), np.arange(len(patches))[::-1])
    assert (moved.seen[::-1] & trail.seen == trail.seen).all()
