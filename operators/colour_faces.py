"""Colour faces by an attribute: material, faces without result, ground, and colours for solid view."""

import bpy
import numpy as np

from ..core.results.colour_map import GROUND, MISSING, choose_range, linear_light, srgb_colour
from ..core.settings.errors import InputError
from .attributes import CHANGE, CODES, PREFIX, TITLES
from .colour_scale import build_scale, colours_of_values, linear_colour
from .write_attributes import read_face_attribute

MATERIAL = "CityPV colours"
COLOUR_ATTRIBUTE = PREFIX + "colour"
RANGE = PREFIX + "range_"  # + attribute: property of a city with the ends of its scale, where they are not the values'


def colour_faces(city, ground, attribute, *, low=None, high=None, colour_map="viridis"):
    """Colour the city by a face attribute; faces without result and the generated ground stay grey.

    The colours are those of the legend exactly: Attribute → Map Range → Color Ramp → Emission. The colour attribute
    `citypv_colour` shows the same in the viewport's solid mode.

    Parameters
    ----------
    city, ground : bpy.types.Object or None
        Objects as `build_meshes` makes them; the ground may be None.
    attribute : str
        Name without prefix.
    low, high : float, optional
        Ends of the scale; where missing, they come from the values (`choose_range`).
    colour_map : str
        A name of `colour_scale.MAPS`.

    Returns
    -------
    ColourScale
    """
    values = read_face_attribute(city.data, attribute)
    if values is None:
        raise InputError(
            city.name, f"its faces have no {TITLES[attribute].lower()} yet", "run the step that computes it"
        )
    scale = build_scale(attribute, *_range_of(city, values, attribute, low, high), colour_map)
    missing = ~np.isfinite(values.astype(np.float64))
    _set_materials(city.data, [build_colour_material(scale), build_plain_material("CityPV missing", MISSING)], missing)
    write_colours(city.data, colours_of_values(scale, values))
    for key in ("attribute", "low", "high"):
        city[f"{PREFIX}colour_{key}"] = getattr(scale, key)
    city[PREFIX + "colour_map"] = colour_map
    if ground is not None:
        _set_materials(ground.data, [build_ground_material()], np.zeros(len(ground.data.polygons), dtype=bool))
        write_colours(ground.data, np.tile(srgb_colour(GROUND), (len(ground.data.polygons), 1)))
    return scale


def read_scale(city):
    """Read the scale that an object was coloured with, or None."""
    attribute = city.get(PREFIX + "colour_attribute")
    if attribute is None:
        return None
    low, high = city[PREFIX + "colour_low"], city[PREFIX + "colour_high"]
    return build_scale(attribute, low, high, city[PREFIX + "colour_map"])


def show_exact_colours(scene):
    """Set the scene's view transform to Standard: all others distort the colour scale."""
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = 0.0
    scene.view_settings.gamma = 1.0


def build_colour_material(scale, name=MATERIAL):
    """Emission material that shows an attribute in the colours of its scale, independent of lighting."""
    nodes, links, output = _empty_material(name)
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_type, attribute.attribute_name = "GEOMETRY", PREFIX + scale.attribute
    map_range = nodes.new("ShaderNodeMapRange")
    map_range.clamp = True
    map_range.inputs["From Min"].default_value = scale.low
    map_range.inputs["From Max"].default_value = scale.high
    ramp = nodes.new("ShaderNodeValToRGB")
    _set_stops(ramp.color_ramp, scale)
    emission = nodes.new("ShaderNodeEmission")
    links.new(attribute.outputs["Fac"], map_range.inputs["Value"])
    links.new(map_range.outputs["Result"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    for place, node in enumerate((attribute, map_range, ramp, emission, output)):
        node.location = (220 * place, 0)
    return bpy.data.materials[name]


def build_plain_material(name, colour):
    """Emission material of one colour (six hexadecimal digits, sRGB)."""
    nodes, links, output = _empty_material(name)
    emission = nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = linear_colour(colour)
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return bpy.data.materials[name]


def build_ground_material(name="CityPV ground"):
    """Neutral grey with ambient occlusion, so that narrow streets and courtyards appear darker."""
    nodes, links, output = _empty_material(name)
    occlusion = nodes.new("ShaderNodeAmbientOcclusion")
    occlusion.samples, occlusion.inputs["Distance"].default_value = 4, 25.0
    occlusion.inputs["Color"].default_value = linear_colour(GROUND)
    emission = nodes.new("ShaderNodeEmission")
    links.new(occlusion.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return bpy.data.materials[name]


def _range_of(city, values, attribute, low, high):
    if attribute in CODES or (low is not None and high is not None):
        return low, high
    if RANGE + attribute in city and low is None and high is None:
        return tuple(city[RANGE + attribute])
    areas = np.empty(len(city.data.polygons), dtype=np.float32)
    city.data.polygons.foreach_get("area", areas)
    found = choose_range(values, areas)
    if attribute.startswith(CHANGE):  # zero is in the middle
        found = choose_range(np.concatenate([values, -values]), np.tile(areas, 2))
    return tuple(chosen if given is None else given for given, chosen in zip((low, high), found, strict=True))


def _empty_material(name):
    material = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    material[PREFIX + "part"] = "colours"  # not a building material
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    return nodes, material.node_tree.links, nodes.new("ShaderNodeOutputMaterial")


def _set_stops(ramp, scale):
    # A new ramp has two stops; a class starts at its stop, a continuous scale passes through it.
    count = len(scale.stops)
    positions = np.arange(count) / count if scale.classes else np.linspace(0, 1, count)
    ramp.interpolation = "CONSTANT" if scale.classes else "LINEAR"
    while len(ramp.elements) < count:
        ramp.elements.new(1.0)
    for element, position, colour in zip(ramp.elements, positions.tolist(), linear_light(scale.stops), strict=True):
        element.position, element.color = position, (*colour.tolist(), 1.0)


def _set_materials(mesh, materials, second):
    mesh.materials.clear()
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.ascontiguousarray(second, dtype=np.int32))
    mesh.update()


def write_colours(mesh, colours):
    """Write colours of faces, (f, 3) sRGB in 0–1, as one per corner: for solid view, and for other formats."""
    attribute = mesh.color_attributes.get(COLOUR_ATTRIBUTE)
    if attribute is None:
        attribute = mesh.color_attributes.new(COLOUR_ATTRIBUTE, "BYTE_COLOR", "CORNER")
    corners = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", corners)
    rgba = np.ones((len(mesh.loops), 4), dtype=np.float32)
    rgba[:, :3] = np.repeat(colours, corners, axis=0)
    attribute.data.foreach_set("color_srgb", rgba.ravel())
    mesh.color_attributes.active_color = attribute
