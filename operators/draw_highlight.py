"""Draw the selected faces of the city over it in the 3D view, in one colour and without edges."""

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .in_place import is_seen
from .select_faces import HIGHLIGHT, read_selection
from .session import find_city

COLOUR = (1.0, 0.35, 0.0, 0.75)  # sRGB with alpha
LIFT = 2e-4  # of the city's size: in front of its faces for the depth buffer, see `show_city`

_kept = {"key": None, "batch": None}


def draw_highlight():
    """Draw the highlight of the city in the current 3D view, if it has one."""
    scene = bpy.context.scene
    city, _ = find_city(scene)
    if city is None or not city.get(HIGHLIGHT) or city.mode != "OBJECT" or not is_seen(city):
        return
    points = lift_faces(city.data)
    if not len(points):
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    key = city.session_uid, hash(points.tobytes())
    if _kept["key"] != key:
        _kept["key"], _kept["batch"] = key, batch_for_shader(shader, "TRIS", {"pos": points})
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(city.matrix_world)
        shader.uniform_float("color", COLOUR)
        _kept["batch"].draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def lift_faces(mesh):
    """Corners of the selected triangles of a mesh, lifted off them a little: (3 k, 3) float32 [m]."""
    chosen = read_selection(mesh)
    points, normals = (np.empty(3 * count, np.float32) for count in (len(mesh.vertices), len(mesh.polygons)))
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.polygons.foreach_get("normal", normals)
    mesh.loops.foreach_get("vertex_index", corners)
    points = points.reshape(-1, 3)
    lift = LIFT * float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
    triangles = points[corners.reshape(-1, 3)[chosen]]  # the city's faces are triangles
    return np.ascontiguousarray((triangles + lift * normals.reshape(-1, 1, 3)[chosen]).reshape(-1, 3))
