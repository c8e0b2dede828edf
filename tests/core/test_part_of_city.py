"""A part of a city in arrays of its own patches: the same light as in arrays of all patches."""

from dataclasses import replace

import numpy as np
import pytest
from small_city import house, surface, write_gml

from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.specular_light import trace_hybrid
from citypv.core.patches.materials import MaterialSpec
from citypv.core.run.part_of_city import BACKS, PartOfCity, keep_patches
from citypv.core.run.study import read_scene, read_year
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

REQUEST = Request(
    weather="clear-sky", threads=1, patch_size=2.0, samples=64, shadow_samples=4, report="all"
)


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """Three houses, one of which stands halfway inside another, and a thin wall: Scene,
    PreparedScene and Suns.
    """
    wall = surface("WallSurface", "thin", [(18, -4, 0), (18, 12, 0), (18, 12, 5), (18, -4, 5)])
    thin = f'<cityObjectMember><bldg:Building gml:id="t">{wall}</bldg:Building></cityObjectMember>'
    houses = (
        house("a", (0, 0), (12, 10, 8))
        + house("b", (20, -3), (10, 14, 14))
        + house("c", (8, 2), (8, 6, 3), 2)
    )
    scene = read_scene(
        [write_gml(tmp_path_factory.mktemp("city") / "city.gml", houses, thin)], REQUEST
    )
    weather = read_year(scene.site, REQUEST)
    prepared = prepare_scene(scene, REQUEST, weather=weather).build_tree(REQUEST)
    assert (
        scene.sheet.any()
        and (prepared.scene.triangle_surface < 0).any()
        and prepared.patches.ground.any()
    )
    return scene, prepared, choose_suns("days:4", *weather.axis, position=weather.data)


def traced(few, suns, part):
    """Transfer of some patches of a PartOfCity."""
    patches = few.prepared.patches
    receives = patches.receives.copy()
    receives[: len(few.patches)] &= part[few.patches]
    prepared = replace(few.prepared, patches=replace(patches, receives=receives))
    return trace_hybrid(few.scene, suns, REQUEST, silent, prepared=prepared)


def choose_part(scene, prepared, buildings, ground=True):
    """Patches of some buildings and half of the ground, if any; and the surfaces of these."""
    own = prepared.scene.triangle_surface
    counted = np.isin(scene.surfaces.building_id, buildings)
    return np.where(own >= 0, counted[own], ground & (np.arange(len(own)) % 2 == 0)), counted


def meet(prepared, part):
    """Patch that is met in place of each: itself in the part, else the first one of generated
    ground or of the rest.
    """
    ground, members = prepared.scene.triangle_surface < 0, np.arange(len(part))
    for kind in (ground, ~ground):
        some = part & kind if (part & kind).any() else part
        members[kind & ~part] = np.flatnonzero(some)[0]
    return members


@pytest.mark.slow
@pytest.mark.parametrize("buildings, ground", [(["a", "t"], True), (["b", "c"], False)])
def test_light_is_that_of_the_same_patches_in_arrays_of_all(city, buildings, ground):
    """To the rounding of sums in float32. What others cover is known as well."""
    scene, prepared, suns = city
    part, counted = choose_part(scene, prepared, buildings, ground)
    members = meet(prepared, part)
    # Others are black, and so are the patches that are met for them.
    albedo = np.where(
        part & ~np.isin(np.arange(len(part)), members[~part]),
        prepared.patches.albedo,
        np.float32(0),
    )
    prepared = replace(prepared, patches=replace(prepared.patches, albedo=albedo))
    few = keep_patches(scene, prepared, members)
    assert len(few.prepared.patches) == part.sum() + BACKS < len(part)
    found, own = traced(few, suns, part), counted[few.surfaces]
    whole = PartOfCity(scene, prepared, np.arange(len(part)), np.arange(len(scene.surfaces)))
    expected = traced(whole, suns, part)
    assert (
        expected.covered_share[scene.surfaces.surface_id.index("c_south")]
        == pytest.approx(0.5, abs=0.05)
        or ground
    )
    assert counted.sum() > 3 and expected.direct_reflected[counted].max() > 0.01
    for name in (
        "covered_share",
        "sky_view_factor",
        "far_ground_view_factor",
        "diffuse_relative",
        "visible_share",
    ):
        assert getattr(found, name)[own] == pytest.approx(
            getattr(expected, name)[counted], abs=1e-6
        ), name
    assert found.direct_reflected[own] == pytest.approx(
        expected.direct_reflected[counted], abs=1e-6
    )
    for name in ("diffuse_relative_standard_error", "direct_annual_standard_error"):
        assert getattr(found, name)[own] == pytest.approx(
            getattr(expected, name)[counted], rel=1e-4
        ), name
    for name, light in found.sources.items():
        assert light.relative[own] == pytest.approx(
            expected.sources[name].relative[counted], abs=1e-6
        )


def test_a_small_city_and_one_with_mirrors_stay_whole(city, tmp_path):
    scene, prepared, _ = city
    every = np.arange(len(prepared.patches))
    assert keep_patches(scene, prepared, every).prepared is prepared
    request = replace(REQUEST, materials={"glass": MaterialSpec(0.8, "mirror")})
    surfaces = replace(scene.surfaces, material=["glass"] * len(scene.surfaces))
    shiny = replace(scene, surfaces=surfaces)
    for effects in ({}, {"specular": False}):
        mirrors = prepare_scene(shiny, replace(request, effects=effects))
        assert keep_patches(shiny, mirrors, every // 2 * 2).prepared is mirrors
