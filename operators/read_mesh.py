"""Blender meshes, as they stand in the scene → a City."""

import bmesh
import numpy as np

from ..core.errors import InputError
from ..core.geometry.city import City, ImportReport


def read_meshes(items, context):
    """Read mesh objects as buildings: an object is a building, a face of it (after modifiers) a surface.

    World axes are taken as x east, y north, z up, in metres; the place on Earth has to be given by hand.

    Parameters
    ----------
    items : list of bpy.types.Object
        Mesh objects.
    context : bpy.types.Context
        For the modifiers and the scene's unit.

    Returns
    -------
    City

    Raises
    ------
    InputError
        There is no face.
    """
    graph = context.evaluated_depsgraph_get()
    metres = context.scene.unit_settings.scale_length
    points, sizes, surface_id, building_id = [np.empty((0, 3))], [], [], []
    for item in items:
        corners, face_sizes = _read_faces(item, graph)
        points.append(corners * metres)
        sizes += face_sizes
        surface_id += [f"{item.name}/{face}" for face in range(len(face_sizes))]
        building_id += [item.name] * len(face_sizes)
    if not sizes:
        raise InputError("Selected meshes", "they have no faces", "select meshes with faces")
    return City(
        surface_id=surface_id,
        building_id=building_id,
        thematic=[""] * len(sizes),
        points=np.concatenate(points),
        ring_start=np.concatenate(([0], np.cumsum(sizes))).astype(np.int64),
        polygon_start=np.arange(len(sizes) + 1, dtype=np.int64),
        crs=None,
        report=ImportReport(files=[item.name for item in items], building_count=len(items)),
    )


def _read_faces(item, graph):
    # Corner points of all faces in a row, and how many each has; a mirrored object keeps its outside outside.
    solid = bmesh.new()
    solid.from_object(item, graph)
    matrix = item.matrix_world
    solid.transform(matrix)
    if matrix.determinant() < 0:
        bmesh.ops.reverse_faces(solid, faces=solid.faces)
    sizes = [len(face.verts) for face in solid.faces]
    corners = np.array([vertex.co for face in solid.faces for vertex in face.verts], dtype=np.float64).reshape(-1, 3)
    solid.free()
    return corners, sizes
