"""The modules of the city that is seen, as one object of instances before its faces."""

import bpy
import numpy as np

from ..city.attributes import PREFIX, write_face_attribute
from ..city.build_meshes import remove_objects, show_objects
from ..city.keys import Key
from ..city.session import Session, find_city
from .colour_faces import linear_colour, start_emission, write_colours

MODULES = "modules"  # part of the object; its one shape is of the same part
_shown = {}  # session_uid of the object -> the ModuleLayout that it shows


def follow_modules(settings, context):
    """Show the modules, or remove them (`update` of the property)."""
    show_modules(context)


def show_modules(context):
    """Show the modules of the city that is seen, where they are known and asked for; else remove
    the modules of another.
    """
    city, _ = find_city(context.scene)
    session = Session.of(city)
    wanted = context.scene.citypv.show_modules
    if wanted and session is None:  # of a file that was opened, which has them as they were
        return
    layout = getattr(getattr(session, "energy", None), "layout", None)
    wanted = wanted and layout is not None and len(layout) > 0
    known = find_modules(context.scene)
    shown = [_shown.get(item.session_uid) for item in known if item.parent == city]
    if wanted and len(known) == 1 and shown and shown[0] is layout:
        return
    remove_objects(*known)
    if wanted:
        item = _build_object(layout)
        item.parent = city
        show_objects(context.scene, item)
        _shown.clear()
        _shown[item.session_uid] = layout


def find_modules(stage):
    """Objects of modules in a Blender scene: list."""
    return [item for item in stage.objects if item.get(Key.PART) == MODULES]


def _build_object(layout):
    """A point in the middle of each module, on which geometry nodes set the shape of a module:
    bpy.types.Object.
    """
    corners = layout.corners()
    mesh = bpy.data.meshes.new("Modules")
    mesh.vertices.add(len(layout))
    mesh.vertices.foreach_set("co", corners.mean(axis=1).astype(np.float32).ravel())
    # Edges of each, and what turns a level one to where it lies: about x, y, then z [rad].
    along, up = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    length, height = (np.linalg.norm(edge, axis=1, keepdims=True) for edge in (along, up))
    x, y = along / length, up / height
    z = np.cross(x, y)
    turn = [np.arctan2(y[:, 2], z[:, 2]), -np.arcsin(x[:, 2]), np.arctan2(x[:, 1], x[:, 0])]
    size = np.column_stack([length, height, np.ones(len(layout))])
    for name, values in (("turn", np.column_stack(turn)), ("size", size)):
        attribute = mesh.attributes.new(PREFIX + name, "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", values.astype(np.float32).ravel())
    attribute = mesh.attributes.new(PREFIX + "surface", "INT", "POINT")
    attribute.data.foreach_set("value", layout.surface.astype(np.int32))
    item = bpy.data.objects.new("Modules", mesh)
    item[Key.PART], item.hide_select = MODULES, True
    item.modifiers.new("CityPV modules", "NODES").node_group = _group_nodes(_build_shape())
    return item


def _build_shape():
    """A square of 1 m, dark in any light: bpy.types.Object, which no scene shows."""
    name = "CityPV module"
    if name in bpy.data.objects:
        return bpy.data.objects[name]
    mesh = bpy.data.meshes.new(name)
    square = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)]
    mesh.from_pydata(square, [], [(0, 1, 2, 3)])
    write_face_attribute(mesh, "surface", np.array([-1], np.int32))
    from ...core.results.colour_map import MODULES as COLOUR
    from ...core.results.colour_map import srgb_colour

    start_emission(name, mesh)[2].default_value = linear_colour(COLOUR)
    write_colours(mesh, srgb_colour(COLOUR)[None])
    item = bpy.data.objects.new(name, mesh)
    item[Key.PART] = MODULES
    return item


def _group_nodes(shape):
    """Geometry nodes that set a shape on points, turned and sized by their attributes:
    bpy.types.NodeTree.
    """
    name = "CityPV modules"
    if name in bpy.data.node_groups:
        return bpy.data.node_groups[name]
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = (tree.nodes.new(f"NodeGroup{way}") for way in ("Input", "Output"))
    set_shape = tree.nodes.new("GeometryNodeInstanceOnPoints")
    of_shape = tree.nodes.new("GeometryNodeObjectInfo")
    of_shape.inputs["Object"].default_value = shape
    for name, socket in (("turn", "Rotation"), ("size", "Scale")):
        read = tree.nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type, read.inputs["Name"].default_value = "FLOAT_VECTOR", PREFIX + name
        tree.links.new(read.outputs["Attribute"], set_shape.inputs[socket])
    tree.links.new(start.outputs[0], set_shape.inputs["Points"])
    tree.links.new(of_shape.outputs["Geometry"], set_shape.inputs["Instance"])
    tree.links.new(set_shape.outputs[0], end.inputs[0])
    return tree
