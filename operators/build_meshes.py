"""Build two Blender objects from a Scene: the city and the generated ground."""

import bpy
import numpy as np

from ..core.city.scene import surface_of_triangles
from .attributes import PREFIX
from .keep_report import BUILDINGS
from .write_attributes import write_face_attribute

COLLECTION = "CityPV"


def build_meshes(scene, name="City"):
    """Build the objects of a scene, with the face attributes `citypv_surface` and, on the city, `citypv_building`.

    Parameters
    ----------
    scene : core.scene.scene.Scene
        Triangles with the surface each belongs to.
    name : str
        Name of the city's object; the ground is called "Ground".

    Returns
    -------
    city : bpy.types.Object
        The faces are the triangles of the surfaces, in their order.
    ground : bpy.types.Object or None
        The triangles that belong to no surface; None where there are none.
    """
    generated = surface_of_triangles(scene) < 0
    own = scene.triangle_surface >= 0  # undersides and edges of racks have no results to show
    city = _build_object(name, scene, own)
    ground = _build_object("Ground", scene, generated) if generated.any() else None
    _write_buildings(city, scene, scene.triangle_surface[own])
    for item, part in ((city, "city"), (ground, "ground")):
        if item is not None:
            item[PREFIX + "part"] = part
            _write_site(item, scene.site)
    if ground is not None:
        city[PREFIX + "ground"] = ground
    return city, ground


def show_objects(stage, *items):
    """Link objects to the collection "CityPV" of a Blender scene, created if missing."""
    target = bpy.data.collections.get(COLLECTION) or bpy.data.collections.new(COLLECTION)
    if target.name not in stage.collection.children:
        stage.collection.children.link(target)
    for item in filter(None, items):
        target.objects.link(item)


def remove_city(*items):
    """Remove objects with their meshes; None is skipped."""
    for item in filter(None, items):
        mesh = item.data
        bpy.data.objects.remove(item)
        bpy.data.meshes.remove(mesh)


def read_vertices(item):
    """Read the vertices of an object in world coordinates: (v, 3) float64 [m]."""
    points = np.empty(3 * len(item.data.vertices), dtype=np.float32)
    item.data.vertices.foreach_get("co", points)
    matrix = np.array(item.matrix_world, dtype=np.float64)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def _build_object(name, scene, chosen):
    mesh = _build_mesh(name, scene.vertices, scene.triangles[chosen])
    write_face_attribute(mesh, "surface", scene.triangle_surface[chosen])
    return bpy.data.objects.new(name, mesh)


def _write_buildings(city, scene, surfaces):
    # The names are stored on the object, in file order; the faces store their index into that list.
    number = {name: place for place, name in enumerate(dict.fromkeys(scene.surfaces.building_id))}
    city[BUILDINGS] = list(number)
    numbers = np.array([number[name] for name in scene.surfaces.building_id], dtype=np.int32)
    write_face_attribute(city.data, "building", numbers[surfaces])


def _build_mesh(name, vertices, triangles):
    # Only vertices in use, in scene order.
    used, corners = np.unique(triangles, return_inverse=True)
    corners = np.ascontiguousarray(corners.ravel(), dtype=np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(used))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices[used], dtype=np.float32).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    return mesh


def _write_site(item, site):
    # Georeference of the local axes; unknown values are omitted.
    known = {
        "latitude": site.latitude,
        "longitude": site.longitude,
        "altitude": site.altitude,
        "convergence": site.convergence,
        "crs": site.crs,
        "origin": [float(value) for value in site.origin],
    }
    for key, value in known.items():
        if value is not None:
            item[PREFIX + key] = value
