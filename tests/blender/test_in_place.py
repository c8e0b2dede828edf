"""Objects that were taken show the results in place, keep their materials, and are as before
without colours.
"""

import bpy
import numpy as np
import pytest
from steps import add_box, colours_of, here, refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.build_meshes import read_vertices
from citypv.operators.city.edit_marks import describe_edit
from citypv.operators.city.read_settings import state_of_step
from citypv.operators.city.session import Session, list_cities
from citypv.operators.city.source_objects import is_seen, list_taken
from citypv.operators.run.watch_edits import follow_undo, remove_left_grounds
from citypv.operators.show.build_legend import note_of
from citypv.operators.show.probe_faces import hit_face


@pytest.fixture
def town(addon):
    """Five boxes: two alone, of which one moved and turned, two that share a mesh, one with a
    modifier.
    """
    brick, white = bpy.data.materials.new("Brick"), bpy.data.materials.new("White")
    house, turned, one = (
        add_box("House", (100, 0, 3)),
        add_box("Turned", (130, 10, 3)),
        add_box("One", (100, 40, 3)),
    )
    turned.rotation_euler[2] = 0.5
    two = one.copy()
    two.name, two.location.x = "Two", 140
    bpy.context.scene.collection.objects.link(two)
    row = add_box("Row", (100, 80, 3))
    for item, material in ((house, brick), (turned, white), (one, brick), (row, white)):
        item.data.materials.append(material)
    row.modifiers.new("Array", "ARRAY").count = 2
    bpy.ops.object.select_all(action="SELECT")
    addon.own_place, addon.latitude, addon.longitude = True, 48.0, 11.0
    addon.suns, addon.typical_days, addon.samples, addon.shadow_samples = "typical-days", 1, 16, 2
    return {item.name: item for item in (house, turned, one, two, row)}


def check_probe(city, session, town):
    """A ray finds the face of an object and of the city beside it; selected objects are probed
    together.
    """
    bpy.context.view_layer.update()
    for above, building in (
        ((100, 0, 50), "House"),
        ((140, 40, 50), "Two"),
        ((110, 80, 50), "Row"),
    ):
        face = hit_face(bpy.context, above, (0, 0, -1))
        row = read_face_attribute(city.data, "surface")[face]
        assert session.scene.surfaces.building_id[row] == building
        assert session.scene.surfaces.surface_tilt[row] == pytest.approx(0, abs=1e-3)
    assert hit_face(bpy.context, (300, 300, 50), (0, 0, -1)) == -1
    bpy.ops.citypv.probe(face=hit_face(bpy.context, (100, 0, 50), (0, 0, -1)), whole=True)
    told = dict(line.split("|") for line in city["citypv_probe"])
    assert (told["Building"], told["Surfaces"]) == ("House", "6")
    assert bpy.context.view_layer.objects.active == town["House"]
    bpy.ops.citypv.deselect()
    bpy.ops.object.select_all(action="DESELECT")
    town["Turned"].select_set(True)
    bpy.ops.citypv.probe()
    assert "Building|Turned" in list(city["citypv_probe"])


@pytest.mark.slow
def test_each_face_shows_the_result_of_its_surface(addon, town):
    city = run("take_meshes", "classify", "trace", "energy")
    session = Session.of(city)
    for name in ("House", "Turned"):
        mesh = town[name].data
        shown = read_face_attribute(mesh, "full_load_hours")
        rows = [session.scene.surfaces.surface_id.index(f"{name}/{face}") for face in range(6)]
        np.testing.assert_allclose(shown, session.energy.full_load_hours[rows], rtol=1e-6)
        # The direction of each face is the azimuth and tilt of the surface that it got its hours
        # from.
        normals = np.array(
            [town[name].matrix_world.to_3x3() @ face.normal for face in mesh.polygons]
        )
        tilt = np.degrees(np.arccos(np.clip(normals[:, 2], -1, 1)))
        np.testing.assert_allclose(session.transfer.surfaces.surface_tilt[rows], tilt, atol=1e-3)
        walls = abs(normals[:, 2]) < 0.1
        azimuth = np.degrees(np.arctan2(normals[:, 0], normals[:, 1])) % 360
        np.testing.assert_allclose(
            session.transfer.surfaces.surface_azimuth[rows][walls], azimuth[walls], atol=1e-3
        )
        assert mesh.color_attributes.active_color.name == "citypv_colour"
        assert len(np.unique(colours_of(mesh).round(3), axis=0)) > 2
    check_probe(city, session, town)


@pytest.mark.slow
def test_own_materials_stay_and_all_comes_back_without_colours(addon, town):
    town["House"].data.color_attributes.new("mine", "BYTE_COLOR", "CORNER")
    before = {name: [slot.material for slot in item.material_slots] for name, item in town.items()}
    city = run("take_meshes", "classify")
    for name, item in town.items():
        assert [slot.material for slot in item.material_slots] == before[name]
        assert list(item.data.materials) == before[name]
        assert item.visible_get() and (item.display_type == "WIRE") == (
            name not in ("House", "Turned")
        )
    assert not city.hide_render and is_seen(city)
    # Of the city itself two boxes of one mesh are seen, and the two of the array.
    bpy.context.view_layer.update()
    rest = city.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert city.visible_get() and len(np.unique(read_face_attribute(rest.data, "surface"))) == 24
    for item in (rest, town["Two"]):
        assert read_vertices(item)[:, 1].min() == pytest.approx(36, abs=1e-4)
    addon.show_colours = False
    assert all(item.display_type == "TEXTURED" for item in town.values())
    assert not city.visible_get()
    assert town["House"].data.color_attributes.active_color_name == "mine"
    assert "citypv_colour" not in town["House"].data.color_attributes
    assert town["Turned"].data.color_attributes.active_color_name == ""
    assert read_face_attribute(town["House"].data, "kind") is not None
    addon.show_colours = True
    assert "citypv_colour" in town["House"].data.color_attributes
    assert town["Row"].display_type == "WIRE"


def test_cells_are_shown_by_the_city_itself(addon, town):
    """A face of the user has one colour, so that faces split into cells are seen as the city has
    them.
    """
    city = run("take_meshes", "classify", split=True, grid_size=4.0)
    assert city.visible_get() and all(item.display_type == "WIRE" for item in town.values())
    run("classify", split=False)
    assert (
        town["House"].display_type == "TEXTURED"
        and "citypv_colour" in town["House"].data.color_attributes
    )


@pytest.mark.slow
def test_undo_takes_the_colours_off_again(addon, town):
    run("take_meshes")
    bpy.ops.ed.undo_push(message="taken")
    run("classify")
    bpy.ops.ed.undo_push(message="classified")
    assert "citypv_colour" in bpy.data.objects["House"].data.color_attributes
    assert bpy.ops.ed.undo() == {"FINISHED"}
    city = here()
    assert "citypv_colour" not in bpy.data.objects["House"].data.color_attributes
    assert bpy.data.objects["Row"].display_type == "TEXTURED" and not city.visible_get()
    assert Session.of(city).scene is None
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert "citypv_colour" in bpy.data.objects["House"].data.color_attributes
    assert bpy.data.objects["Row"].display_type == "WIRE"
    bpy.context.scene.citypv.show_colours = False
    assert bpy.data.objects["Row"].display_type == "TEXTURED"


@pytest.mark.slow
def test_a_scene_in_other_units_is_coloured_where_it_is(addon, town):
    bpy.context.scene.unit_settings.scale_length = 0.5
    city = run("take_meshes", "classify")
    points = np.concatenate(
        [read_vertices(town[name]) for name in ("House", "Turned", "One", "Two")]
    )
    np.testing.assert_allclose(read_vertices(city).min(axis=0), points.min(axis=0), atol=1e-3)


@pytest.mark.slow
def test_a_moved_vertex_or_object_marks_the_results_stale(addon, town):
    city = run("take_meshes", "classify")

    def states():
        bpy.context.view_layer.update()
        return [state_of_step(city, step, addon) for step in ("import", "classify")]

    assert states() == ["done"] * 2
    town["House"].data.vertices[0].co.x += 1
    town["House"].data.update()
    assert states() == ["stale"] * 2
    town["House"].data.vertices[0].co.x -= 1
    town["House"].data.update()
    assert states() == ["done"] * 2
    town["Turned"].location.x += 1
    assert states() == ["stale"] * 2
    town["Turned"].location.x -= 1
    assert states() == ["done"] * 2
    town["Row"].modifiers[0].count = 3
    assert states() == ["stale"] * 2


@pytest.mark.slow
def test_an_object_that_comes_or_goes_marks_the_results_stale(addon, town, city_file):
    """It is refused to compute on another geometry than what is seen; what was there before is left
    out knowingly.
    """
    town["Row"].select_set(False)
    city = run("take_meshes", "classify")

    def told():
        bpy.context.view_layer.update()
        edit, stale = describe_edit(city)[0], state_of_step(city, "classify", addon) == "stale"
        assert bool(edit) == stale == note_of(city, "kind").startswith("before the last edit")
        return edit

    assert told() == ""
    tower = add_box("Tower", (160, 0, 3))
    assert told() == "Tower is not part of the city"
    for step in ("classify", "trace"):
        refuse(step, r"Tower is not part of the city; .* hide it")
    tower.hide_set(True)
    assert told() == ""
    bpy.context.scene.collection.objects.unlink(town["House"])
    assert told() == "objects of it were edited"
    bpy.context.scene.collection.objects.link(town["House"])
    assert told() == ""
    city = run("import_city", "classify", city_path=str(city_file), own_place=False)
    assert told() == ""
    tower.hide_set(False)
    assert told() == "Tower is not part of the city"
    city = run("import_city", "classify")
    assert told() == ""
    city.data.vertices[0].co.z += 1
    city.data.update()
    assert told() == "its mesh was edited"
    refuse("trace", "its mesh was edited; classify and trace")


def test_a_city_of_a_file_may_be_moved_but_not_turned(addon, city_file):
    city = run("import_city", "classify", city_path=str(city_file))
    for place, turn, state in ((100.0, 0.0, "done"), (100.0, 0.5, "stale"), (0.0, 0.0, "done")):
        city.location.x, city.rotation_euler.z = place, turn
        bpy.context.view_layer.update()
        assert state_of_step(city, "classify", addon) == state


@pytest.mark.slow
def test_other_selected_objects_are_another_city_and_the_same_ones_replace_it(addon, town):
    """Each has its own colours on the objects that they share."""
    every = run("take_meshes", "classify")

    def take_alone(name):
        for item in town.values():
            item.select_set(item.name == name)
        return run("take_meshes", "classify")

    first, second = take_alone("House"), take_alone("Turned")
    assert set(list_cities(bpy.context.scene)) == {every, first, second}
    assert [item for _, item, _ in list_taken(first)] == [town["House"]]
    third = take_alone("Turned")
    assert set(list_cities(bpy.context.scene)) == {every, first, third}
    bpy.ops.citypv.switch_city(name=first.name)
    addon.attribute = "orientation"
    shown = {}
    for city in (first, every, first, every):
        assert bpy.ops.citypv.switch_city(name=city.name) == {"FINISHED"}
        colours = colours_of(town["House"].data)
        np.testing.assert_array_equal(colours, shown.setdefault(city.name, colours))
    assert not np.array_equal(shown[first.name], shown[every.name])


@pytest.mark.slow
def test_a_picture_shows_the_city_that_is_hidden_itself(addon, town):
    from citypv.operators.show.draw_results import stage_picture

    city = run("take_meshes", "classify")
    for _ in range(2):
        stage = stage_picture(bpy.context)
        meshes = [item for item in stage.objects if item.data == city.data]
        assert len(meshes) == 1 and not meshes[0].hide_render and not meshes[0].modifiers
    assert len(list_cities(bpy.context.scene)) == 1
    assert follow_undo in bpy.app.handlers.undo_post


def roof_in_picture(place, path):
    """Colour in a picture by Cycles of what is seen straight below a place: (3,)."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (*place, 30)
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine, scene.cycles.samples = camera, "CYCLES", 2
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    bpy.data.objects.remove(camera)
    picture = bpy.data.images.load(scene.render.filepath)
    return np.array(picture.pixels[:]).reshape(16, 16, 4)[8, 8, :3]


@pytest.mark.slow
def test_pictures_show_the_colours_on_the_users_objects(addon, town, tmp_path):
    """Roofs have the colour in a picture by Cycles that the view shows: of a box alone, of one that
    shares its mesh, and of the second of a row by a modifier, of an instance. The materials of the
    user stay their own.
    """
    yard = bpy.data.collections.new("Yard")
    yard.objects.link(bpy.data.objects.new("Shed", town["House"].data.copy()))
    group = bpy.data.objects.new("Group", None)
    group.instance_type, group.instance_collection = "COLLECTION", yard
    group.location = (150, 80, 0)
    bpy.context.scene.collection.objects.link(group)
    group.select_set(True)
    city = run("take_meshes", "classify", "trace", "energy")
    places = {"House": (100, 0), "Two": (140, 40), "Row": (110, 80), "Group/Shed": (150, 80)}
    shown = {}
    for number, (name, place) in enumerate(places.items()):
        face = hit_face(bpy.context, (*place, 50), (0, 0, -1))
        surface = read_face_attribute(city.data, "surface")[face]
        building = Session.of(city).scene.surfaces.building_id[surface]
        assert building == name
        shown[name] = roof_in_picture(place, tmp_path / f"{number}.png")
        np.testing.assert_allclose(shown[name], colours_of(city.data)[3 * face], atol=0.02)
    house = town["House"]
    assert [slot.material.name for slot in house.material_slots] == ["Brick"]
    town["Two"].location.x = 170  # results stay where they were computed, as in the view
    moved = roof_in_picture(places["Two"], tmp_path / "moved.png")
    np.testing.assert_allclose(moved, shown["Two"], atol=0.02)
    addon.show_colours = False
    assert not house.modifiers and city.hide_render
    assert not any(item.hide_render for item in (*town.values(), group))


def test_objects_are_drawn_as_before_when_their_city_is_deleted(addon, town):
    city = run("take_meshes", "classify")
    remove_left_grounds()
    assert town["Row"].hide_render and town["Row"].display_type == "WIRE"
    bpy.data.objects.remove(city)
    remove_left_grounds()
    assert not town["Row"].hide_render and town["Row"].display_type == "TEXTURED"
