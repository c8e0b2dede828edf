"""Broken numbers in: an error that names the array, the place and the cure; never NaN out, never a
crash.
"""

import copy
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from broken import COUNT, HOUSE, NUMBERS, SUNS, refused, spoiled
from scenes import run_forward, run_gather, trace_patches

from citypv.core.city.find_ground import find_resting_floors
from citypv.core.effects.closed_form import find_unobstructed, ground_view_of_tilt, sky_view_of_tilt
from citypv.core.effects.plan_effects import plan_effects
from citypv.core.light.solve_radiosity import radiosity_factor, solve_radiosity
from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.light.sun_visibility import SunWatch, sun_visibility
from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather
from citypv.core.patches.patches import Patches
from citypv.core.rays.ray_scene import RayScene
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

ALBEDO = np.full(COUNT, 0.25)
PATCHES = Patches.of_scene(HOUSE, ALBEDO, 0)
EVERY = np.ones(COUNT, bool)
UP = np.tile(np.float32([0, 0, 1]), (1000, 1))


def broken_scenes():
    """Name of the array and what is said of it, and the arrays that are broken."""
    surface = HOUSE.triangle_surface.copy()
    surface[4] = len(HOUSE.surfaces)
    for number in NUMBERS:
        yield "vertices: vertex 5 is", {"vertices": spoiled(HOUSE.vertices, (5, 1), number)}
    for index in (-1, len(HOUSE.vertices), 2**31 - 1, -(2**31)):
        triangles = HOUSE.triangles.copy()
        triangles[3, 2] = index
        yield "triangles: triangle 3 is", {"triangles": triangles}
    yield r"vertices: shape \(3, 2\)", {"vertices": np.zeros((3, 2))}
    yield "vertices: values of type object", {"vertices": np.full((4, 3), None)}
    yield "vertices: values of type complex128", {"vertices": HOUSE.vertices.astype(complex)}
    yield "triangles: triangle 0 is .* there are 0 vertices", {"vertices": np.zeros((0, 3))}
    yield r"triangles: shape \(16, 4\)", {"triangles": np.zeros((COUNT, 4), int)}
    yield "triangles: values of type float64", {"triangles": HOUSE.triangles.astype(float)}
    yield "triangle_surface: row 4 is", {"triangle_surface": surface}
    yield (
        "triangle_surface: row 4 is",
        {"triangle_surface": np.where(surface == surface[4], -2, surface)},
    )
    yield r"triangle_surface: shape \(15,\)", {"triangle_surface": surface[1:]}
    for name in ("footprint", "closure"):
        yield f"{name}: shape", {name: np.zeros(COUNT + 1, bool)}
        yield f"{name}: values of type float64", {name: np.zeros(COUNT)}


USERS = {
    "trace_gather": lambda scene: run_gather(scene, SUNS),
    "trace_forward": lambda scene: run_forward(scene, SUNS),
    "patches_of_scene": lambda scene: Patches.of_scene(scene, ALBEDO, 0),
    "find_resting_floors": find_resting_floors,
    "trace_sun_samples": lambda scene: trace_sun_samples(scene, None, [SUNS], Request(), silent),
}


@pytest.mark.parametrize("user", USERS)
def test_a_broken_scene(user):
    for words, arrays in broken_scenes():
        refused(words, USERS[user], replace(HOUSE, **arrays))


def test_broken_suns():
    direction, weight = SUNS.direction, SUNS.weight
    numbers = [("direction", direction, (1, 2), number) for number in NUMBERS]
    numbers += [("weight", weight, 1, number) for number in (*NUMBERS[:5], -0.5)]
    for name, values, place, number in numbers:
        broken = replace(SUNS, **{name: spoiled(values, place, number)})
        for trace in (trace_gather, trace_forward):
            refused(f"{name} of the suns: row 1 is", trace, HOUSE, broken, Request(), silent)
    for words, arrays in (
        (r"weight of the suns: shape \(3,\)", {"weight": np.ones(3) / 3}),
        (r"direction of the suns: shape \(5, 2\)", {"direction": direction[:, :2]}),
        ("row 0 is .* below the horizon", {"direction": direction * [1, 1, -1]}),
        ("give unit vectors", {"direction": direction * 0.9}),
        ("give unit vectors", {"direction": direction * 0}),
    ):
        refused(words, trace_gather, HOUSE, replace(SUNS, **arrays), Request(), silent)


SETTINGS = {
    "samples": 3,
    "shadow_samples": 0,
    "max_bounces": -1,
    "albedo": 2,
    "ground_albedo": -1,
    "threads": 0,
}


@pytest.mark.parametrize("name", SETTINGS)
def test_broken_settings(name):
    """NaN, infinity, and a number that is out of bounds."""
    for value in (np.nan, np.inf, SETTINGS[name]):
        with pytest.raises(InputError, match=f"--{name.replace('_', '-')}: {value}"):
            Request(**{name: value}).check()
        with pytest.raises(InputError):
            run_gather(HOUSE, SUNS, **{name: value})


@pytest.mark.parametrize("place", [0, 999])
def test_embree_never_sees_a_broken_ray(place):
    rays = RayScene(HOUSE.vertices, HOUSE.triangles)
    for number in NUMBERS[:5]:
        bad = spoiled(UP, (place, 1), number)
        refused(f"ray_origins: row {place} is", rays.trace_closest, bad, UP)
        refused(f"ray_directions: row {place} is", rays.trace_closest, UP, bad)
        refused(f"ray_origins: row {place} is", rays.trace_blocked, bad, UP[0])
        refused("ray_direction: row 0 is", rays.trace_blocked, UP, bad[place])


def test_rays_of_the_wrong_shape_or_type():
    rays, good = RayScene(HOUSE.vertices, HOUSE.triangles), UP[:10]
    for broken in (
        good[:, :2],
        good[0],
        good[None],
        np.zeros((10, 3), complex),
        np.full((10, 3), "0"),
    ):
        refused(r"ray_origins: (shape|values)", rays.trace_closest, broken, good)
        refused(r"ray_origins: (shape|values)", rays.trace_blocked, broken, good[0])
    refused("9 rows for 10 ray_origins", rays.trace_closest, good, good[:9])
    refused("ray_direction: shape", rays.trace_blocked, good, good)
    # Other number types and strides are the same rays.
    hit = rays.trace_closest(good, good)
    assert np.array_equal(hit, rays.trace_closest(good.astype(float), np.asfortranarray(good)))
    assert np.array_equal(
        hit, rays.trace_closest(np.repeat(good, 2, axis=0)[::2], good.astype(int))
    )
    assert (
        len(rays.trace_closest(good[:0], good[:0]))
        == len(rays.trace_blocked(good[:0], good[0]))
        == 0
    )


def test_broken_albedo():
    for values, words in (
        (np.full(COUNT - 1, 0.25), r"albedo: shape \(15,\)"),
        (spoiled(ALBEDO, 3, np.nan), "albedo: row 3 is nan"),
        (spoiled(ALBEDO, 3, 1.5), "albedo: row 3 is 1.5"),
        (np.full(COUNT, "bright"), "albedo: values of type"),
    ):
        refused(words, Patches.of_scene, HOUSE, values, 0)


def hemisphere(patches=PATCHES):
    return trace_patches(RayScene(HOUSE.vertices, HOUSE.triangles), patches, np.arange(COUNT), 64)


def test_broken_hemisphere():
    for name in ("corner", "normal", "edges", "tangents", "offset"):
        broken = copy.deepcopy(PATCHES)
        getattr(broken, name)[...] = np.nan
        with np.errstate(invalid="ignore"):
            refused("ray_", hemisphere, broken)


@pytest.mark.slow
def test_broken_shadow_rays():
    ray_scene = RayScene(HOUSE.vertices, HOUSE.triangles)
    good = {
        "traced": EVERY,
        "unobstructed": ~EVERY,
        "covered": np.zeros((COUNT, 64), bool),
        "point_count": 16,
    }
    good |= {"suns": (SUNS.direction, SUNS.weight)}

    def look(**changed):
        arrays = good | changed
        suns = arrays.pop("suns")
        return sun_visibility(SunWatch(ray_scene, PATCHES, **arrays), suns)

    assert np.isfinite(look()[0].visible_share).all()
    for name, value in (
        ("traced", EVERY[1:]),
        ("unobstructed", np.zeros(COUNT)),
        ("covered", np.zeros((COUNT, 63), bool)),
        ("covered", np.zeros(COUNT, bool)),
        ("point_count", 15),
        ("point_count", 0),
        ("suns", (spoiled(SUNS.direction, (0, 0), np.nan), SUNS.weight)),
        ("suns", (SUNS.direction, SUNS.weight[:1])),
        ("suns", (SUNS.direction, spoiled(SUNS.weight, 0, np.inf))),
    ):
        refused(name.removesuffix("s"), look, **{name: value})


def test_broken_reflections():
    found = hemisphere()
    factors, factor = found.form_factors, radiosity_factor(PATCHES, found.covered_share)
    light = np.ones((COUNT, 2), np.float32)
    solve = partial(solve_radiosity, max_bounces=3)
    assert np.isfinite(solve(factors, factor, light, light)).all()
    rows = factors.rows[0]
    rows = {
        (name, value): replace(rows, **{name: spoiled(getattr(rows, name), 7, value).astype(int)})
        for name, value in (("key", -1), ("key", 10**9))
    }
    for name, arrays in (
        ("first: row 2 is", (factors, factor, spoiled(light, (2, 0), np.nan), light)),
        ("first: row 2 is", (factors, factor, spoiled(light, (2, 0), -1), light)),
        ("first: shape", (factors, factor, light[:, 0], light)),
        ("far_first: shape", (factors, factor, light, light[:, :1])),
        ("far_first: row 0 is", (factors, factor, light, spoiled(light, (0, 1), np.inf))),
        ("factor: row 1 is", (factors, spoiled(factor, 1, 1e38), light, light)),
        ("factor: shape", (factors, factor[1:], light, light)),
        (
            "form_factors: [0-9]+ patches instead of",
            (replace(factors, count=COUNT - 1), factor, light, light),
        ),
    ):
        refused(name, solve, *arrays)
    for (name, _), broken in rows.items():
        refused(
            f"{name} of form_factors: entry 7 is",
            solve,
            replace(factors, rounds=[[broken]]),
            factor,
            light,
            light,
        )


def test_broken_closed_forms():
    for view in (sky_view_of_tilt, ground_view_of_tilt):
        refused("normal: row 1 is", view, spoiled(np.eye(3), (1, 1), np.nan))
        refused("normal: shape", view, np.ones(3))
    refused(
        "vertices: vertex 5 is", find_unobstructed, PATCHES, spoiled(HOUSE.vertices, (5, 0), np.inf)
    )
    refused(
        "vertices: shape",
        plan_effects,
        replace(HOUSE, vertices=np.zeros((3, 2))),
        PATCHES,
        Request(),
    )
