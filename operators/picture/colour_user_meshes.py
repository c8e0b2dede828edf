"""Show the colours of a city on the objects of the user that it was taken from, without changing their materials.

Where the faces of an object are those of its mesh, the mesh gets the results as face attributes, and the colour
attribute `citypv_colour`. Other objects (meshes that several objects share, modifiers that make faces, instances) have
no place for results of each face: while colours are shown, they are hidden, and the city's faces stand in for them.
"""

import bmesh
import bpy
import numpy as np

from ..attributes import PREFIX, read_face_attribute, write_face_attribute
from ..in_place import FACE, OBJECT, STAND_IN, is_in_place, list_taken

COLOUR = PREFIX + "colour"
BEFORE = PREFIX + "active_colour"  # of a mesh: the colour attribute that the user had chosen
HIDDEN = PREFIX + "hidden"  # of an object that a stand-in stands for
WORN = PREFIX + "worn"  # of a city: its colours are shown
FEW = 3  # names shown


def wear_colours(city):
    """Show the colours of a city on the objects that it was taken from.

    Returns
    -------
    list of str
        Names of the objects that a stand-in is shown for.
    """
    sources = read_face_attribute(city.data, OBJECT), read_face_attribute(city.data, FACE)
    own = np.zeros(len(city.data.polygons), bool)
    others = []
    for number, item, building in list_taken(city):
        faces = np.flatnonzero(sources[0] == number)
        if building and len(faces) and fits(item, sources[1][faces]):
            wear_on_mesh(city, item.data, faces, sources[1][faces])
            own[faces] = True
        elif item.get("tree") is None:
            others.append(item)
    remove_stand_in(city)
    if not own.all():
        add_stand_in(city, own)
    for item in others:
        if not item.hide_get():
            item[HIDDEN] = True
            item.hide_set(True)
    city[WORN] = True
    return [item.name for item in others]


def take_off_colours(city):
    """Show the objects of the user as they were; the results stay on their faces."""
    for _, item, _ in list_taken(city):
        if item.get(HIDDEN):
            del item[HIDDEN]
            item.hide_set(False)
        if item.type == "MESH":
            _drop_colour(item.data)
    remove_stand_in(city)
    city[WORN] = False


def wears_colours(city):
    """Whether the colours of a city taken from meshes are shown."""
    return is_in_place(city) and bool(city.get(WORN))


def fits(item, faces):
    """Whether the mesh of an object still is its own, with the faces that were taken."""
    mesh = item.data
    return mesh.users - mesh.use_fake_user == 1 and faces.max() < len(mesh.polygons)


def wear_on_mesh(city, mesh, triangles, faces):
    """Write the results of a city's triangles to the faces of a mesh, and their colours.

    Faces of several surfaces (cells of a grid) get means by area; codes, the one of the largest triangle.

    Parameters
    ----------
    city : bpy.types.Object
    mesh : bpy.types.Mesh
    triangles : (k,) int
        Faces of the city.
    faces : (k,) int
        Faces of the mesh that they are parts of.
    """
    area = np.empty(len(city.data.polygons), np.float32)
    city.data.polygons.foreach_get("area", area)
    largest = np.full(len(mesh.polygons), -1)
    order = np.argsort(area[triangles], kind="stable")
    largest[faces[order]] = triangles[order]
    weight = np.maximum(area[triangles].astype(float), 1e-12)
    total = np.bincount(faces, weight, len(mesh.polygons))
    for attribute in list(city.data.attributes):
        if not attribute.name.startswith(PREFIX) or attribute.domain != "FACE":
            continue
        name = attribute.name.removeprefix(PREFIX)
        values = read_face_attribute(city.data, name)
        if attribute.data_type == "INT":
            write_face_attribute(mesh, name, np.where(largest < 0, -1, values[largest]))
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.bincount(faces, weight * values[triangles], len(mesh.polygons)) / total
        write_face_attribute(mesh, name, mean)
    _wear_colour(city.data, mesh, triangles, faces, (weight, total))
    mesh.update()


def remove_stand_in(city):
    """Remove the object that stands in for those without faces of their own, if there is one."""
    item = city.get(STAND_IN)
    if item is None:
        return
    del city[STAND_IN]
    mesh = item.data
    bpy.data.objects.remove(item)
    bpy.data.meshes.remove(mesh)


def add_stand_in(city, own):
    """Show the faces of a city that are on no mesh of the user.

    Parameters
    ----------
    city : bpy.types.Object
    own : (f,) bool
        Faces that are on one.
    """
    mesh = city.data.copy()
    shape = bmesh.new()
    shape.from_mesh(mesh)
    shape.faces.ensure_lookup_table()
    bmesh.ops.delete(shape, geom=[shape.faces[k] for k in np.flatnonzero(own).tolist()], context="FACES")
    shape.to_mesh(mesh)
    shape.free()
    item = bpy.data.objects.new(f"{city.name} stand-in", mesh)
    mesh.name = item.name
    item[PREFIX + "part"] = "stand_in"
    item.matrix_world = city.matrix_world
    item.location, item.scale = city.location, city.scale
    city.users_collection[0].objects.link(item)
    city[STAND_IN] = item


def describe_stand_ins(names):
    """What the user is told of objects that a stand-in is shown for; "" if there are none."""
    if not names:
        return ""
    some = ", ".join(names[:FEW]) + (" …" if len(names) > FEW else "")
    return f"{some}: hidden behind a coloured copy, as instances, shared meshes or modifiers have no faces of their own"


def _wear_colour(source, mesh, triangles, faces, weights):
    # Colours are those of the city's triangles; a face of several cells has their mean.
    given = source.color_attributes.get(COLOUR)
    if given is None:
        return
    corner = np.empty(4 * len(source.loops), np.float32)
    given.data.foreach_get("color_srgb", corner)
    colour = corner.reshape(-1, 3, 4)[triangles, 0, :3]  # the city's faces are triangles
    weight, total = weights
    mean = np.ones((len(mesh.polygons), 4), np.float32)
    for channel in range(3):
        summed = np.bincount(faces, weight * colour[:, channel], len(mesh.polygons))
        mean[:, channel] = np.where(total > 0, summed / np.maximum(total, 1e-12), 0.6)
    attribute = mesh.color_attributes.get(COLOUR)
    if attribute is None:
        mesh[BEFORE] = mesh.color_attributes.active_color_name
        attribute = mesh.color_attributes.new(COLOUR, "BYTE_COLOR", "CORNER")
    corners = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", corners)
    attribute.data.foreach_set("color_srgb", np.repeat(mean, corners, axis=0).ravel())
    mesh.color_attributes.active_color = mesh.color_attributes[COLOUR]


def _drop_colour(mesh):
    attribute = mesh.color_attributes.get(COLOUR)
    if attribute is not None:
        mesh.color_attributes.remove(attribute)
    if BEFORE in mesh:
        mesh.color_attributes.active_color_name = mesh[BEFORE]
        del mesh[BEFORE]
    mesh.update()
