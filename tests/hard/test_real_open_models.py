"""Real open models: Midtown Manhattan and a tile of North Rhine-Westphalia, each wall held against
its own rays.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from own_rays import BACK, FAR, FRONT, INSIDE, SKY, OwnRays
from scenes import trace_patches

from citypv.core.city.build_scene import build_scene
from citypv.core.light.sun_visibility import SunWatch, sun_visibility
from citypv.core.patches.patches import Patches
from citypv.core.rays.ray_scene import RayScene
from citypv.core.read.read_city import read_city

DATA = Path(__file__).parents[1] / "data"
FILES = {
    "Manhattan": ("obj/nyc_midtown_citicorp_1km.obj.gz", {"latitude": 40.757, "longitude": -73.97}),
    "North Rhine": ("citygml/nrw_LoD2_32_280_5659_1_NW.gml.gz", {}),
}
TOWNS = [pytest.param("Manhattan", marks=pytest.mark.thorough), "North Rhine"]
WALLS = 500  # patches, drawn by area
RAYS = 4096  # of each
POINTS = 64  # of each that are judged, by as many rays
ERRORS = 4.5  # standard errors that a thousand comparisons with fixed seeds stay within
SUNS = np.array([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0.9, 0.1, 0.15]])
SUNS = SUNS / np.linalg.norm(SUNS, axis=1, keepdims=True)

pytestmark = pytest.mark.slow


@cache
def scene_of(town):
    name, place = FILES[town]
    return build_scene(read_city([DATA / name]), patch_size=25.0, **place)


@cache
def walls_of(town):
    """Patches of the scene, some of its walls, and what their own rays say."""
    scene = scene_of(town)
    patches = Patches.of_scene(scene, np.full(len(scene.triangles), 0.25), 0)
    own, generator = OwnRays(scene, patches.offset), np.random.default_rng(2)
    kind = np.append(scene.surfaces.kind, "ground")[scene.triangle_surface]
    weight = np.where((kind == "facade") & ~scene.closure, own.area, 0)
    rows = np.sort(generator.choice(len(weight), WALLS, replace=False, p=weight / weight.sum()))
    by_ray = own.shares(rows, RAYS, 1, generator).mean(axis=1)
    return patches, rows, own, by_ray, own.shares(rows, POINTS, POINTS, generator, inside=True)


def look(town):
    """What the tracer says of the same walls: shares (n, 3) of sky, far ground and fronts, and the
    whole answer.
    """
    scene, (patches, rows, *_) = scene_of(town), walls_of(town)
    found = trace_patches(RayScene(scene.vertices, scene.triangles), patches, rows, RAYS, threads=2)
    met = np.asarray(found.form_factors.as_matrix().sum(axis=1)).reshape(found.sky.shape)
    return np.stack(
        [values[rows].mean(axis=1) for values in (found.sky, found.far_ground, met)], axis=1
    ), found


def is_covered(points):
    """By definition: more than half of a point's rays meet backs, at once or after going on from
    fronts, or none leaves however often they go on; or, below the ground, all but those that leave
    downwards meet backs."""
    backs = points[..., BACK]
    return (
        (backs > 0.5)
        | (points[..., INSIDE] > 0)
        | ((backs > 0.25) & (points[..., SKY] + points[..., FRONT] == 0))
    )


def complaints(town, shares):
    """Walls that get more than their own rays meet, and walls that get less than those of their
    points that are not covered: two (n, 3) bool."""
    _, _, _, by_ray, points = walls_of(town)
    by_ray = by_ray[:, : FRONT + 1]
    hidden = np.where(is_covered(points)[..., None], points[..., : FRONT + 1], 0)
    # Both are counts of rays; a share of which neither saw a ray may still be a few rays wide.
    middle = np.clip((shares + by_ray) / 2, 2 / RAYS, 1)
    variance = 2 * middle * (1 - middle) / RAYS
    brighter = shares - by_ray > ERRORS * np.sqrt(variance)
    variance = variance + hidden.var(axis=1, ddof=1) / POINTS
    darker = by_ray - hidden.mean(axis=1) - shares > ERRORS * np.sqrt(variance)
    return brighter, darker


@pytest.mark.thorough
@pytest.mark.parametrize("town", TOWNS)
def test_no_wall_is_brightened_or_blackened_beyond_its_own_rays(town):
    shares, found = look(town)
    brighter, darker = complaints(town, shares)
    assert not brighter.any()
    assert not darker[:, SKY].any()
    # Cells of a 64th judge the rest: along the edge of what is covered a tenth of it may go. Of
    # such walls the same points count twice: rays of others differed by 0.10 on a wall covered all
    # over, with a standard error of 0.06.
    _, rows, _, by_ray, points = walls_of(town)
    covered = is_covered(points)[..., None]
    uncovered = np.where(covered, 0, points[..., : FRONT + 1]).mean(axis=1)
    lost = np.where(covered.any(axis=1), uncovered, by_ray[:, : FRONT + 1])
    assert (lost - shares).max() < 0.09
    assert darker.mean(axis=0).max() < 0.03
    assert shares.mean(axis=0)[SKY] == pytest.approx(by_ray[:, SKY].mean(), abs=2e-3)
    assert shares.mean(axis=0)[FAR] == pytest.approx(lost.mean(axis=0)[FAR], abs=2e-3)
    # Who is called covered is so by definition, and the other way round.
    apart = np.abs(found.covered_share[rows] - is_covered(points).mean(axis=1))
    assert (found.covered_share[rows] > 0.5).sum() > 30
    assert apart.mean() < 0.01 and (apart > 0.2).mean() < 0.01


@pytest.mark.parametrize("town", TOWNS)
def test_no_wall_gets_more_or_less_sun_than_reaches_it(town):
    """Shadow rays of one's own from 1,024 points of each wall to three suns."""
    scene, (patches, rows, own, _, points) = scene_of(town), walls_of(town)
    _, found = look(town)
    ray_scene, traced = (
        RayScene(scene.vertices, scene.triangles),
        np.isin(np.arange(len(patches)), rows),
    )
    watch = SunWatch(
        ray_scene, patches, traced, np.zeros(len(patches), bool), found.covered, 1024, threads=2
    )
    light, *_ = sun_visibility(watch, (SUNS.astype(np.float32), np.ones(3, np.float32) / 3))
    lit = np.stack([own.lit(rows, 1024, sun, np.random.default_rng(7)) for sun in SUNS], axis=1)
    shares = light.visible_share[rows]
    assert 0.05 < lit.mean() < 0.6
    middle = np.clip((shares + lit) / 2, 2 / 1024, 1)
    error = np.sqrt(2 * middle * (1 - middle) / 1024)
    assert (shares - lit <= ERRORS * error).all()
    # Covered points are dark whatever shines through the holes of their house.
    covered = is_covered(points).mean(axis=1)[:, None]
    assert (lit - shares <= ERRORS * error + np.minimum(covered + 0.1 * (covered > 0), lit)).all()
    free = covered[:, 0] == 0
    assert shares[free].mean(axis=0) == pytest.approx(lit[free].mean(axis=0), abs=3e-3)
