"""Place a camera that frames the whole city from above the south-east, with a plain background."""

import bpy
import numpy as np
from mathutils import Matrix

from ..core.results.colour_map import GROUND
from .colour_scale import linear_colour

CAMERA = "CityPV camera"
LENS, SENSOR_WIDTH = 60.0, 36.0  # [mm]
AZIMUTH, ELEVATION = 150.0, 38.0  # of the camera, seen from the city [°]
MARGIN_SIDE, MARGIN_TOP, MARGIN_BOTTOM = 0.04, 0.05, 0.20  # of the frame's half width and half height


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
    right, up, forward = camera_axes(AZIMUTH, ELEVATION)
    location = frame_points(points, (right, up, forward), tan_x, tan_x * height / width)
    camera = find_camera(scene)
    data = camera.data
    data.type, data.lens, data.sensor_width, data.sensor_fit = "PERSP", LENS, SENSOR_WIDTH, "HORIZONTAL"
    data.shift_x = data.shift_y = 0.0
    depths = (points - location) @ forward
    data.clip_start, data.clip_end = 0.1, float(4 * depths.max() + 100)
    # A camera looks along its own -z, with y up.
    matrix = np.eye(4)
    matrix[:3] = np.column_stack((right, up, -forward, location))
    camera.matrix_world = Matrix(matrix.tolist())
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    return camera


def find_camera(scene):
    """The camera of CityPV's pictures, created if missing, as the camera of a Blender scene."""
    camera = bpy.data.objects.get(CAMERA)
    if camera is None:
        camera = bpy.data.objects.new(CAMERA, bpy.data.cameras.get(CAMERA) or bpy.data.cameras.new(CAMERA))
    if camera.name not in scene.collection.all_objects:
        scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def camera_axes(azimuth, elevation):
    """Right, up and forward vectors of a camera at an azimuth and elevation [°] that looks at the origin."""
    azimuth, elevation = np.radians([azimuth, elevation])
    horizontal = np.cos(elevation)
    forward = -np.array([np.sin(azimuth) * horizontal, np.cos(azimuth) * horizontal, np.sin(elevation)])
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def frame_points(points, axes, tan_x, tan_y):
    """Nearest camera position with all points inside the margins.

    In the camera's axes a point (x, y, z) is seen from (c_x, c_y, c_z) where x - c_x ≤ (z - c_z) tan_x, and so on
    for the other three edges. Each edge's tightest point gives one bound; two opposite bounds give the depth c_z.
    """
    right, up, forward = axes
    x, y, z = points @ right, points @ up, points @ forward
    tan_x = tan_x * (1 - MARGIN_SIDE)
    tan_top, tan_bottom = tan_y * (1 - MARGIN_TOP), tan_y * (1 - MARGIN_BOTTOM)
    bound_right, bound_left = np.max(x - tan_x * z), np.max(-x - tan_x * z)
    bound_top, bound_bottom = np.max(y - tan_top * z), np.max(-y - tan_bottom * z)
    depth = min(-(bound_right + bound_left) / (2 * tan_x), -(bound_top + bound_bottom) / (tan_top + tan_bottom))
    # Centre: the remaining width is split between the two sides.
    across = (bound_right - bound_left) / 2
    height = ((bound_top + tan_top * depth) + (-bound_bottom - tan_bottom * depth)) / 2
    return across * right + height * up + (depth - 1.0) * forward


def set_background(scene):
    """Set a plain background in the colour of the ground (with nodes, which every renderer supports)."""
    world = bpy.data.worlds.get("CityPV sky") or bpy.data.worlds.new("CityPV sky")
    if world.node_tree is None:
        world.use_nodes = True
    nodes = world.node_tree.nodes
    nodes.clear()
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    background.inputs["Color"].default_value = linear_colour(GROUND)
    world.node_tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    scene.world = world
