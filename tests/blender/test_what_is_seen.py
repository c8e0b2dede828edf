"""What is computed or written out is what is seen: of edited meshes, ground, objects, and buildings
of their own.
"""

import json

import bmesh
import bpy
import pytest
from steps import add_tower, assert_full_run, here, refuse, run, session_here

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.edit_marks import describe_edit
from citypv.operators.show.build_legend import note_of
from citypv.operators.show.show_building import read_best


@pytest.mark.slow
def test_what_a_deleted_part_of_the_mesh_yielded_is_told(traced):
    """Before the first edit the city had all its faces: a house deleted in edit mode is gone with
    its energy.
    """
    city = here()
    yielded = {name: float(mwh.replace(",", "")) for name, _, mwh in read_best(city)}
    number = list(city["citypv_buildings"]).index("house2")
    shape = bmesh.new()
    shape.from_mesh(city.data)
    own = read_face_attribute(city.data, "building") == number
    chosen = [face for face, chosen in zip(shape.faces, own, strict=True) if chosen]
    bmesh.ops.delete(shape, geom=chosen, context="FACES")
    shape.to_mesh(city.data)
    shape.free()
    city.data.update()
    bpy.context.view_layer.update()
    run("update")
    assert_full_run(session_here())
    rows = {row["name"]: row for row in json.loads(here()["citypv_compared"])["buildings"]}
    assert (rows["house2"]["state"], rows["house2"]["after"]) == ("gone", 0)
    assert rows["house2"]["before"] == pytest.approx(yielded["house2"], abs=0.06)


@pytest.mark.slow
def test_no_step_computes_on_another_ground_than_is_seen(traced):
    ground = here()["citypv_ground"]
    heights = [vertex.co.z for vertex in ground.data.vertices]
    ground.data.vertices[0].co.z += 5
    ground.data.update()
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "its ground was edited"
    assert note_of(here(), "full_load_hours").startswith("before the last edit")
    for step in ("trace", "energy", "timeline", "plan_effects", "predict", "probe", "export"):
        refuse(step, "its ground was edited; undo that, or classify again")
    for vertex, height in zip(ground.data.vertices, heights, strict=True):
        vertex.co.z = height
    ground.data.update()
    bpy.context.view_layer.update()
    assert describe_edit(here()) == ("", "")
    ground.location.z -= 1
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "its ground was edited"
    ground.location.z += 1
    here().location = (100, 20, 7)  # the ground moves with the city
    bpy.context.view_layer.update()
    assert describe_edit(here()) == ("", "")
    ground.data.vertices[0].co.z += 5
    ground.data.update()
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "its ground was edited" and not bpy.ops.citypv.update.poll()
    run("classify", "trace", "energy")
    assert describe_edit(here()) == ("", "") and tuple(
        here()["citypv_ground"].matrix_world.translation
    ) == (100, 20, 7)


@pytest.mark.slow
def test_no_step_computes_on_another_city_than_is_seen(traced, tmp_path):
    """Without Live a moved tower waits for Update, which every step asks for; so does a modifier of
    the mesh.
    """
    bpy.context.scene.citypv_seeing.live = False
    add_tower()
    run("add_to_city", "update")
    bpy.data.objects["tower"].location.x += 30
    bpy.context.view_layer.update()
    for step in ("trace", "energy", "timeline", "plan_effects", "predict", "probe", "export"):
        refuse(step, "objects of it were edited; press Update")
    run("update")
    assert bpy.ops.citypv.export(format="faces", filepath=str(tmp_path / "faces.csv")) == {
        "FINISHED"
    }
    here().modifiers.new("Weld", "DECIMATE").ratio = 0.5
    bpy.context.view_layer.update()
    refuse("energy", "its mesh was edited; press Update")
    refuse("update", "its mesh has modifiers")


@pytest.mark.slow
def test_a_building_of_its_own_stands_for_that_of_the_files_after_an_import(
    traced, city_file, tmp_path
):
    bpy.ops.citypv.edit_building(building="house1")
    bpy.context.object.location.x += 3
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    run("import_city", "classify", city_path=str(city_file))
    assert describe_edit(here()) == ("", "")
    assert session_here().scene.surfaces.building_id.count("house1") == 7
