"""Frame the whole city from above the south-east: a camera with a plain background, and the 3D
views.
"""

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.results.colour_map import GROUND
from ..city.keys import Key
from ..city.run_step import list_views
from ..city.session import find_city
from .colour_faces import linear_colour, start_nodes

CAMERA = "CityPV camera"
LENS, SENSOR_WIDTH = 60.0, 36.0  # [mm]
AZIMUTH, ELEVATION = np.radians([150.0, 38.0])  # of the camera, seen from the city
RIGHT = np.array([-np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])  # of what it sees, as FORWARD and UP
FORWARD = -np.array(
    [*(np.cos(ELEVATION) * np.array([np.sin(AZIMUTH), np.cos(AZIMUTH)])), np.sin(ELEVATION)]
)
UP = np.cross(RIGHT, FORWARD)
KEPT = ("type", "light", "color_type", "show_cavity", "show_object_outline")


def place_camera(scene, points, width=1600, height=900):
    """Place the camera of a Blender scene so that all points are in the frame, above the legend.

    Parameters
    ----------
    scene : bpy.types.Scene
    points : (n, 3) float [m]
    width, height : int
        Size of the picture [pixels].

    Returns
    -------
    bpy.types.Object
        The camera; it is the scene's camera now.
    """
    tan_x = SENSOR_WIDTH / 2 / LENS
    location = _frame_points(points, (RIGHT, UP, FORWARD), tan_x, tan_x * height / width)
    camera = find_camera(scene, width, height)
    depths = (points - location) @ FORWARD
    camera.data.type, camera.data.lens, camera.data.clip_end = (
        "PERSP",
        LENS,
        float(4 * depths.max() + 100),
    )
    # A camera looks along its own -z, with y up.
    matrix = np.eye(4)
    matrix[:3] = np.column_stack((RIGHT, UP, -FORWARD, location))
    camera.matrix_world = Matrix(matrix.tolist())
    return camera


def find_camera(scene, width, height):
    """The camera of CityPV's pictures of this size, created if missing, as the camera of a Blender
    scene.
    """
    data = bpy.data.cameras.get(CAMERA) or bpy.data.cameras.new(CAMERA)
    camera = bpy.data.objects.get(CAMERA) or bpy.data.objects.new(CAMERA, data)
    if camera.name not in scene.collection.all_objects:
        scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = (
        width,
        height,
        100,
    )
    data.sensor_fit, data.sensor_width, data.clip_start = "HORIZONTAL", SENSOR_WIDTH, 0.1
    data.shift_x = data.shift_y = 0.0
    return camera


def _frame_points(points, axes, tan_x, tan_y):
    """Nearest camera position with all points inside the margins.

    In the camera's axes a point (x, y, z) is seen from (c_x, c_y, c_z) where x - c_x ≤ (z - c_z)
    tan_x, and so on for the other three edges. Each edge's tightest point gives one bound; two
    opposite bounds give the depth c_z.
    """
    right, up, forward = axes
    x, y, z = points @ right, points @ up, points @ forward
    # The city leaves margins in the frame: beside it 4 %, above it 5 %, below it 20 % for the
    # legend.
    tan_x = tan_x * (1 - 0.04)
    tan_top, tan_bottom = tan_y * (1 - 0.05), tan_y * (1 - 0.20)
    bound_right, bound_left = np.max(x - tan_x * z), np.max(-x - tan_x * z)
    bound_top, bound_bottom = np.max(y - tan_top * z), np.max(-y - tan_bottom * z)
    depth = min(
        -(bound_right + bound_left) / (2 * tan_x),
        -(bound_top + bound_bottom) / (tan_top + tan_bottom),
    )
    # Centre: the remaining width is split between the two sides.
    across = (bound_right - bound_left) / 2
    height = ((bound_top + tan_top * depth) + (-bound_bottom - tan_bottom * depth)) / 2
    return across * right + height * up + (depth - 1.0) * forward


def set_background(scene):
    """Set a plain background in the colour of the ground (with nodes, which every renderer
    supports).
    """
    world = bpy.data.worlds.get("CityPV sky") or bpy.data.worlds.new("CityPV sky")
    nodes, links, output = start_nodes(world, "ShaderNodeOutputWorld")
    background = nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = linear_colour(GROUND)
    links.new(background.outputs["Background"], output.inputs["Surface"])
    scene.world = world


def show_city(context, points=None, shaded=False, areas=None):
    """Show colours in solid mode (no shader compilation), and set clipping distances for the whole
    city.

    Other workspaces keep their own shading.

    Parameters
    ----------
    context : bpy.types.Context
    points : (n, 3) float [m], optional
        Points that every 3D view is turned to, from the south-east above.
    shaded : bool
        Show the shape by a studio light, where there are no colours yet.
    areas : iterable of bpy.types.Area, optional
        3D views; by default those that are to be seen.
    """
    for area in list_views(context) if areas is None else areas:
        space, shading = area.spaces.active, area.spaces.active.shading
        shading.type = "SOLID"
        shading.light, shading.color_type = ("STUDIO", "MATERIAL") if shaded else ("FLAT", "VERTEX")
        shading.show_cavity, shading.show_object_outline = shaded, False
        # Blender's floor grid lies in the ground plane and would show through.
        space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
        if points is not None and len(points):
            look_at(area, points)


def match_view(context, points=None):
    """Show colours where the scene's city has them and they are switched on, else its shape in a
    studio light.

    `points` are as in `show_city`.
    """
    city, _ = find_city(context.scene)
    if city is not None:
        coloured = Key.COLOUR in city.data.color_attributes and context.scene.citypv.show_colours
        show_city(context, points, shaded=not coloured)


def keep_shading(context):
    """Store how the 3D view is shaded, if it is not by CityPV, and the scene's view transform."""
    for area in list_views(context)[:1]:
        shading = area.spaces.active.shading
        if (shading.light, shading.color_type) != ("FLAT", "VERTEX"):
            context.scene[Key.SHADING_BEFORE] = {name: getattr(shading, name) for name in KEPT}
            context.scene[Key.TRANSFORM_BEFORE] = context.scene.view_settings.view_transform


def give_back_shading(context):
    """Shade the 3D views as `keep_shading` found them."""
    kept = context.scene.get(Key.SHADING_BEFORE)
    if not kept:
        match_view(context)
        return
    for area in list_views(context):
        for name in KEPT:
            setattr(area.spaces.active.shading, name, kept[name])
    context.scene.view_settings.view_transform = context.scene[Key.TRANSFORM_BEFORE]


def look_at(area, points):
    """Turn a 3D view so that all points, (n, 3) float [m], are in what toolbar and sidebar leave
    free.
    """
    regions, space = {region.type: region for region in area.regions}, area.spaces.active
    view, tools, sidebar = (regions[name] for name in ("WINDOW", "TOOLS", "UI"))
    width, height, on_left, on_right, above = view.width, view.height, 0.0, 0.0, 0.0
    # A view that has no size yet counts as 16:9.
    if min(width, height) <= 1:
        width, height = 16, 9
    else:
        # Shares of the width that toolbar and sidebar lie over, and of the height that the headers
        # do.
        shown = {"HEADER": space.show_region_header, "TOOL_HEADER": space.show_region_tool_header}
        above = (
            max((view.y + height - regions[name].y for name in shown if shown[name]), default=0)
            / height
        )
        left = tools.x + tools.width - view.x if space.show_region_toolbar else 0
        right = view.x + width - sidebar.x if space.show_region_ui else 0
        on_left, on_right = (min(max(pixels / width, 0.0), 0.4) for pixels in (left, right))
        above = min(max(above, 0.0), 0.2)
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    # A closer near plane reduces the depth resolution of distant surfaces.
    space.clip_start, space.clip_end = size / 1000, 10 * size
    # The sensor of a 3D view is 72 mm wide along its longer side.
    half = 72.0 / 2 / space.lens / max(width, height)
    # In axes that lean aside, the free part is symmetric.
    lean, free = half * width * (on_right - on_left), half * width * (1 - on_left - on_right)
    # The nearest place from which all points are within the free part, looking as the picture's
    # camera does.
    framed = _frame_points(
        points, (RIGHT + lean * FORWARD, UP, FORWARD), free, half * height * (1 - 2 * above)
    )
    depth = framed @ FORWARD - lean * (framed @ RIGHT)
    eye = (framed @ RIGHT - lean * depth) * RIGHT + (framed @ UP) * UP + depth * FORWARD
    distance = float((low + high) / 2 @ FORWARD) - depth
    # The view turns around the point on its axis that is as far as the middle of the points.
    region = space.region_3d
    region.view_perspective = "PERSP"
    region.view_location = Vector((eye + distance * FORWARD).tolist())
    region.view_rotation = Matrix(np.column_stack((RIGHT, UP, -FORWARD)).tolist()).to_quaternion()
    region.view_distance = distance
