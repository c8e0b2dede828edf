"""Materials that a city from a file gets in Blender, and those of the generated ground."""

import bpy
import numpy as np
import pytest
from steps import refuse, run, session_here
from test_materials import build_material
from test_obj_materials import MTL, write_cube

from citypv.core.patches.materials import MaterialSpec
from citypv.core.read.read_city import read_city
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.read_materials import read_finish
from citypv.operators.city.session import Session, find_city
from citypv.operators.run.summarise import summarise_albedo
from citypv.operators.show.keep_report import find_row


def give(item, material, chosen):
    """Assign a material to faces, as in edit mode."""
    item.data.materials.append(material)
    slots = np.empty(len(item.data.polygons), dtype=np.int32)
    item.data.polygons.foreach_get("material_index", slots)
    slots[chosen] = len(item.data.materials) - 1
    item.data.polygons.foreach_set("material_index", slots)


def materials_of(session):
    surfaces = session.scene.surfaces
    return dict(zip(surfaces.surface_id, surfaces.material, strict=True))


@pytest.mark.slow
def test_a_city_from_a_file_gets_materials_before_and_after_it_is_classified(addon, city_file):
    city = run(
        "import_city",
        albedo_source="materials",
        albedo=0.2,
        city_path=str(city_file),
        days=1,
        samples=16,
    )
    names = np.array(Session.of(city).city.surface_id)[read_face_attribute(city.data, "surface")]
    city.data.materials.append(None)
    give(city, build_material("Slate"), np.char.find(names, "roof") >= 0)
    city = run("classify", split=True, grid_size=4.0)
    session = Session.of(city)
    given = materials_of(session)
    assert {name for name, material in given.items() if material} == {
        name for name in given if "roof" in name
    }
    assert any("#" in name for name in given)
    # The colours of the kinds stand on the faces now; one cell of a wall is painted over them.
    cell = list(given).index("house0_south#1")
    give(
        city,
        build_material("lime", (0.7, 0.7, 0.7)),
        read_face_attribute(city.data, "surface") == cell,
    )
    run("trace")
    assert materials_of(session) == given | {"house0_south#1": "lime"}
    rows = {row.split("|")[0]: row.split("|")[1:] for row in city["citypv_albedos"]}
    count = sum("roof" in name for name in given)
    assert rows["Slate"] == ["0.100", str(count)]
    assert rows["lime"] == ["0.700", "1"]
    assert rows["one value"] == ["0.200", str(len(given) - count - 1)]
    assert rows["ground"] == ["0.250", ""]
    # What was given is remembered, with the whole wall, when the city is classified anew.
    run("classify", split=False)
    session = session_here()
    assert materials_of(session)["house0_south"] == "lime"
    assert sorted(set(materials_of(session).values())) == ["", "Slate", "lime"]


@pytest.mark.slow
def test_the_generated_ground_has_one_material(addon, city_file):
    run("import_city", "classify", city_path=str(city_file), days=1, samples=64)
    city, ground = find_city(bpy.context.scene)
    addon.albedo_source = "materials"
    light = {}
    for name in ("black paint", "Snow"):
        faces = np.ones(len(ground.data.polygons), bool)
        give(ground, build_material(name), faces)
        run("trace")
        session = Session.of(city)
        light[name] = session.transfer.diffuse_relative[
            session.scene.surfaces.kind == "facade"
        ].mean()
    assert light["Snow"] > light["black paint"] + 0.05
    assert list(city["citypv_albedos"]) == ["one value|0.250|21", "Snow|0.675|"]
    # It is remembered when the city is classified and traced anew; two at once are refused.
    run("classify", "trace")
    city, ground = find_city(bpy.context.scene)
    assert list(city["citypv_albedos"])[-1] == "Snow|0.675|"
    faces[1:] = False
    give(ground, bpy.data.materials["Snow"], ~faces)
    give(ground, bpy.data.materials["black paint"], faces)
    refuse("trace", "Ground: it has 2 materials; assign one material to all of its faces")


# -- materials of an OBJ file in Blender: they mean what Blender's own importer makes of them --


@pytest.fixture
def obj_file(tmp_path):
    """A box of which four faces have a material."""
    return write_cube(
        tmp_path, [None, None, "Ziegel rot", "White_Paint.001", "Bild", "bare"], mtl=MTL
    )


def test_names_and_colours_mean_what_they_mean_to_blender(addon, obj_file):
    """Blender takes the diffuse colour for the base colour of a shader, as it stands, as linear
    light.
    """
    colours = read_city(obj_file).colours
    bpy.ops.wm.obj_import(filepath=str(obj_file))
    ours = {
        name: MaterialSpec.of_name(name, colours[name])
        for name in ("Ziegel rot", "White_Paint.001")
    }
    assert ours == {name: read_finish(bpy.data.materials[name]) for name in ours}
    assert ours["Ziegel rot"] == MaterialSpec(0.2566)


@pytest.mark.slow
def test_they_count_when_asked_for_and_those_of_blender_before(addon, obj_file):
    addon.city_path, addon.own_place, addon.latitude, addon.longitude = str(obj_file), True, 50, 10
    city = run(
        "import_city", "classify", "trace", typical_days=1, samples=16, albedo_source="materials"
    )
    rows = {row.split("|")[0]: row.split("|")[1:] for row in city["citypv_albedos"]}
    expected = {
        "one value": ["0.250", "4"],
        "Ziegel rot": ["0.257", "1"],
        "White_Paint.001": ["0.700", "1"],
    }
    assert rows == expected | {"ground": ["0.250", ""]}
    assert city["citypv_unread"] == "Materials without a known albedo: Bild, bare"
    assert find_row(city, "material/Bild")["count"] == "1"
    material = bpy.data.materials.new("bare")
    material.citypv_material = "slate"
    run("trace")
    assert "bare|0.100|1" in list(city["citypv_albedos"])
    transfer = Session.of(city).transfer
    assert sorted(transfer.material) == ["", "", "", "White_Paint.001", "Ziegel rot", "bare"]


def test_many_surfaces_are_counted_readably():
    item = {}
    summarise_albedo(
        item, [{"name": "brick", "albedo": 0.3, "law": "lambertian", "surfaces": 14840}], []
    )
    assert item["citypv_albedos"] == ["brick|0.300|14,840"]
