"""Materials of OBJ files: names of faces, colours of the library beside the file, and what both do
to the albedo.
"""

import gzip
import json
from pathlib import Path

import pytest

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.commands.command_line import main
from citypv.core.patches.materials import MaterialSpec
from citypv.core.patches.read_albedo import albedo_of_triangles, describe_albedo
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

TOWER = Path(__file__).parents[1] / "data/obj/nyc_tower_yup.obj.gz"
CUBE = "\n".join(f"v {x} {y} {z}" for z in (0, 5) for y in (0, 10) for x in (0, 10)) + "\n"
FACES = ["f 1 3 4 2", "f 1 2 6 5", "f 2 4 8 6", "f 4 3 7 8", "f 3 1 5 7", "f 5 6 8 7"]
MTL = """# a comment
Kd 1 1 1
newmtl Ziegel rot
Ns 10
  Kd 0.5 0.2 0.1
newmtl White_Paint.001
Kd 0.1 0.1 0.1
newmtl grey
Kd 0.4
newmtl Bild
Kd 0.8 0.8 0.8
map_Kd bild.png
newmtl bare
newmtl xyz
Kd xyz 0.1 0.2 0.3
"""
ZIEGEL = 0.2126 * 0.5 + 0.7152 * 0.2 + 0.0722 * 0.1  # luminance, ITU-R BT.709-6


def write_cube(folder, materials=(), head="mtllib city.mtl\n", mtl=None, name="city.obj"):
    """A box; the materials are those of its faces in their order, None for a face without a
    statement.
    """
    lines = [head + CUBE]
    for number, face in enumerate(FACES):
        material = materials[number] if number < len(materials) else None
        lines += [face] if material is None else [f"usemtl {material}", face]
    (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    if mtl is not None:
        (folder / "city.mtl").write_text(mtl, encoding="utf-8")
    return folder / name


def scene_of(path):
    return build_scene(read_city(path), 50, 10, ground="none", patch_size=None)


def notes_of(path, word="mtl"):
    return [note for note in read_city(path).report.notes if word in note]


def test_a_real_file_with_materials_and_no_library():
    city = read_city(TOWER, up="y")
    with gzip.open(TOWER, "rt") as file:
        names = {line.split(maxsplit=1)[1].strip() for line in file if line.startswith("usemtl")}
    assert names == {"DefaultMaterial"} == set(city.material)
    assert city.colours == {"DefaultMaterial": None}
    assert len(city.material) == len(city)
    (note,) = [note for note in city.report.notes if "materials" in note]
    assert f"1 materials on {len(city)} of {len(city)} polygons: DefaultMaterial. 0 have" in note


def test_names_and_colours_reach_city_and_scene(tmp_path):
    path = write_cube(
        tmp_path, ["Ziegel rot", "White_Paint.001", "grey", None, "Bild", "xyz"], mtl=MTL
    )
    city = read_city(path)
    assert city.material == ["Ziegel rot", "White_Paint.001", "grey", "grey", "Bild", "xyz"]
    expected = {"Ziegel rot": (0.5, 0.2, 0.1), "White_Paint.001": (0.1,) * 3, "grey": (0.4,) * 3}
    assert city.colours == expected | {"Bild": None, "xyz": None}
    scene = build_scene(city, 50, 10, options=SceneOptions(grid_size=5))
    assert scene.colours == city.colours
    assert scene.surfaces.material.count("Ziegel rot") == 4  # cells


def test_what_they_do_to_the_albedo(tmp_path):
    """Nothing unless asked for; then a name of the tables before a colour, and a line of the file
    before both.
    """
    path = write_cube(
        tmp_path, ["Ziegel rot", "White_Paint.001", "grey", "Bild", "bare", ""], mtl=MTL
    )
    scene = scene_of(path)
    of_surface = dict(
        zip(scene.triangle_surface.tolist(), range(len(scene.triangles)), strict=True)
    )
    rows = [of_surface[k] for k in range(6)]
    assert albedo_of_triangles(scene, Request(albedo=0.3))[rows] == pytest.approx([0.3] * 6)
    asked = Request(albedo=0.3, file_materials=True)
    expected = [ZIEGEL, 0.7, 0.4, 0.3, 0.3, 0.3]
    assert albedo_of_triangles(scene, asked)[rows] == pytest.approx(expected, abs=1e-4)
    table = tmp_path / "albedo.csv"
    own = scene.surfaces.surface_id[2]
    table.write_text(
        f"surface,albedo,material\nZiegel rot,0.6,\nBild,,tile\nfacade,0.11,\n{own},0.9,\n"
    )
    asked.albedo_file = str(table)
    # Its own line, its material's line, its material, its kind's line, the rest.
    assert albedo_of_triangles(scene, asked)[rows] == pytest.approx(
        [0.6, 0.7, 0.9, 0.225, 0.11, 0.3]
    )
    told = {(row["from"], row["name"], row["material"]) for row in describe_albedo(scene, asked)}
    assert ("--albedo-file", "Bild", "Bild") in told
    assert ("materials", "White_Paint.001", "White_Paint.001") in told
    # A file tells of materials without being asked for those of the city.
    assert albedo_of_triangles(scene, Request(albedo_file=str(table)))[rows[:2]] == pytest.approx(
        [0.6, 0.11]
    )
    # From Python a material may be told otherwise.
    asked = Request(file_materials=True, materials={"Bild": MaterialSpec(0.5)})
    assert albedo_of_triangles(scene, asked)[rows[3]] == pytest.approx(0.5)
    with pytest.raises(InputError, match="--materials: the files of this city have no materials"):
        albedo_of_triangles(scene_of(write_cube(tmp_path, name="plain.obj")), asked)


def test_names_and_colours_mean_what_they_mean_in_blender():
    assert MaterialSpec.of_name("Brick", (0.9, 0.9, 0.9)) == MaterialSpec(material="brick")
    assert MaterialSpec.of_name("Glass") == MaterialSpec(material="glass")
    assert MaterialSpec.of_name("Mirror.001", (0.5, 0.5, 0.5)) == MaterialSpec(0.5, "mirror")
    assert MaterialSpec.of_name("wall", (0.5, 0.2, 0.1)) == MaterialSpec(
        pytest.approx(ZIEGEL, abs=1e-4)
    )
    assert MaterialSpec.of_name("mirror") is MaterialSpec.of_name("wall") is None


def test_usemtl_without_a_name(tmp_path):
    path = write_cube(tmp_path, ["grey", "", "grey"], mtl=MTL)
    city = read_city(path)
    assert city.material == ["grey", "", "grey", "grey", "grey", "grey"]
    assert any(
        "1 usemtl lines" in note and "name no material" in note for note in city.report.notes
    )
    nothing = read_city(write_cube(tmp_path, [""]))
    assert (set(nothing.material), nothing.colours) == ({""}, {})


REFUSED = {
    "missing.mtl": "no such file in the folder of the OBJ file",
    "../city.mtl": "only files in the folder of the OBJ file",
    "..": "only files in the folder of the OBJ file",
    "sub/city.mtl": "only files in the folder of the OBJ file",
    "sub\\city.mtl": "only files in the folder of the OBJ file",
    "C:city.mtl": "only files in the folder of the OBJ file",
    "": "no file name given",
    "./": "no file name given",
    "folder": "no such file in the folder of the OBJ file",
    "n" * 5000: "no such file in the folder of the OBJ file",
    "empty.mtl": "the file is empty",
    "packed.mtl": "decompression fails",
}


@pytest.mark.parametrize(
    "name", [*REFUSED, "/absolute/city.mtl"], ids=lambda name: name[:12] or "none"
)
def test_libraries_that_are_not_read(tmp_path, name):
    """A note and no colours, never a failure; what lies elsewhere is not even looked at."""
    inner = tmp_path / "inner"
    for folder in (inner, inner / "sub", inner / "folder"):
        folder.mkdir()
    for folder in (tmp_path, inner / "sub"):
        (folder / "city.mtl").write_text(MTL)
    (inner / "empty.mtl").write_bytes(b"")
    (inner / "packed.mtl").write_bytes(gzip.compress(MTL.encode())[:40])
    reason = REFUSED.get(name, "only files in the folder of the OBJ file")
    if name.startswith("/"):
        name = str(tmp_path / "city.mtl")
    path = write_cube(inner, ["grey"], head=f"mtllib {name}\n")
    city = read_city(path)
    assert city.colours == {"grey": None}
    (note,) = [note for note in city.report.notes if "mtllib" in note]
    assert f"{path}, line 1: mtllib" in note
    assert reason in note
    assert len(note) < 500


@pytest.mark.parametrize(
    "text", ["nan 0.1 0.1", "0.1 inf 0.1", "-0.1 0 0", "1.5 0 0", "0.1 0.1", "red", ""]
)
def test_colours_that_are_none(tmp_path, text):
    mtl = f"newmtl grey\nKd 0.5 0.5 0.5\nKd {text}\nnewmtl good\nKd 0.2 0.2 0.2\n"
    path = write_cube(tmp_path, ["grey", "good"], mtl=mtl)
    assert read_city(path).colours == {"grey": None, "good": (0.2,) * 3}
    (note,) = notes_of(path, "not a colour from 0 to 1")
    assert "1 materials" in note and "'grey', line 3" in note


def test_one_name_with_two_colours(tmp_path):
    """Two files call different colours alike: neither counts."""
    one, other = tmp_path / "one", tmp_path / "other"
    one.mkdir()
    other.mkdir()
    first = write_cube(
        one, ["grey", "red"], mtl="newmtl grey\nKd 0.1 0.1 0.1\nnewmtl red\nKd 0.3 0 0\n"
    )
    second = write_cube(
        other, ["grey", "red"], mtl="newmtl grey\nKd 0.2 0.2 0.2\nnewmtl red\nKd 0.3 0 0\n"
    )
    second.write_text(second.read_text().replace("v 0", "v 30").replace("v 10", "v 40"))
    city = read_city([first, second])
    assert city.colours == {"grey": None, "red": (0.3, 0, 0)}
    assert any(
        "1 materials have different colours in different files" in note
        for note in city.report.notes
    )


@pytest.mark.slow
def test_command_line(tmp_path, capsys):
    """Inspect lists the materials; simulate tells which were met, for how many surfaces and which
    area.
    """
    place = ["--latitude", "50", "--longitude", "10"]
    path = write_cube(tmp_path, ["Ziegel rot", "White_Paint.001", "Bild", "Glass"], mtl=MTL)
    assert main(["inspect", str(path), "--json", *place]) == 0
    materials = json.loads(capsys.readouterr().out)["materials"]
    paint = {"count": 1, "area": 50.0, "taken_as": "white paint: reflects evenly, albedo 0.700"}
    assert materials["White_Paint.001"] == paint
    assert materials["Bild"]["taken_as"] == ""
    assert materials["Glass"]["taken_as"] == "glass: reflects as glass or water"
    assert main(["inspect", str(path), *place]) == 0
    assert (
        "Bild                          1            50.0 m²  unknown: --albedo is used"
        in capsys.readouterr().out
    )
    table, out = tmp_path / "albedo.csv", tmp_path / "out"
    table.write_text("surface,albedo\nGlass,0.1\n")
    run = [
        "simulate",
        str(path),
        "--materials",
        *place,
        "--out",
        str(out),
        "--samples",
        "16",
        "--suns",
    ]
    assert main([*run, "typical-days:1", "--quiet", "--albedo-file", str(table)]) == 0
    effects = json.loads((out / "summary.json").read_text("utf-8"))["traced"]["effects"]
    assert not {effect["key"]: effect["on"] for effect in effects}["specular"]
    albedo = json.loads((out / "summary.json").read_text("utf-8"))["albedo"]
    found = {
        row["material"]: (row["albedo"], row["surfaces"], row["area"])
        for row in albedo
        if "area" in row
    }
    # The last statement counts for the two faces that follow it.
    assert found == {
        "Ziegel rot": (pytest.approx(ZIEGEL, abs=1e-4), 1, pytest.approx(100)),
        "White_Paint.001": (pytest.approx(0.7), 1, pytest.approx(50)),
        "": (0.25, 1, pytest.approx(50)),
        "Glass": (0.1, 3, pytest.approx(200)),
    }


@pytest.mark.parametrize(
    ("names", "materials", "said"),
    [
        (("b1", "g1"), ("BuildingWall", "TerrainWall"), "1 of 2 objects"),  # as 3dfier writes them
        (
            ("b1", "terrain01"),
            ("Building", "Terrain"),
            "(Terrain)",
        ),  # as a script for OpenStreetMap does
        (("b1", "Terrain.001"), (None, None), "(Terrain.001)"),
        (("b1", "Roadhouse"), (None, None), None),
        (("b1", "Waterloo Tower"), (None, "Roadstone"), None),
        (("b1", "road"), ("Building", "Brick"), None),  # materials are more certain than names
        (("water", "road"), (None, None), None),  # nothing else to compare with
    ],
)
def test_objects_that_are_called_terrain_or_roads_are_noted(tmp_path, names, materials, said):
    lines = [CUBE.strip()]
    for name, material in zip(names, materials, strict=True):
        lines += [f"o {name}", *([f"usemtl {material}"] if material else []), *FACES]
    (tmp_path / "city.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    notes = notes_of(tmp_path / "city.obj", "no buildings by their names")
    assert len(notes) == (said is not None) and all(said in note for note in notes)
