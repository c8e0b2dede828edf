"""Build two Blender objects from a Scene: the city and the generated ground."""

import unicodedata

import bpy
import numpy as np

from .attributes import PREFIX, read_array, write_face_attribute
from .keys import Key
from .session import find_city
from .source_objects import COLLECTION


def build_meshes(scene, name="City", *, grounded=True):
    """Build the objects of a scene, with the face attributes `citypv_surface` and, on the city,
    `citypv_building`.

    Parameters
    ----------
    scene : core.city.scene.Scene
        Triangles with the surface each belongs to.
    name : str
        Name of the city's object; the ground is called "Ground".
    grounded : bool
        Whether the ground is built, too.

    Returns
    -------
    city : bpy.types.Object
        The faces are the triangles of the surfaces, in their order.
    ground : bpy.types.Object or None
        The triangles that belong to no surface, moved with the city; None where there are none, or
        none is wanted.
    """
    generated, city = scene.surface_of_triangle < 0, _build_city(scene, name)
    if not (grounded and generated.any()):
        return city, None
    city[Key.GROUND] = ground = _build_object("Ground", "ground", scene, generated)
    ground.parent = city
    return city, ground


def _build_city(scene, name):
    """Build the city's object of a scene without its ground: bpy.types.Object."""
    own = scene.triangle_surface >= 0  # undersides and edges of racks have no results to show
    city = _build_object(name, "city", scene, own)
    # The names are stored on the object; the faces store their index into that list.
    number = {name: place for place, name in enumerate(dict.fromkeys(scene.surfaces.building_id))}
    numbers = np.array([number[name] for name in scene.surfaces.building_id], dtype=np.int32)
    write_face_attribute(city.data, "building", numbers[scene.triangle_surface[own]])
    city[Key.BUILDINGS] = list(number)
    return city


def _build_object(name, part, scene, chosen):
    # Only vertices in use, in scene order; what is unknown of the place of the local axes is
    # omitted.
    used, corners = np.unique(scene.triangles[chosen], return_inverse=True)
    corners = np.ascontiguousarray(corners.ravel(), dtype=np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(used))
    mesh.vertices.foreach_set(
        "co", np.ascontiguousarray(scene.vertices[used], dtype=np.float32).ravel()
    )
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    write_face_attribute(mesh, "surface", scene.triangle_surface[chosen])
    item, site = bpy.data.objects.new(name, mesh), scene.site
    item[Key.PART], item[Key.ORIGIN] = part, [float(value) for value in site.origin]
    for key in ("latitude", "longitude", "altitude", "convergence", "crs"):
        if getattr(site, key) is not None:
            item[PREFIX + key] = getattr(site, key)
    return item


def show_objects(stage, *items):
    """Link objects to the collection "CityPV" of a Blender scene, created if missing; None is
    skipped.
    """
    target = _open_collection(stage)
    for item in filter(None, items):
        target.objects.link(item)


def _open_collection(stage):
    target = bpy.data.collections.get(COLLECTION) or bpy.data.collections.new(COLLECTION)
    if target.name not in stage.collection.children:
        stage.collection.children.link(target)
    return target


def is_held():
    """Whether there is the collection "CityPV": what a step shows while it runs can be undone."""
    return COLLECTION in bpy.data.collections


def hold_cities(stage, message):
    """Make the collection "CityPV" a step of undo, where a scene has none, before a city is shown
    in it.

    Else undo keeps the scene as it is, with a city that it frees (see `renew_holders`). A step of
    which this is undone has nothing to show its city in, and ends.
    """
    if not is_held():
        _open_collection(stage)
        renew_holders()
        bpy.ops.ed.undo_push(message=message)


def renew_holders():
    """Change what holds the objects of cities, so that undo reads it anew.

    Undo keeps an ID that is the same in the last two steps as it is now. Cities are replaced
    between steps (by what a step shows while it runs, by an update): a scene or collection kept so
    would hold objects that undo has freed, and Blender crashes. So these must differ from step to
    step: this is called in between.
    """
    group = bpy.data.collections.get(COLLECTION)
    if group is not None:
        for holder in (group, *bpy.data.scenes):
            holder[Key.TURN] = (holder.get(Key.TURN, 0) + 1) % 2**30


def remove_objects(*items):
    """Remove objects with their data; None is skipped."""
    bpy.data.batch_remove(
        [part for item in items if item is not None for part in (item, item.data)]
    )


def suggest_buildings(operator, context, text):
    """Ids of a city's buildings, each with its address and name, that have all words of a text in
    them, without regard to accents and case; for a property's search: list of tuple of str.
    """
    city = find_city(context.scene)[0] or {}
    told, words = read_told(city), _fold_text(text).split()
    named = [(name, told.get(name, "")) for name in city.get(Key.BUILDINGS, ())]
    return [one for one in named if all(word in _fold_text(" ".join(one)) for word in words)]


def _fold_text(text):
    """A text as it is compared, without accents and case: Große is grosse."""
    signs = unicodedata.normalize("NFKD", text.casefold())
    return "".join(sign for sign in signs if not unicodedata.combining(sign))


def read_told(city, most=None):
    """Address and name of buildings, as far as files tell them, once there is energy; at most so
    many, with the most energy: dict of id to str.
    """
    rows = (row.split("|") for row in list(city.get(Key.TOLD, ()))[:most])
    return {name: " · ".join(filter(None, told)) for name, *told in rows}


def read_vertices(item):
    """Read the vertices of an object in world coordinates: (v, 3) float64 [m]."""
    matrix = np.array(item.matrix_world, dtype=np.float64)
    return read_array(item.data.vertices, "co", 3) @ matrix[:3, :3].T + matrix[:3, 3]
