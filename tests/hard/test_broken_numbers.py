"""Broken numbers in: an error that names the array, the place and the cure; never NaN out, never a crash."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from closed import box
from scenes import join, strip, suns_towards

from citypv.core.effects.closed_form import find_unobstructed, ground_view_of_tilt, sky_view_of_tilt
from citypv.core.effects.plan_effects import plan_effects
from citypv.core.errors import InputError
from citypv.core.light.solve_radiosity import radiosity_factor, solve_radiosity
from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.light.sun_visibility import SunWatch, sun_visibility
from citypv.core.light.trace_gather import trace_gather
from citypv.core.light.trace_hemisphere import trace_hemisphere
from citypv.core.patches.find_resting_floors import find_resting_floors
from citypv.core.patches.patches import patches_of_scene
from citypv.core.progress import silent
from citypv.core.rays.ray_scene import RayScene
from citypv.core.request import Request, check_request

SCENE = join([strip([-20, -20, 0], [40, 0, 0], [0, 40, 0], 2), *box((-5, -5, 0), (5, 5, 10))])
COUNT = len(SCENE.triangles)
SUNS = suns_towards([[0.3, -0.8, 0.6], [0, 0, 1]])
NUMBERS = [np.nan, np.inf, -np.inf, 1e38, -1e38, 1e300]


def spoiled(values, place, number):
    values = np.array(values, float)
    values[place] = number
    return values


def broken_scenes():
    """Name of the array and what is said of it, and a scene with that array broken."""
    for number in NUMBERS:
        yield "vertices: vertex 5 is", replace(SCENE, vertices=spoiled(SCENE.vertices, (5, 1), number))
    yield r"vertices: shape \(3, 2\)", replace(SCENE, vertices=np.zeros((3, 2)))
    yield r"vertices: shape \(3,\)", replace(SCENE, vertices=np.zeros(3))
    yield "vertices: values of type object", replace(SCENE, vertices=np.full((4, 3), None))
    yield "vertices: values of type complex128", replace(SCENE, vertices=SCENE.vertices.astype(complex))
    yield "triangles: triangle 0 is .* there are 0 vertices", replace(SCENE, vertices=np.zeros((0, 3)))
    for index in (-1, len(SCENE.vertices), 2**31 - 1, -(2**31)):
        triangles = SCENE.triangles.copy()
        triangles[3, 2] = index
        yield "triangles: triangle 3 is", replace(SCENE, triangles=triangles)
    yield r"triangles: shape \(16, 4\)", replace(SCENE, triangles=np.zeros((COUNT, 4), int))
    yield "triangles: values of type float64", replace(SCENE, triangles=SCENE.triangles.astype(float))
    surface = SCENE.triangle_surface.copy()
    surface[4] = len(SCENE.surfaces)
    yield "triangle_surface: row 4 is", replace(SCENE, triangle_surface=surface)
    yield "triangle_surface: row 4 is", replace(SCENE, triangle_surface=np.where(surface == surface[4], -2, surface))
    yield r"triangle_surface: shape \(15,\)", replace(SCENE, triangle_surface=surface[1:])
    yield "triangle_surface: values of type float64", replace(SCENE, triangle_surface=surface.astype(float))
    for name in ("footprint", "closure"):
        yield f"{name}: shape", replace(SCENE, **{name: np.zeros(COUNT + 1, bool)})
        yield f"{name}: values of type float64", replace(SCENE, **{name: np.zeros(COUNT)})


def albedo():
    return np.full(COUNT, 0.25)


USERS = {
    "trace_gather": lambda scene: trace_gather(scene, SUNS, Request(), silent),
    "patches_of_scene": lambda scene: patches_of_scene(scene, albedo(), 0),
    "find_resting_floors": find_resting_floors,
    "trace_sun_samples": lambda scene: trace_sun_samples(scene, None, [SUNS], Request(), silent),
}


@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize(("words", "scene"), list(broken_scenes()))
def test_a_broken_scene(user, words, scene):
    with pytest.raises(InputError, match=words) as caught:
        USERS[user](scene)
    assert str(caught.value).count("\n") == 0
    assert caught.value.cure.split()[0] in ("give", "check")


def broken_suns():
    for number in NUMBERS:
        yield "direction of the suns: row 1 is", replace(SUNS, direction=spoiled(SUNS.direction, (1, 2), number))
        yield "weight of the suns: row 1 is", replace(SUNS, weight=spoiled(SUNS.weight, 1, number))
    yield "weight of the suns: row 0 is -0.5", replace(SUNS, weight=np.array([-0.5, 1.0]))
    yield r"weight of the suns: shape \(3,\)", replace(SUNS, weight=np.ones(3) / 3)
    yield r"direction of the suns: shape \(2, 2\)", replace(SUNS, direction=SUNS.direction[:, :2])
    yield "row 0 is .* below the horizon", replace(SUNS, direction=SUNS.direction * [1, 1, -1])
    yield "give unit vectors", replace(SUNS, direction=SUNS.direction * 0.9)
    yield "give unit vectors", replace(SUNS, direction=SUNS.direction * 0)


@pytest.mark.parametrize(("words", "suns"), list(broken_suns()))
def test_broken_suns(words, suns):
    with pytest.raises(InputError, match=words):
        trace_gather(SCENE, suns, Request(), silent)


SETTINGS = {"samples": 3, "shadow_samples": 0, "max_bounces": -1, "albedo": 2, "ground_albedo": -1, "threads": 0}


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("number", [np.nan, np.inf, None])
def test_broken_settings(name, number):
    """NaN, infinity, and a number that is out of bounds."""
    value = SETTINGS[name] if number is None else number
    with pytest.raises(InputError, match=f"--{name.replace('_', '-')}: {value}"):
        check_request(Request(**{name: value}))
    with pytest.raises(InputError):
        trace_gather(SCENE, SUNS, Request(**{name: value}), silent)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("place", [0, 999])
def test_embree_never_sees_a_broken_ray(number, place):
    rays = RayScene(SCENE.vertices, SCENE.triangles)
    good = np.tile(np.float32([0, 0, 1]), (1000, 1))
    bad = spoiled(good, (place, 1), number)
    with pytest.raises(InputError, match=f"ray_origins: row {place} is"):
        rays.trace_closest(bad, good)
    with pytest.raises(InputError, match=f"ray_directions: row {place} is"):
        rays.trace_closest(good, bad)
    with pytest.raises(InputError, match=f"ray_origins: row {place} is"):
        rays.trace_blocked(bad, good[0])
    with pytest.raises(InputError, match="ray_direction: row 0 is"):
        rays.trace_blocked(good, bad[place])


def test_rays_of_the_wrong_shape_or_type():
    rays = RayScene(SCENE.vertices, SCENE.triangles)
    good = np.tile(np.float32([0, 0, 1]), (10, 1))
    for broken in (good[:, :2], good[0], good[None], np.zeros((10, 3), complex), np.full((10, 3), "0")):
        with pytest.raises(InputError, match=r"ray_origins: (shape|values)"):
            rays.trace_closest(broken, good)
        with pytest.raises(InputError, match=r"ray_origins: (shape|values)"):
            rays.trace_blocked(broken, good[0])
    with pytest.raises(InputError, match="9 rows for 10 ray_origins"):
        rays.trace_closest(good, good[:9])
    with pytest.raises(InputError, match="ray_direction: shape"):
        rays.trace_blocked(good, good)
    # Other number types and strides are the same rays.
    hit = rays.trace_closest(good, good)
    assert np.array_equal(hit, rays.trace_closest(good.astype(float), np.asfortranarray(good)))
    assert np.array_equal(hit, rays.trace_closest(np.repeat(good, 2, axis=0)[::2], good.astype(int)))
    assert len(rays.trace_closest(good[:0], good[:0])) == len(rays.trace_blocked(good[:0], good[0])) == 0


def test_broken_albedo():
    for values, words in (
        (np.full(COUNT - 1, 0.25), r"albedo: shape \(15,\)"),
        (spoiled(albedo(), 3, np.nan), "albedo: row 3 is nan"),
        (spoiled(albedo(), 3, 1.5), "albedo: row 3 is 1.5"),
        (np.full(COUNT, "bright"), "albedo: values of type"),
    ):
        with pytest.raises(InputError, match=words):
            patches_of_scene(SCENE, values, 0)


PATCHES = patches_of_scene(SCENE, albedo(), 0)
EVERY = np.ones(COUNT, bool)


def hemisphere(patches=PATCHES, traced=EVERY, samples=64):
    ray_scene = RayScene(SCENE.vertices, SCENE.triangles)
    return trace_hemisphere(
        ray_scene, patches, traced, sample_count=samples, reflections=True, threads=1, progress=silent
    )


def test_broken_hemisphere():
    with pytest.raises(InputError, match="traced: shape"):
        hemisphere(traced=EVERY[1:])
    with pytest.raises(InputError, match="traced: values of type int64"):
        hemisphere(traced=EVERY.astype(np.int64))
    for samples in (0, 2, 66, -4):
        with pytest.raises(InputError, match="sample_count"):
            hemisphere(samples=samples)
    for name in ("corner", "normal", "edges", "tangents", "offset"):
        broken = copy.deepcopy(PATCHES)
        getattr(broken, name)[...] = np.nan
        with pytest.raises(InputError, match="ray_"), np.errstate(invalid="ignore"):
            hemisphere(broken)


def test_broken_shadow_rays():
    ray_scene = RayScene(SCENE.vertices, SCENE.triangles)
    good = {
        "traced": EVERY,
        "unobstructed": ~EVERY,
        "covered": np.zeros((COUNT, 64), bool),
        "point_count": 16,
        "suns": (SUNS.direction, SUNS.weight),
    }

    def look(**changed):
        arrays = good | changed
        suns = arrays.pop("suns")
        return sun_visibility(SunWatch(ray_scene, PATCHES, **arrays), suns)

    assert np.isfinite(look().visible_share).all()
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
        with pytest.raises(InputError, match=name.removesuffix("s")):
            look(**{name: value})


def test_broken_reflections():
    found = hemisphere()
    factor = radiosity_factor(PATCHES, found.covered_share)
    light = np.ones((COUNT, 2), np.float32)
    reflected, _, _ = solve_radiosity(found.form_factors, factor, light, light, 3)
    assert np.isfinite(reflected).all()
    few = replace(found.form_factors, count=COUNT - 1)
    rows = found.form_factors.rows[0]
    astray, lost = (
        replace(found.form_factors, rows=[replace(rows, key=spoiled(rows.key, 7, key).astype(int))])
        for key in (-1, 10**9)
    )
    for name, arrays in (
        ("first: row 2 is", (found.form_factors, factor, spoiled(light, (2, 0), np.nan), light)),
        ("first: row 2 is", (found.form_factors, factor, spoiled(light, (2, 0), -1), light)),
        ("first: shape", (found.form_factors, factor, light[:, 0], light)),
        ("far_first: shape", (found.form_factors, factor, light, light[:, :1])),
        ("far_first: row 0 is", (found.form_factors, factor, light, spoiled(light, (0, 1), np.inf))),
        ("factor: row 1 is", (found.form_factors, spoiled(factor, 1, 1e38), light, light)),
        ("factor: shape", (found.form_factors, factor[1:], light, light)),
        ("form_factors: [0-9]+ patches instead of", (few, factor, light, light)),
        ("key of form_factors: entry 7 is", (astray, factor, light, light)),
        ("key of form_factors: entry 7 is", (lost, factor, light, light)),
    ):
        with pytest.raises(InputError, match=name):
            solve_radiosity(*arrays, 3)


def test_broken_closed_forms():
    for view in (sky_view_of_tilt, ground_view_of_tilt):
        with pytest.raises(InputError, match="normal: row 1 is"):
            view(spoiled(np.eye(3), (1, 1), np.nan))
        with pytest.raises(InputError, match="normal: shape"):
            view(np.ones(3))
    with pytest.raises(InputError, match="vertices: vertex 5 is"):
        find_unobstructed(PATCHES, spoiled(SCENE.vertices, (5, 0), np.inf))
    with pytest.raises(InputError, match="vertices: shape"):
        plan_effects(replace(SCENE, vertices=np.zeros((3, 2))), PATCHES, Request())


def test_nothing_broken_changes_nothing():
    """Lists and other number types are the same scene."""
    plain = replace(SCENE, vertices=SCENE.vertices.tolist(), triangles=SCENE.triangles.astype(np.int64))
    one, other = (patches_of_scene(scene, albedo(), 0) for scene in (SCENE, replace(plain, vertices=SCENE.vertices)))
    assert np.array_equal(one.corner, other.corner)
    assert RayScene(plain.vertices, plain.triangles).triangle_count == COUNT
