"""Cities of the user's own objects: letters are none, large ones are cheap to edit, a deleted one
leaves nothing.
"""

import bpy
import pytest
from steps import add_box, here, run

from citypv.citypv_addon import CLASSES
from citypv.operators.city.edit_marks import describe_edit
from citypv.operators.run import shapes
from citypv.operators.run.city_design import describe_edited, forget_edited, note_edits
from citypv.operators.run.take_meshes import read_meshes
from citypv.operators.run.watch_edits import remove_left_grounds


def test_letters_and_curves_are_no_buildings():
    """Blender makes meshes of them; a curve along which geometry nodes set houses is another
    matter.
    """
    box = add_box("House", (0, 0, 3))
    bpy.ops.object.text_add()
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.dimensions, bpy.context.object.data.fill_mode = "2D", "BOTH"
    bpy.context.view_layer.update()
    content, taken = read_meshes("Objects", [box, *bpy.data.objects], bpy.context)
    assert len(content.polygons) == 6 and content.buildings == ["House"]
    assert taken == [(box.session_uid, "House")]


@pytest.fixture
def town(addon):
    """Forty houses that are a city."""
    houses = [
        add_box(f"house{number}", (20.0 * (number % 8), 20.0 * (number // 8), 3))
        for number in range(40)
    ]
    bpy.ops.object.select_all(action="SELECT")
    addon.own_place, addon.latitude, addon.longitude = True, 48.0, 11.0
    run("take_meshes")
    bpy.context.view_layer.update()
    return houses


def test_of_a_city_only_the_object_that_was_moved_is_read_again(town, monkeypatch):
    """And what is told is the same as if all were: moved, moved back, hidden, its mesh edited,
    another one added.
    """
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.update()
    read, describe = [], shapes.describe_object

    def note(city, item):
        read.append(item.name)
        return describe(city, item)

    monkeypatch.setattr("citypv.operators.run.city_design.describe_object", note)
    for step, edited in ((5, True), (-5, False)):
        town[7].location.x += step
        bpy.context.view_layer.update()
        assert bool(describe_edit(here())[0]) == edited
    assert read == ["house7"] * 2
    town[3].hide_set(True)
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "objects of it were edited"
    for step in (5, -5):
        town[7].location.x += step
        bpy.context.view_layer.update()
        assert describe_edit(here())[0] == "objects of it were edited"
    town[3].hide_set(False)
    bpy.context.view_layer.update()
    assert describe_edit(here()) == ("", "")
    town[4].data.vertices[0].co.z += 1
    town[4].data.update()
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "objects of it were edited"
    town[4].data.vertices[0].co.z -= 1
    town[4].data.update()
    bpy.context.view_layer.update()
    assert describe_edit(here()) == ("", "")
    add_box("other", (0, -40, 3))
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "other is not part of the city"


CHANGES = {
    "move": lambda town: setattr(town[7].location, "x", town[7].location.x + 5),
    "select": lambda town: town[8].select_set(not town[8].select_get()),
    "hide": lambda town: town[3].hide_set(True),
    "show": lambda town: town[3].hide_set(False),
    "rename": lambda town: setattr(town[5], "name", "corner house"),
    "rename back": lambda town: setattr(town[5], "name", "house5"),
    "add": lambda town: add_box("other", (0, -40, 3)),
    "move what is beside": lambda town: setattr(bpy.data.objects["other"].location, "x", 9),
    "delete what is beside": lambda town: bpy.data.objects.remove(bpy.data.objects["other"]),
    "edit a mesh": lambda town: set_height(town[9], 7),
    "edit mode": lambda town: edit_vertex(town[9]),
    "move back": lambda town: setattr(town[7].location, "x", town[7].location.x - 5),
    "delete": lambda town: bpy.data.objects.remove(town.pop()),
}


def set_height(item, height):
    item.data.vertices[0].co.z = height
    item.data.update()


def edit_vertex(item):
    """Begin to edit a mesh, change it, and end."""
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.view_layer.update()
    bpy.ops.transform.translate(value=(1, 0, 0))
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="OBJECT")


def told_of(city):
    return describe_edit(city), describe_edited(city)


def test_a_change_looks_at_the_object_that_was_changed_only(town, monkeypatch):
    """Neither are all objects compared nor is what is known of them put together anew; and what is
    told is what a look at all of them tells.
    """
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.update()
    read, describe = [], shapes.describe_object

    def note(city, item):
        read.append(item.name)
        return describe(city, item)

    told = {}
    for name, change in CHANGES.items():
        with monkeypatch.context() as patch:
            for other in ("note_edits", "describe_design", "_digest_parts", "list_seen"):
                patch.setattr(f"citypv.operators.run.city_design.{other}", None)
            patch.setattr("citypv.operators.run.city_design.describe_object", note)
            read.clear()
            change(town)
            bpy.context.view_layer.update()
        assert len(set(read)) <= 1, (name, read)
        told[name] = told_of(here())
        forget_edited()
        note_edits(here())
        assert told_of(here()) == told[name], name
    assert told["add"][0][0] == "other is not part of the city"
    # What was undone is as before, each other change is another city.
    assert told["show"] == told["rename back"] == told["move"]
    assert told["delete what is beside"] == told["move"]
    assert len(set(told.values())) == 8


def test_an_object_marked_by_a_script_as_part_of_the_city_is_found(town):
    other = add_box("other", (0, -40, 3))
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "other is not part of the city"
    other["citypv_of"] = here()["citypv_id"]
    other.select_set(False)
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "objects of it were edited"


def test_a_deleted_city_takes_its_ground_along_but_no_other(addon, city_file, row_file):
    first = run("import_city", "classify", city_path=str(city_file))
    second = run("import_city", "classify", city_path=str(row_file))
    remove_left_grounds()
    grounds = first["citypv_ground"].name, second["citypv_ground"].name
    bpy.data.objects.remove(second)
    remove_left_grounds()
    assert grounds[0] in bpy.data.objects and grounds[1] not in bpy.data.objects


@pytest.mark.parametrize(
    ("suffix", "operator", "setting"),
    [
        (".xml", "solar_city", ""),
        (".gz", "solar_city", ""),
        (".tif", "drop_terrain", "terrain"),
        (".tif", "drop_horizon", "horizon"),
        (".csv", "drop_weather", "weather_file"),
        (".csv", "drop_horizon", "horizon"),
        (".csv", "drop_albedo", "albedo_file"),
    ],
)
def test_a_file_may_be_dropped_for_what_it_can_be(addon, suffix, operator, setting, tmp_path):
    handlers = [one for one in CLASSES if issubclass(one, bpy.types.FileHandler)]
    taking = {
        one.bl_import_operator for one in handlers if suffix in one.bl_file_extensions.split(";")
    }
    assert f"citypv.{operator}" in taking
    if setting:
        path = str(tmp_path / f"file{suffix}")
        assert getattr(bpy.ops.citypv, operator)(filepath=path) == {"FINISHED"}
        assert getattr(addon, setting) == path


@pytest.mark.slow
def test_an_edit_after_reopening_names_the_button_that_goes_on(traced, tmp_path):
    tower = add_box("tower", (5.0, -12.0, 20.0))
    bpy.context.view_layer.update()
    bpy.ops.object.select_all(action="DESELECT")
    tower.select_set(True)
    run("add_to_city")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.data.objects["tower"].location.x += 30
    bpy.context.view_layer.update()
    assert "Import and trace again" in describe_edit(here())[1] and bpy.ops.citypv.retrace.poll()
    run("retrace")
    bpy.context.view_layer.update()
    if describe_edit(here())[0]:
        run("update")
    assert describe_edit(here()) == ("", "")
    assert "tower" in here()["citypv_buildings"] and bpy.data.objects[
        "tower"
    ].location.x == pytest.approx(35)
