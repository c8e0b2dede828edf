"""Set up the 3D views to show the whole city in exact colours."""

import bpy
import numpy as np
from mathutils import Matrix, Vector

from .place_camera import AZIMUTH, ELEVATION, camera_axes


def show_city(points=None, shaded=False):
    """Show colours in solid mode (no shader compilation), and set clipping distances for the whole city.

    Parameters
    ----------
    points : (n, 3) float [m], optional
        Points that every 3D view is turned to, from the south-east above.
    shaded : bool
        Show the shape by a studio light, where there are no colours yet.
    """
    for screen in bpy.data.screens:
        for space in (area.spaces.active for area in screen.areas if area.type == "VIEW_3D"):
            shading = space.shading
            shading.type = "SOLID"
            shading.light, shading.color_type = ("STUDIO", "MATERIAL") if shaded else ("FLAT", "VERTEX")
            shading.show_cavity, shading.show_object_outline = shaded, False
            # Blender's floor grid lies in the ground plane and would show through.
            space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
            if points is not None and len(points):
                _look_at(space, points)


def _look_at(space, points):
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    # A closer near plane reduces the depth resolution of distant surfaces.
    space.clip_start, space.clip_end = size / 1000, 10 * size
    region = space.region_3d
    right, up, forward = camera_axes(AZIMUTH, ELEVATION)
    region.view_perspective = "PERSP"
    region.view_location = Vector(((low + high) / 2).tolist())
    region.view_rotation = Matrix(np.column_stack((right, up, -forward)).tolist()).to_quaternion()
    region.view_distance = size
