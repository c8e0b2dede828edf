"""Show the colours of a city on the objects of the user that it was taken from, without changing
their materials.

Where an object shows the faces of its mesh as they are, the mesh gets the results as face
attributes, and the colour attribute `citypv_colour`. Other objects (meshes that several objects
share, modifiers that make faces, instances, faces split into cells) have no place for results of
each face: while colours are shown, they are drawn as lines, and can be moved as before, and are
left out of pictures; the city's own object shows their faces in both.
"""

import bpy
import numpy as np

from ..city import attributes, source_objects
from ..city.attributes import PREFIX, read_face_attribute
from ..city.keys import Key
from ..city.source_objects import SOURCE, list_taken
from .colour_faces import MATERIAL, write_colours


def colour_user_meshes(city, *, shown=3):
    """Show the colours of a city on the objects that it was taken from; the panel names those that
    a copy covers.
    """
    # Which faces of the city the user's objects show themselves.
    own, names, surface = (
        np.zeros(len(city.data.polygons), bool),
        [],
        attributes.read_face_attribute(city.data, "surface"),
    )
    values, colours = _read_results(city.data)
    # An object of one mesh that has all faces of its surfaces wears the colours; others are
    # outlines around the copy.
    for item, building, triangles, faces in list_worn(city):
        whole = len(faces) and len(np.unique(faces)) == len(np.unique(surface[triangles]))
        if (
            building
            and source_objects.is_single(item.data)
            and whole
            and faces.max() < len(item.data.polygons)
        ):
            _write_on_mesh(item.data, triangles, faces, values, colours)
            _show_in_pictures(item)
            own[triangles] = True
        elif item.get("tree") is None:
            names.append(item.name)
            # How the object was drawn before is kept; trees stay as they are.
            if Key.DRAWN_AS not in item:
                item[Key.DRAWN_AS], item.display_type = item.display_type, "WIRE"
                item[Key.LEFT_OUT], item.hide_render = item.hide_render, True
    # The copy, which is the city's own mesh, shows all other faces, or is hidden if none is left.
    _mask_faces(city, own)
    if source_objects.is_in_place(city):
        city.hide_render = bool(own.all())
        city.hide_set(city.hide_render)
    some = ", ".join(names[:shown]) + (" …" if len(names) > shown else "")
    reason = (
        "lines around a coloured copy, as instances, shared meshes, modifiers or cells have no "
        "faces of their own"
    )
    city[Key.WORN], city[Key.STAND_INS] = True, f"{some}: {reason}" if names else ""


def uncolour_user_meshes(city):
    """Show the objects of the user as they were; the results stay on their faces."""
    for _, item, _ in source_objects.list_taken(city):
        draw_as_before(item)
        if item.type != "MESH":
            continue
        if WORN_COLOURS in item.modifiers:
            item.modifiers.remove(item.modifiers[WORN_COLOURS])
        colours = item.data.color_attributes
        if Key.COLOUR in colours:
            colours.remove(colours[Key.COLOUR])
        if Key.ACTIVE_COLOUR in item.data:
            colours.active_color_name = item.data[Key.ACTIVE_COLOUR]
            del item.data[Key.ACTIVE_COLOUR]
        item.data.update()
    if source_objects.is_in_place(city):
        city.hide_set(True)
        city.hide_render = True
    city[Key.WORN], city[Key.STAND_INS] = False, ""


def draw_as_before(item):
    """Draw an object as before a coloured copy stood for it, where one does."""
    if Key.DRAWN_AS in item:
        item.display_type = item.pop(Key.DRAWN_AS)
        item.hide_render = bool(item.pop(Key.LEFT_OUT, item.hide_render))


def _show_in_pictures(item):
    """Let a modifier give an object the material of the colours: Cycles and Eevee draw materials
    only.
    """
    if MATERIAL not in bpy.data.materials or WORN_COLOURS in item.modifiers:
        return
    group = bpy.data.node_groups.get(WORN_COLOURS)
    if group is None:
        group = bpy.data.node_groups.new(WORN_COLOURS, "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        start, paint, end = map(
            group.nodes.new, ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput")
        )
        paint.inputs["Material"].default_value = bpy.data.materials[MATERIAL]
        group.links.new(start.outputs["Geometry"], paint.inputs["Geometry"])
        group.links.new(paint.outputs["Geometry"], end.inputs["Geometry"])
    item.modifiers.new(WORN_COLOURS, "NODES").node_group = group


def _read_results(mesh):
    """Results of the faces of a city: dict of name to (f,) array, (f, 3) colours in 0–1 or None."""
    names = [
        attribute.name.removeprefix(PREFIX)
        for attribute in mesh.attributes
        if attribute.name.startswith(PREFIX) and attribute.domain == "FACE"
    ]
    values = {name: attributes.read_face_attribute(mesh, name) for name in names}
    given = mesh.color_attributes.get(Key.COLOUR)
    if given is None:
        return values, None
    # The city's faces are triangles.
    return values, attributes.read_array(given.data, "color_srgb", 4)[::3, :3]


def _write_on_mesh(mesh, triangles, faces, values, colours):
    """Write the results of a city's triangles to the faces of a mesh, and their colours.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    triangles : (k,) int
        Faces of the city.
    faces : (k,) int
        Faces of the mesh that they are parts of, each of one surface.
    values, colours
        Of the city, of `_read_results`.
    """
    part = np.full(len(mesh.polygons), -1)  # any triangle of each face, -1 without one
    part[faces] = triangles
    for name, of_city in values.items():
        missing = -1 if of_city.dtype.kind == "i" else np.nan
        attributes.write_face_attribute(mesh, name, np.where(part < 0, missing, of_city[part]))
    if colours is not None:
        if Key.COLOUR not in mesh.color_attributes:
            mesh[Key.ACTIVE_COLOUR] = mesh.color_attributes.active_color_name
        write_colours(mesh, np.where(part[:, None] < 0, 0.6, colours[part]))
    mesh.update()


def _mask_faces(city, own):
    """Let objects show these faces of a city, (f,) bool, in its place."""
    mesh = city.data
    inside = np.zeros(len(mesh.vertices), bool)
    corners, total = (
        attributes.read_corners(mesh),
        attributes.read_array(mesh.polygons, "loop_total", dtype=np.int32),
    )
    of_own = np.repeat(own, total)
    inside[corners[of_own]] = True
    inside[corners[~of_own]] = False
    group = city.vertex_groups.get(MASK) or city.vertex_groups.new(name=MASK)
    group.remove(list(range(len(inside))))
    group.add(np.flatnonzero(inside).tolist(), 1.0, "REPLACE")
    mask = city.modifiers.get(MASK)
    if mask is None:
        mask = city.modifiers.new(MASK, "MASK")
        mask.vertex_group, mask.invert_vertex_group = MASK, True
    mask.show_viewport = mask.show_render = bool(inside.any())


def list_worn(city):
    """Which faces of a city objects show: list of (object, building, (k,) int of the city, (k,) int
    of the object).
    """
    numbers, shown = (read_face_attribute(city.data, name) for name in SOURCE)
    order, worn = np.argsort(numbers, kind="stable"), []
    for number, item, building in list_taken(city):
        first, end = np.searchsorted(numbers, [number, number + 1], sorter=order)
        faces = order[first:end]
        worn.append((item, building, faces, shown[faces]))
    return worn


MASK = "CityPV mask"  # modifier and vertex group of a city: faces that objects show


WORN_COLOURS = "CityPV colours"  # modifier of such an object: shows them in pictures


def own_modifiers(item):
    """Modifiers that the user gave to an object: list of bpy.types.Modifier."""
    return [modifier for modifier in item.modifiers if modifier.name not in (MASK, WORN_COLOURS)]
