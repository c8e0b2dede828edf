"""Colours of the faces: the scale of an attribute with the ticks of its legend, and materials that
show it exactly.
"""

import bpy
import numpy as np

from ...core.results.colour_map import GROUND, ColourScale, choose_range, linear_light, srgb_colour
from ...core.settings.errors import InputError
from ..city.attributes import (
    CHANGE,
    CHANGE_ERROR,
    CODES,
    RESULTS,
    read_array,
    read_face_attribute,
)
from ..city.keys import Key

MATERIAL = "CityPV colours"
# One colour per code, safe for colour-blind viewers: M. Okabe and K. Ito (2008).
CLASS_COLOURS = {
    "kind": {
        "facade": "e69f00",
        "roof": "0072b2",
        "flat": "56b4e9",
        "steep": "cc79a7",
        "downward": "5a5a5a",
        "ground": "b4b4b0",
        "rack": "f0e442",
    },
    "orientation": {
        "none": "b4b4b0",
        "north": "0072b2",
        "east": "009e73",
        "south": "d55e00",
        "west": "cc79a7",
        "northeast": "56b4e9",
        "southeast": "f0e442",
        "southwest": "e69f00",
        "northwest": "000000",
    },
}

TITLES = {"kind": "Kind of surface", "orientation": "Orientation"} | {
    q.name: q.title for q in RESULTS.values()
}


def build_scale(attribute, low=0.0, high=1.0, colour_map="viridis"):
    """Build the scale of an attribute.

    Parameters
    ----------
    attribute : str
        A name of `RESULTS`, or "kind" or "orientation", which have a colour for each code.
    low, high : float
        Values at the two ends, in the attribute's unit; not used for codes.
    colour_map : str
        A name of `MAPS`; differences have a map of their own.

    Returns
    -------
    core.results.colour_map.ColourScale
    """
    if attribute in CODES:
        names = sorted(CODES[attribute], key=CODES[attribute].get)
        colours = {name: CLASS_COLOURS[attribute][name] for name in names}
        return ColourScale.of_classes(attribute, TITLES[attribute], colours)
    colour_map = "" if attribute.startswith(CHANGE) else colour_map
    unit = RESULTS[attribute].legend_unit
    return ColourScale.of_map(attribute, TITLES[attribute], unit, (low, high), colour_map)


def linear_colour(text):
    """Colour written as six hexadecimal digits (sRGB) → (r, g, b, 1) in linear light, as Blender's
    nodes want it.
    """
    return (*linear_light(srgb_colour(text)).tolist(), 1.0)


def colour_faces(city, ground, attribute, ends=None, colour_map="viridis"):
    """Colour the city by a face attribute; faces without result and the generated ground stay grey.

    The colours agree with the legend exactly: the colour attribute `citypv_colour`, which the
    viewport's solid mode shows as it is, and a material as emission.

    Parameters
    ----------
    city, ground : bpy.types.Object or None
        Objects as `build_meshes` makes them; the ground may be None.
    attribute : str
        Name without prefix.
    ends : tuple of two float, optional
        Of the scale; by default those stored on the city, else they come from the values
        (`choose_range`). For a difference zero is in the middle.
    colour_map : str
        A name of `MAPS`.

    Returns
    -------
    ColourScale
        As it is stored on the city, too, for the legend.

    Raises
    ------
    InputError
        The faces have no such values yet.
    """
    # Values, and the limits of their scale: as asked for, as before, or from the values.
    values = read_face_attribute(city.data, attribute)
    if values is None:
        raise InputError(
            city.name,
            f"its faces have no {TITLES[attribute].lower()} yet",
            "run the step that computes it",
        )
    areas = read_array(city.data.polygons, "area")
    ends = ends or city.get(Key.RANGE + attribute)
    # A change has zero in the middle of its scale.
    if attribute.startswith(CHANGE):
        errors = (
            read_face_attribute(city.data, CHANGE_ERROR)
            if attribute == CHANGE + "full_load_hours"
            else None
        )
        # A change of hours below two of its standard errors is grey; no change at all is no noise.
        if errors is not None:
            values = np.where((values != 0) & (np.abs(values) < 2 * errors), np.nan, values)
        changed = np.nan_to_num(values) != 0
        if ends is None and changed.any():
            ends = choose_range(
                np.concatenate([values[changed], -values[changed]]), np.tile(areas[changed], 2)
            )
        half = max(map(abs, ends or (1.0,)))
        ends = -half, half
    elif attribute not in CODES and ends is None:
        ends = choose_range(values, areas)
    # Colours of faces, and the scale that the legend shows.
    scale = build_scale(attribute, *(ends or ()), colour_map=colour_map)
    paint_mesh(city.data, values, scale)
    city[Key.COLOUR_ATTRIBUTE], city[Key.COLOUR_LOW], city[Key.COLOUR_HIGH] = (
        scale.name,
        scale.low,
        scale.high,
    )
    city[Key.COLOUR_MAP] = colour_map
    if ground is not None:
        # Neutral grey with ambient occlusion, so that narrow streets and courtyards appear darker.
        nodes, links, colour = start_emission("CityPV ground", ground.data)
        occlusion = nodes.new("ShaderNodeAmbientOcclusion")
        occlusion.samples, occlusion.inputs["Distance"].default_value = 4, 25.0
        occlusion.inputs["Color"].default_value = linear_colour(GROUND)
        links.new(occlusion.outputs["Color"], colour)
        write_colours(ground.data, np.tile(srgb_colour(GROUND), (len(ground.data.polygons), 1)))
    return scale


def paint_mesh(mesh, values, scale):
    """Give the faces of a mesh the colours of their values, (f,), as they are in any light; grey
    without a value.
    """
    nodes, links, colour = start_emission(MATERIAL, mesh)
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_type, attribute.attribute_name = "GEOMETRY", Key.COLOUR
    links.new(attribute.outputs["Color"], colour)
    write_colours(mesh, scale.colours(values))


def read_scale(city):
    """Read the scale that an object was coloured with, or None."""
    attribute = city.get(Key.COLOUR_ATTRIBUTE)
    if attribute is None:
        return None
    low, high = city[Key.COLOUR_LOW], city[Key.COLOUR_HIGH]
    return build_scale(attribute, low, high, city[Key.COLOUR_MAP])


def show_exact_colours(scene):
    """Set the scene's view transform to Standard: all others distort the colour scale."""
    view = scene.view_settings
    view.view_transform, view.look, view.exposure, view.gamma = "Standard", "None", 0.0, 1.0


def start_nodes(owner, output):
    """Nodes of a material or a world, cleared but for an output of this type: nodes, links, the
    output.
    """
    if owner.node_tree is None:
        owner.use_nodes = True
    nodes = owner.node_tree.nodes
    nodes.clear()
    return nodes, owner.node_tree.links, nodes.new(output)


def start_emission(name, mesh=None):
    """Emission material that all faces of a mesh show, where one is given: its nodes, links and the
    colour's input.
    """
    material = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    material[Key.PART] = "colours"  # not a building material
    nodes, links, output = start_nodes(material, "ShaderNodeOutputMaterial")
    emission = nodes.new("ShaderNodeEmission")
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    output.location = (220, 0)
    if mesh is not None:
        mesh.materials.clear()
        mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    return nodes, links, emission.inputs["Color"]


def write_colours(mesh, colours):
    """Write colours of faces, (f, 3) sRGB in 0–1, as one per corner, which solid view and materials
    show.
    """
    attribute = mesh.color_attributes.get(Key.COLOUR)
    if attribute is None:
        attribute = mesh.color_attributes.new(Key.COLOUR, "BYTE_COLOR", "CORNER")
    corners = read_array(mesh.polygons, "loop_total", dtype=np.int32)
    rgba = np.insert(np.repeat(colours, corners, axis=0), 3, 1.0, axis=1).astype(np.float32)
    attribute.data.foreach_set("color_srgb", rgba.ravel())
    mesh.color_attributes.active_color = attribute
    mesh.update()
