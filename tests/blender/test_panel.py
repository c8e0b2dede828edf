"""What a user of the panel presses, one thing at a time, and what must not change behind their
back.
"""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from steps import here, refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.read_settings import STEPS, state_of_step
from citypv.operators.city.session import close_sessions, list_cities
from citypv.operators.show.draw_results import copy_view, stage_picture


def run_steps(path, *steps):
    return run(
        *steps,
        city_path=str(path),
        samples=16,
        shadow_samples=2,
        suns="typical-days",
        typical_days=1,
    )


def test_a_saved_city_is_not_swapped_for_a_cube(addon, city_file, tmp_path):
    run_steps(city_file, "import_city", "classify")
    path = str(tmp_path / "city.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    close_sessions()  # as in another Blender
    for item in bpy.context.selected_objects:
        item.select_set(False)
    bpy.ops.mesh.primitive_cube_add(size=2)
    refuse("classify", "must be imported again")
    assert len(np.unique(read_face_attribute(here().data, "surface"))) == 21


@pytest.mark.slow
def test_show_acts_at_once_and_says_what_is_shown(addon, city_file, capfd):
    city = run_steps(city_file, "import_city", "classify")
    assert (addon.attribute, city["citypv_colour_attribute"]) == ("kind", "kind")
    addon.attribute = "orientation"
    assert city["citypv_colour_attribute"] == "orientation"
    addon.attribute = "full_load_hours"  # not computed yet: the view stays
    assert city["citypv_colour_attribute"] == "orientation"
    run("trace")
    assert (addon.attribute, city["citypv_colour_attribute"]) == (
        "diffuse_relative",
        "diffuse_relative",
    )
    assert "shown: diffuse irradiance per DHI" in capfd.readouterr().out
    run("energy")
    assert (addon.attribute, city["citypv_colour_attribute"]) == (
        "full_load_hours",
        "full_load_hours",
    )
    addon.colour_map = "cividis"
    assert city["citypv_colour_map"] == "cividis"
    addon.auto_range = False
    addon.low, addon.high = 100.0, 900.0
    assert (city["citypv_colour_low"], city["citypv_colour_high"]) == (100.0, 900.0)
    addon.high = 50.0  # an empty range changes nothing, and is refused by the button
    assert city["citypv_colour_high"] == 900.0
    refuse("colour", "Range: 100 to 50 is empty; give a Low below High")
    addon.attribute = "sky_view_factor"  # hours are no range for a share
    assert 0 <= addon.low < addon.high <= 1


def views_of(screen):
    return [area.spaces.active for area in screen.areas if area.type == "VIEW_3D"]


def test_other_workspaces_keep_their_shading(addon, city_file):
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    seen = {window.screen for window in bpy.context.window_manager.windows}
    others = [screen for screen in bpy.data.screens if screen not in seen and views_of(screen)]
    before = {
        screen.name: [(v.shading.type, v.shading.light) for v in views_of(screen)]
        for screen in others
    }
    assert before
    run_steps(city_file, "import_city", "classify")
    assert {
        s.name: [(v.shading.type, v.shading.light) for v in views_of(s)] for s in others
    } == before
    assert {v.shading.light for screen in seen for v in views_of(screen)} <= {"FLAT"}


def test_a_picture_leaves_the_users_scene_alone(addon, city_file):
    run_steps(city_file, "import_city", "classify")
    scene = bpy.context.scene
    bpy.ops.object.camera_add(location=(7, 8, 9))
    scene.camera, scene.world = bpy.context.object, bpy.data.worlds.new("mine")
    scene.render.resolution_x, scene.render.resolution_y, scene.render.engine = (
        640,
        360,
        "BLENDER_WORKBENCH",
    )
    before = (
        scene.camera,
        scene.world,
        640,
        360,
        "BLENDER_WORKBENCH",
        sorted(o.name for o in scene.objects),
    )
    for view in ("overview", "camera"):
        stage = stage_picture(bpy.context, view)
        assert stage != scene
        render = scene.render
        now = (scene.camera, scene.world, render.resolution_x, render.resolution_y, render.engine)
        assert (*now, sorted(o.name for o in scene.objects)) == before
    assert (stage.render.resolution_x, stage.render.resolution_y) == (640, 360)
    np.testing.assert_allclose(stage.camera.matrix_world.translation, (7, 8, 9))
    scene.camera = None
    refuse("render", "Camera: the scene has none", view="camera")


def test_a_picture_is_what_the_view_shows(addon, city_file):
    """A point at the edge of the view projects to the edge of the picture."""
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Matrix, Vector

    stage = bpy.context.scene
    place = Matrix.Translation((3, 4, 5)) @ Matrix.Rotation(1.1, 4, "X")
    # Half the angle has the tangent 0.4 across and 0.3 up, as in a region of 800 × 600 pixels.
    window = Matrix.Diagonal((1 / 0.4, 1 / 0.3, -1, 1))
    view = SimpleNamespace(window_matrix=window, view_matrix=place.inverted(), is_perspective=True)
    camera = copy_view(stage, view, 800, 600, 1000)
    bpy.context.view_layer.update()
    seen = world_to_camera_view(stage, camera, place @ Vector((0.4 * 20, 0.3 * 20, -20)))
    np.testing.assert_allclose(seen, (1, 1, 20), atol=1e-4)
    window = Matrix.Diagonal((1 / 40, 1 / 30, -1, 1))
    flat = SimpleNamespace(window_matrix=window, view_matrix=place.inverted(), is_perspective=False)
    camera = copy_view(stage, flat, 800, 600, 1000)
    bpy.context.view_layer.update()
    seen = world_to_camera_view(stage, camera, place @ Vector((40, -30, -20)))
    np.testing.assert_allclose(seen, (1, 0, 20), atol=1e-4)


@pytest.mark.slow
def test_a_second_city_is_kept_beside_the_first(addon, city_file, row_file):
    first = run_steps(city_file, "import_city", "classify", "trace", "energy")
    hours = read_face_attribute(first.data, "full_load_hours")
    second = run_steps(row_file, "import_city", "classify")
    assert list_cities(bpy.context.scene) == [first, second] or list_cities(bpy.context.scene) == [
        second,
        first,
    ]
    assert here() == second
    assert not first.visible_get()
    assert not first["citypv_ground"].visible_get()
    assert bpy.ops.citypv.switch_city(name=first.name) == {"FINISHED"}
    assert here() == first
    assert first.visible_get()
    assert not second.visible_get()
    assert addon.city_path == str(city_file)
    assert [state_of_step(first, step, addon) for step in STEPS] == ["done"] * 4
    np.testing.assert_array_equal(read_face_attribute(first.data, "full_load_hours"), hours)
    run("energy", weather="clear-sky")
    assert np.nanmean(read_face_attribute(first.data, "full_load_hours")) > np.nanmean(hours)
    assert "citypv_full_load_hours" not in second.data.attributes
    refuse("switch_city", "Metropolis: there is no such city", name="Metropolis")
