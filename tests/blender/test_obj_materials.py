"""Materials of an OBJ file in Blender: they mean what Blender's own importer makes of them."""

import bpy
import pytest
from steps import run

from citypv.core.patches.materials import MaterialSpec, named_material
from citypv.core.read.read_city import read_city
from citypv.operators.city.read_materials import read_finish
from citypv.operators.result.keep_report import find_row
from citypv.operators.session import find_session

CUBE = "\n".join(f"v {x} {y} {z}" for z in (0, 5) for y in (0, 10) for x in (0, 10))
FACES = ["f 1 3 4 2", "f 1 2 6 5", "f 2 4 8 6", "f 4 3 7 8", "f 3 1 5 7", "f 5 6 8 7"]
NAMES = ["Ziegel rot", "White_Paint", "Bild", "bare"]
MTL = """newmtl Ziegel rot
Kd 0.5 0.2 0.1
newmtl White_Paint
Kd 0.1 0.1 0.1
newmtl Bild
Kd 0.8 0.8 0.8
map_Kd bild.png
"""


@pytest.fixture
def obj_file(tmp_path):
    """A box of which four faces have a material."""
    lines = ["mtllib city.mtl", CUBE, *FACES[:2]]
    for name, face in zip(NAMES, FACES[2:], strict=True):
        lines += [f"usemtl {name}", face]
    (tmp_path / "city.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "city.mtl").write_text(MTL)
    return tmp_path / "city.obj"


def test_names_and_colours_mean_what_they_mean_to_blender(addon, obj_file):
    """Blender takes the diffuse colour for the base colour of a shader, as it stands, as linear light."""
    colours = read_city(obj_file).colours
    bpy.ops.wm.obj_import(filepath=str(obj_file))
    ours = {name: named_material(name, colours[name]) for name in NAMES[:2]}
    assert ours == {name: read_finish(bpy.data.materials[name]) for name in NAMES[:2]}
    assert ours["Ziegel rot"] == MaterialSpec(0.2566)


def test_they_count_when_asked_for_and_those_of_blender_before(addon, obj_file):
    addon.city_path, addon.own_place, addon.latitude, addon.longitude = str(obj_file), True, 50, 10
    city = run("import_city", "classify", "trace", typical_days=1, samples=16, albedo_source="materials")
    rows = {row.split("|")[0]: row.split("|")[1:] for row in city["citypv_albedos"]}
    expected = {"one value": ["0.250", "4"], "Ziegel rot": ["0.257", "1"], "White_Paint": ["0.700", "1"]}
    assert rows == expected | {"ground": ["0.250", ""]}
    assert city["citypv_unread"] == "Materials without a known albedo: Bild, bare"
    assert find_row(city, "material/Bild")["count"] == "1"
    material = bpy.data.materials.new("bare")
    material.citypv_material = "slate"
    run("trace")
    assert "bare|0.100|1" in list(city["citypv_albedos"])
    transfer = find_session(city).transfer
    assert sorted(transfer.material) == ["", "", "", "White_Paint", "Ziegel rot", "bare"]
