"""Set up a Blender scene of its own for a picture: the user's camera, world and resolution stay as they are."""

import bpy
import numpy as np
from mathutils import Matrix

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .build_legend import build_legend
from .build_meshes import read_vertices
from .colour_faces import read_scale, show_exact_colours
from .in_place import is_in_place
from .legend_note import note_of
from .place_camera import SENSOR_WIDTH, find_camera, place_camera, set_background
from .render_preview import prepare_render
from .session import find_city

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
        stage.collection.objects.link(_copy_hidden(item) if is_in_place(city) else item)
    camera = _aim(context, stage, view, city)
    scale = read_scale(city)
    build_legend(stage, camera, scale, note_of(city, scale.attribute))
    set_background(stage)
    show_exact_colours(stage)
    prepare_render(stage)
    return stage


def _copy_hidden(item):
    # A city that was taken from objects of the user is hidden itself; the picture shows a copy with the same mesh.
    copy = item.copy()
    copy[PREFIX + "part"], copy.hide_render = "picture", False
    return copy


def _aim(context, stage, view, city):
    if view == "overview":
        return place_camera(stage, read_vertices(city))
    if view == "camera":
        return _copy_camera(stage, context.scene)
    space, region = _find_view(context)
    if space.region_3d.view_perspective == "CAMERA":
        return _copy_camera(stage, context.scene)
    return copy_view(stage, space.region_3d, region.width, region.height, 10 * space.clip_end)


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
    camera = find_camera(stage)
    across = float(seen.window_matrix[0][0])  # cotangent of half the angle, or 2 / width of an orthographic view
    data = camera.data
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR_WIDTH
    data.shift_x = data.shift_y = 0.0
    data.type = "PERSP" if seen.is_perspective else "ORTHO"
    if seen.is_perspective:
        data.lens = across * SENSOR_WIDTH / 2
    else:
        data.ortho_scale = 2 / across
    data.clip_start, data.clip_end = 0.1, far
    camera.matrix_world = seen.view_matrix.inverted()
    stage.render.resolution_x = WIDTH
    stage.render.resolution_y = max(1, round(WIDTH * height / width))
    stage.render.resolution_percentage = 100
    return camera


def _copy_camera(stage, scene):
    if scene.camera is None or scene.camera.type != "CAMERA":
        raise InputError("Camera", "the scene has none", "add a camera, or choose another view")
    camera, given = find_camera(stage), scene.camera.data
    for name in ("type", "lens", "sensor_width", "sensor_height", "sensor_fit", "ortho_scale", "shift_x", "shift_y"):
        setattr(camera.data, name, getattr(given, name))
    camera.data.clip_start, camera.data.clip_end = min(given.clip_start, 0.1), given.clip_end
    camera.matrix_world = Matrix(np.array(scene.camera.matrix_world).tolist())
    for name in ("resolution_x", "resolution_y", "resolution_percentage"):
        setattr(stage.render, name, getattr(scene.render, name))
    return camera


def _find_view(context):
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    views = [area for area in areas if area.type == "VIEW_3D"]
    if not views:
        raise InputError("3D view", "none is open", "open a 3D view, or choose another view")
    area = context.area if context.area in views else max(views, key=lambda area: area.width * area.height)
    return area.spaces.active, next(region for region in area.regions if region.type == "WINDOW")
