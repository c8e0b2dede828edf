"""The report in Blender: what it says, and that each of its groups selects exactly its faces."""

import re

import bpy
import numpy as np
import pytest
from steps import refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.session import Session, find_city
from citypv.operators.show.keep_report import read_rows
from citypv.operators.show.select_faces import read_selection

TURNED = "repaired/flipped: faced inwards in a watertight shell"


@pytest.fixture
def city(addon, row_file):
    """The row of houses, imported and classified."""
    return run("import_city", "classify", city_path=str(row_file))


def selected_surfaces(city):
    """Ids of the surfaces whose faces are selected; all faces of a surface are, or none."""
    assert city.mode == "OBJECT"
    assert city["citypv_highlight"]
    chosen, surface = read_selection(city.data), read_face_attribute(city.data, "surface")
    ids = Session.of(city).scene.surfaces.surface_id
    assert not set(surface[chosen]) & set(surface[~chosen])
    return {ids[k] for k in set(surface[chosen].tolist())}


def test_import_says_what_was_read(addon, row_file):
    run("import_city", city_path=str(row_file))
    city, ground = find_city(bpy.context.scene)
    assert ground is None
    lines = list(city["citypv_report"])
    assert lines[:3] == ["row.gml", "2 buildings, 0 parts, 14 surfaces", "Detail met: LoD 2: 15"]
    assert lines[3].startswith("Detail taken: LoD 2: 1")
    assert lines[4] == "Reference system: EPSG:25833"
    # From pyproj's own grid of Berlin: 52.5010° N, 13.3796° E; the convergence there is -1.286°.
    assert re.fullmatch(r"52\.501\d\d° N, 13\.379\d\d° E, altitude 30\.0\xa0m", lines[5])
    assert re.fullmatch(r"Grid north: −1\.2[89]\d\d° from true north", lines[6])
    counts = {row["name"]: (row["count"], row["area"]) for row in read_rows(city, "kind")}
    # Walls 10 × 6 and 8 × 6 with a gable of 8 × 3 / 2, twice each; roofs 10 × 5, twice.
    assert counts == {
        "facade": ("8", "480 m²"),
        "roof": ("4", "200 m²"),
        "downward": ("2", "160 m²"),
    }


@pytest.mark.slow
def test_the_report_follows_the_steps(addon, city):
    inside = {row["name"]: row for row in read_rows(city, "inside")}
    name = next(name for name in inside if name.startswith("more than half covered"))
    covered = inside[name]["ids"].split()
    assert sorted(covered) == ["a_east", "b_west"]
    assert inside[name]["area"] == "120 m²"
    run("trace", days=2, samples=64, shadow_samples=4)
    traced = {row["name"]: row for row in read_rows(city, "inside")}
    assert traced[name]["ids"].split() == covered
    assert read_rows(city, "repaired")


@pytest.mark.parametrize(
    ("group", "expected"),
    [
        (TURNED, {"b_roof_south"}),
        ("kind/roof", {"a_roof_north", "a_roof_south", "b_roof_north", "b_roof_south"}),
        ("orientation/east", {"a_east", "b_east"}),
        ("inside/ground, or under its building", {"a_ground", "b_ground"}),
    ],
)
def test_a_group_selects_its_faces(city, group, expected):
    assert bpy.ops.citypv.select_group(group=group) == {"FINISHED"}
    assert bpy.context.tool_settings.mesh_select_mode[:] == (False, False, True)
    assert bpy.context.view_layer.objects.active == city
    assert selected_surfaces(city) == expected


@pytest.mark.slow
def test_every_group_with_faces_selects_as_many_surfaces_as_it_says(city):
    """From edit mode as well as from object mode, and whatever was selected or hidden before."""
    session = Session.of(city)
    for row in read_rows(city):
        if not len(row["surfaces"]):
            continue
        bpy.ops.citypv.select_group(group="kind/facade")
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.hide(unselected=False)
        assert bpy.ops.citypv.select_group(group=row["key"]) == {"FINISHED"}
        names = selected_surfaces(city)
        assert len(names) == int(row["count"]), row["key"]
        surfaces = session.scene.surfaces
        area = surfaces.area[np.isin(surfaces.surface_id, list(names))].sum()
        assert row["area"].startswith(f"{area:.0f}" if area >= 100 else f"{area:.1f}"), row["key"]


def test_a_building_and_what_belongs_to_a_face(city):
    assert bpy.ops.citypv.select_group(group="building/b") == {"FINISHED"}
    whole = selected_surfaces(city)
    assert len(whole) == 7
    assert all(name.startswith("b_") for name in whole)
    bpy.ops.citypv.select_group(group=TURNED)
    run("select_buildings")
    assert selected_surfaces(city) == whole


@pytest.mark.parametrize("operator", ["select_group", "copy_group"])
def test_a_group_that_is_not_there_is_an_error_in_one_line(city, operator):
    refuse(
        operator,
        "City: its report has no group 'kind/tower'; give for example kind/",
        group="kind/tower",
    )
    refuse("select_group", "City: it has no building 'c'", group="building/c")


def test_nothing_selected_or_hidden_is_told(city):
    bpy.ops.citypv.select_group(group="kind/roof")
    run("deselect")
    assert "citypv_highlight" not in city
    refuse("select_buildings", "City: no faces are selected")
    city.hide_set(True)
    refuse("select_group", "City: it is hidden; unhide it", group="kind/roof")


@pytest.mark.slow
def test_the_steps_go_on_from_edit_mode(addon, city):
    bpy.ops.citypv.select_group(group="kind/roof")
    addon.days, addon.samples, addon.shadow_samples = 2, 64, 4
    assert bpy.ops.citypv.colour.poll()
    for step in ("trace", "energy", "colour", "classify", "import_city"):
        bpy.ops.citypv.select_group(group="kind/roof")
        bpy.ops.object.mode_set(mode="EDIT")
        assert getattr(bpy.ops.citypv, step)() == {"FINISHED"}
    assert bpy.context.mode == "OBJECT"


def test_the_report_as_text_is_complete(city, row_file):
    run("show_report", "show_report")
    assert [text.name for text in bpy.data.texts] == ["CityPV report"]
    lines = bpy.data.texts["CityPV report"].as_string().splitlines()
    assert lines[0] == str(row_file)
    assert not any(line.startswith(("Weather", "Full load hours", "Albedo")) for line in lines)
    for row in read_rows(city):
        assert f"{row['heading']}: {row['name']}" in lines
        assert all(f"    {name}" in lines for name in row["ids"].split())
