"""Rendered pictures: `city.blend` and `preview.png` of `citypv simulate`, and what the user sees,
by a button.

The button renders a Blender scene of its own: the user's camera, world and resolution stay as they
are.
"""

import ctypes
import io
import os
import sys
from contextlib import contextmanager, redirect_stdout, suppress

import bpy
import numpy as np
from mathutils import Matrix

from ...core.settings.errors import InputError
from ..city.attributes import Faces
from ..city.build_meshes import build_meshes, read_vertices, show_objects
from ..city.keys import Key
from ..city.run_step import Action, OfCity, leave_edit_mode, list_views
from ..city.session import find_city
from ..city.source_objects import is_in_place
from .build_legend import build_legend, note_of
from .colour_faces import colour_faces, read_scale, show_exact_colours
from .colour_user_meshes import MASK
from .show_city import SENSOR_WIDTH, find_camera, place_camera, set_background, show_city

SCENE = "CityPV picture"
SAMPLES = 16  # rays per pixel; only the ground's ambient occlusion is noisy


def draw_results(folder, scene, transfer, energy, note, *, pictures):
    """Let Blender write pictures into a folder, of the city from above the south-east with camera
    and legend.

    In `city.blend` every face has its attributes and is coloured by full load hours, as it is in
    `preview.png`. Everything that was open in Blender is lost: this is for a Blender that runs
    without a window.

    Parameters
    ----------
    folder : pathlib.Path
    scene : Scene
    transfer : Transfer
    energy : Energy
    note : str
        What has to be read beside the colours, such as the weather.
    pictures : list of {'blend', 'preview'}
    """
    # An empty scene with the city, its classes and results.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    stage, folder = bpy.context.scene, folder.resolve()
    city, ground = build_meshes(scene)
    show_objects(stage, city, ground)
    faces = Faces(city, ground)
    faces.write_classes(scene.surfaces)
    faces.write_results(transfer, energy)
    # A scene without full load hours (only ground) still gets a picture, of its relative diffuse
    # irradiance.
    known = np.isfinite(energy.full_load_hours).any()
    scale = colour_faces(city, ground, "full_load_hours" if known else "diffuse_relative")
    # Colours as they are, camera and legend.
    show_exact_colours(stage)
    set_background(stage)
    points = read_vertices(city)
    build_legend(stage, place_camera(stage, points), scale, note)
    # The file opens with the city in view; then file and picture.
    views = [area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D"]
    show_city(bpy.context, points, areas=views)
    with _quieten():
        if "blend" in pictures:
            bpy.context.preferences.filepaths.save_version = 0
            bpy.ops.wm.save_as_mainfile(
                filepath=str(folder / "city.blend"), compress=True, check_existing=False
            )
        if "preview" in pictures:
            _prepare_render(stage)
            stage.render.filepath, stage.render.use_file_extension = (
                str(folder / "preview.png"),
                False,
            )
            bpy.ops.render.render(write_still=True, scene=stage.name)


def _prepare_render(stage):
    """Set a Blender scene up for Cycles on the processor; colours come out exactly as in the
    legend.
    """
    render, cycles = stage.render, stage.cycles
    render.engine = "CYCLES"
    cycles.device, cycles.samples, cycles.seed = "CPU", SAMPLES, 0
    cycles.use_adaptive_sampling, cycles.use_denoising, cycles.max_bounces = False, False, 0
    render.film_transparent, render.dither_intensity = False, 0.0
    render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGB"


@contextmanager
def _quieten():
    """Discard what Blender prints to standard output; standard error is not affected."""
    _flush()
    kept, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        # Operator reports are printed by Python, render progress by C.
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        _flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def _flush():
    # Blender writes to C's stdio buffers, which Python does not flush.
    sys.stdout.flush()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)


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
    # The scene of an earlier picture is emptied; city and ground are linked, or a copy where they
    # are not whole.
    city, ground = find_city(context.scene)
    stage = bpy.data.scenes.get(SCENE) or bpy.data.scenes.new(SCENE)
    for item in list(stage.collection.objects):
        stage.collection.objects.unlink(item)
        if item.get(Key.PART) == "picture":
            bpy.data.objects.remove(item)
    for item in filter(None, (city, ground)):
        shown = item
        if is_in_place(city) or MASK in item.modifiers:
            # Objects of the user show all of a city that was taken from them, or some of its faces;
            # the picture, without them, shows a copy with the whole mesh.
            shown = item.copy()
            shown[Key.PART], shown.hide_render = "picture", False
            if MASK in shown.modifiers:
                shown.modifiers.remove(shown.modifiers[MASK])
        stage.collection.objects.link(shown)
    # The view of the picture: from above, as in the 3D view, or of the scene's camera.
    views = list_views(context)
    if view == "viewport" and not views:
        raise InputError("3D view", "none is open", "open a 3D view, or choose another view")
    area = (
        context.area
        if context.area in views
        else max(views, key=lambda one: one.width * one.height, default=None)
    )
    space = area.spaces.active if view == "viewport" else None
    if view == "overview":
        camera = place_camera(stage, read_vertices(city))
    # A 3D view that looks through the camera is taken as the camera.
    elif space is None or space.region_3d.view_perspective == "CAMERA":
        camera = _copy_camera(stage, context.scene)
    else:
        region = next(region for region in area.regions if region.type == "WINDOW")
        camera = copy_view(stage, space.region_3d, region.width, region.height, 10 * space.clip_end)
    # Legend and background, as for any picture.
    scale = read_scale(city)
    build_legend(stage, camera, scale, note_of(city, scale.name))
    set_background(stage)
    show_exact_colours(stage)
    _prepare_render(stage)
    return stage


def copy_view(stage, seen, width, height, far, *, pixels=1600):
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
    camera = find_camera(stage, pixels, max(1, round(pixels * height / width)))
    # cotangent of half the angle, or 2 / width of an orthographic view
    across = float(seen.window_matrix[0][0])
    camera.data.type, camera.data.clip_end = "PERSP" if seen.is_perspective else "ORTHO", far
    # either counts
    camera.data.lens, camera.data.ortho_scale = (
        across * SENSOR_WIDTH / 2,
        2 / across,
    )
    camera.matrix_world = seen.view_matrix.inverted()
    return camera


def _copy_camera(stage, scene):
    """Give the picture's camera, which is returned, place, lens and resolution of a scene's own."""
    if scene.camera is None or scene.camera.type != "CAMERA":
        raise InputError("Camera", "the scene has none", "add a camera, or choose another view")
    render, given = scene.render, scene.camera.data
    camera = find_camera(stage, render.resolution_x, render.resolution_y)
    for name in (
        "type",
        "lens",
        "sensor_width",
        "sensor_height",
        "sensor_fit",
        "ortho_scale",
        "shift_x",
        "shift_y",
    ):
        setattr(camera.data, name, getattr(given, name))
    camera.data.clip_start, camera.data.clip_end = min(given.clip_start, 0.1), given.clip_end
    camera.matrix_world = Matrix(np.array(scene.camera.matrix_world).tolist())
    stage.render.resolution_percentage = render.resolution_percentage
    return camera


class RenderCity(OfCity, Action, bpy.types.Operator):
    """Render the coloured city with its legend in the scene "CityPV picture", beside yours"""

    bl_idname, bl_label = "citypv.render", "Render picture"
    needs, lacking = Key.COLOUR_ATTRIBUTE, "Colour the faces first"

    view: bpy.props.EnumProperty(
        name="View",
        description="Where the picture is taken from",
        items=[
            ("overview", "Whole city", "From above the south-east, with everything in the frame"),
            ("viewport", "3D view", "As the 3D view shows it"),
            ("camera", "Camera", "Through the scene's own camera, in its resolution"),
        ],
    )

    def act(self, context, city, ground):
        """Set up the scene and render it."""
        leave_edit_mode(context)
        stage = stage_picture(context, self.view)
        # In a window the picture opens beside the city while it renders.
        bpy.ops.render.render(
            "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT", scene=stage.name
        )
