"""Set up a Blender scene of its own for a picture: the user's camera, world and resolution stay as they are."""

import bpy
import numpy as np
from mathutils import Matrix

from ...core.settings.errors import InputError
from ..attributes import PREFIX
from ..city.build_meshes import read_vertices
from ..in_place import is_in_place
from ..run_step import Action, OfCity, leave_edit_mode, list_views
from ..session import find_city
from .build_legend import build_legend, note_of
from .colour_faces import read_scale, show_exact_colours
from .draw_results import prepare_render
from .show_city import SENSOR_WIDTH, find_camera, place_camera, set_background

SCENE = "CityPV picture"
VIEWS = [
    ("overview", "Whole city", "From above the south-east, with everything in the frame"),
    ("viewport", "3D view", "As the 3D view shows it"),
    ("camera", "Camera", "Through the scene's own camera, in its resolution"),
]
WIDTH = 1600  # [pixels] of pictures as the 3D view shows them


def stage_picture(context, view="overview"):
    """Build the scene "CityPV picture" with the coloured city, its ground, a camera and the legend.

    Parameters
    ----------
    context : bpy.types.Context
    view : {'overview', 'viewport', 'camera'}

    Returns
    -------
    bpy.types.Scene

    Raises
    ------
    InputError
        There is no 3D view or no camera to take the picture from.
    """
    city, ground = find_city(context.scene)
    stage = bpy.data.scenes.get(SCENE) or bpy.data.scenes.new(SCENE)
    for item in list(stage.collection.objects):
        stage.collection.objects.unlink(item)
        if item.get(PREFIX + "part") == "picture":
            bpy.data.objects.remove(item)
    for item in filter(None, (city, ground)):
        shown = item
        if is_in_place(city):
            # A city that was taken from objects of the user is hidden itself; the picture shows a copy with its mesh.
            shown = item.copy()
            shown[PREFIX + "part"], shown.hide_render = "picture", False
        stage.collection.objects.link(shown)
    views = list_views(context)
    if view == "viewport" and not views:
        raise InputError("3D view", "none is open", "open a 3D view, or choose another view")
    area = context.area if context.area in views else max(views, key=lambda one: one.width * one.height, default=None)
    space = area.spaces.active if view == "viewport" else None
    if view == "overview":
        camera = place_camera(stage, read_vertices(city))
    elif space is None or space.region_3d.view_perspective == "CAMERA":
        camera = copy_camera(stage, context.scene)
    else:
        region = next(region for region in area.regions if region.type == "WINDOW")
        camera = copy_view(stage, space.region_3d, region.width, region.height, 10 * space.clip_end)
    scale = read_scale(city)
    build_legend(stage, camera, scale, note_of(city, scale.attribute))
    set_background(stage)
    show_exact_colours(stage)
    prepare_render(stage)
    return stage


def copy_view(stage, seen, width, height, far):
    """Place the picture's camera where the user looks from.

    Parameters
    ----------
    stage : bpy.types.Scene
    seen : bpy.types.RegionView3D
    width, height : int
        Size of the region [pixels].
    far : float
        Distance of the camera's far plane.

    Returns
    -------
    bpy.types.Object
    """
    camera = find_camera(stage, WIDTH, max(1, round(WIDTH * height / width)))
    across = float(seen.window_matrix[0][0])  # cotangent of half the angle, or 2 / width of an orthographic view
    camera.data.type, camera.data.clip_end = "PERSP" if seen.is_perspective else "ORTHO", far
    camera.data.lens, camera.data.ortho_scale = across * SENSOR_WIDTH / 2, 2 / across  # either counts
    camera.matrix_world = seen.view_matrix.inverted()
    return camera


def copy_camera(stage, scene):
    """Give the picture's camera, which is returned, place, lens and resolution of a scene's own."""
    if scene.camera is None or scene.camera.type != "CAMERA":
        raise InputError("Camera", "the scene has none", "add a camera, or choose another view")
    render, given = scene.render, scene.camera.data
    camera = find_camera(stage, render.resolution_x, render.resolution_y)
    for name in ("type", "lens", "sensor_width", "sensor_height", "sensor_fit", "ortho_scale", "shift_x", "shift_y"):
        setattr(camera.data, name, getattr(given, name))
    camera.data.clip_start, camera.data.clip_end = min(given.clip_start, 0.1), given.clip_end
    camera.matrix_world = Matrix(np.array(scene.camera.matrix_world).tolist())
    stage.render.resolution_percentage = render.resolution_percentage
    return camera


class RenderCity(OfCity, Action, bpy.types.Operator):
    """Render a picture of the coloured city with its legend, in the scene "CityPV picture"; yours is not changed"""

    bl_idname, bl_label = "citypv.render", "Render picture"
    needs, lacking = PREFIX + "colour_attribute", "Colour the faces first"

    view: bpy.props.EnumProperty(name="View", description="Where the picture is taken from", items=VIEWS)

    def act(self, context, city, ground):
        """Set up the scene and render it."""
        leave_edit_mode(context)
        stage = stage_picture(context, self.view)
        # In a window the picture opens beside the city while it renders.
        bpy.ops.render.render("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT", scene=stage.name)
