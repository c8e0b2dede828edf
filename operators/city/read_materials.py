"""Convert Blender materials to MaterialSpec: by the user's choice, by name, or by shader."""

import bpy
import numpy as np
from mathutils import Color

from ...core.city.city import whole_of_cell
from ...core.patches.materials import EXAMPLES, MaterialSpec
from ...core.settings.errors import InputError
from .attributes import read_array, read_face_attribute
from .keys import Key

# type of node -> names of its inputs for colour, metallic, roughness, transmission; or their value
NODES = {
    "BSDF_PRINCIPLED": ("Base Color", "Metallic", "Roughness", "Transmission Weight"),
    "BSDF_DIFFUSE": ("Color", 0.0, 1.0, 0.0),
    "BSDF_GLOSSY": ("Color", 1.0, "Roughness", 0.0),
    "BSDF_GLASS": ("Color", 0.0, "Roughness", 1.0),
}


def name_face_materials(item, mesh):
    """Name of the material of each face: list of (f,) str, "" if it has none, or CityPV's result
    colours.

    Parameters
    ----------
    item : bpy.types.Object
        Its slots may overrule the mesh's own.
    mesh : bpy.types.Mesh
    """
    slots = list(mesh.materials)
    for place, slot in enumerate(item.material_slots[: len(slots)]):
        if slot.link == "OBJECT":
            slots[place] = slot.material
    names = ["" if slot is None or slot.get(Key.PART) else slot.name_full for slot in slots]
    if not any(names):
        return [""] * len(mesh.polygons)
    chosen = read_array(mesh.polygons, "material_index", dtype=np.int32)
    return [names[place] for place in np.clip(chosen, 0, len(names) - 1).tolist()]


def remember_materials(item, ground, session):
    """Store the materials that the user assigned to faces, before result colours replace them.

    A surface has the material of the largest of its faces that have one; the generated ground has
    one for all.

    Parameters
    ----------
    item, ground : bpy.types.Object
        The city and its ground, not in edit mode; the ground may be None.
    session : Session
        It learns the names, and so do its city and its scene.

    Raises
    ------
    InputError
        The ground has several materials, or faces of the city do not match its surfaces.
    """
    # The ground has one material for all of its faces.
    of_ground = set(name_face_materials(ground, ground.data)) - {""} if ground is not None else ()
    if len(of_ground) > 1:
        raise InputError(
            ground.name,
            f"it has {len(of_ground)} materials",
            "assign one material to all of its faces",
        )
    session.ground_material = next(iter(of_ground), session.ground_material)
    # From the smallest face to the largest, so that on each surface the largest one with a material
    # counts.
    names, surface = name_face_materials(item, item.data), read_face_attribute(item.data, "surface")
    scene, city = session.scene, session.city
    ids = city.surface_id if scene is None else scene.surfaces.surface_id
    # Without materials on faces there is nothing more to store.
    if surface is None or not any(names):
        return
    order = np.argsort(read_array(item.data.polygons, "area"), kind="stable").tolist()
    given = {int(surface[face]): names[face] for face in order if names[face]}
    # Into city and scene, by the name of the surface or of the one that it is a cell of.
    rows = {name: row for row, name in enumerate(city.surface_id)}
    for holder in filter(None, (city, scene and scene.surfaces)):
        holder.material = holder.material or [""] * len(holder)
    for place, name in given.items():
        if not 0 <= place < len(ids):
            raise InputError(
                item.name, "its faces do not match its surfaces", "import the city again"
            )
        city.material[
            rows[ids[place]] if ids[place] in rows else rows[whole_of_cell(ids[place])]
        ] = name
        if scene is not None:
            scene.surfaces.material[place] = name


def read_finishes(names, colours):
    """Read materials by name: from Blender, and from the city's files where Blender does not have
    them.

    Parameters
    ----------
    names : list of str
        With "" for surfaces that have none.
    colours : dict
        Name of a material of the files to its colour, or None; as a Scene has them.

    Returns
    -------
    finishes : dict of str to MaterialSpec
    unread : list of str
        Names of those that tell no albedo.

    Raises
    ------
    InputError
        There are no materials, or one was removed.
    """
    known, finishes = {material.name_full: material for material in bpy.data.materials}, {}
    wanted = sorted(set(names) - {""})
    if not wanted:
        raise InputError(
            "Materials",
            "no face has a material",
            "assign materials, or set Albedo from to One value",
        )
    for name in wanted:
        if name not in known and name not in colours:
            raise InputError(
                "Materials",
                f"{name!r} was removed or renamed",
                "take the meshes again, or give its faces another",
            )
        finishes[name] = (
            read_finish(known[name]) if name in known else MaterialSpec.of_name(name, colours[name])
        )
    unread = [name for name in wanted if finishes[name] is None]
    return {name: finish for name, finish in finishes.items() if finish is not None}, unread


def read_finish(material):
    """Reflection of a material: a MaterialSpec, or None if it cannot be determined.

    The user's choice counts before the name, and that before the shader.
    """
    # From 5.0 on, Blender stores declared properties separately from custom properties of a file.
    choice = str(getattr(material, Key.MATERIAL, "") or material.get(Key.MATERIAL, "")).strip()
    return MaterialSpec.of_choice(choice, material.name, *_read_shader(material))


def _read_shader(material):
    """Read colour (linear Rec. 709), metallic, roughness and transmission of a material's shader.

    Returns
    -------
    tuple of (3,) float, float, float, float
        None for each that a texture or another node tells.
    """
    tree = material.node_tree
    if tree is None or (bpy.app.version < (5, 0) and not material.use_nodes):
        inputs = [material.diffuse_color, material.metallic, material.roughness, 0.0]
    else:
        output = tree.get_output_node("ALL")
        links = output.inputs["Surface"].links if output is not None else ()
        node = links[0].from_node if links else None
        parts = NODES.get(node.type, ()) if node is not None else ()
        inputs = [node.inputs[part] if isinstance(part, str) else part for part in parts]
        inputs = [
            given if isinstance(given, float) else None if given.is_linked else given.default_value
            for given in inputs
        ]
    colour, *rest = inputs or (None,) * 4
    if colour is not None:
        colour = tuple(Color(tuple(colour)[:3]).from_scene_linear_to_rec709_linear())
    return colour, *rest


def describe_material(material):
    """Description of a material's reflection for the panel."""
    try:
        finish = read_finish(material)
        return (
            finish.describe()
            if finish
            else "One value: a texture, another node or another shader defines its colour"
        )
    except InputError as error:
        return f"{error.source}: {error.problem}"


REFLECTION = bpy.props.StringProperty(  # of a material
    name="Reflects as",
    description=(
        "A known material, mirror or glossy:ROUGHNESS; empty: from its name, else from its shader"
    ),
    search=lambda self, context, text: [word for word in EXAMPLES if text.lower() in word],
    search_options={"SUGGESTION"},
)


class MaterialPanel(bpy.types.Panel):
    """Reflection of a material."""

    bl_idname, bl_label = "CITYPV_PT_material", "CityPV"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "material"

    @classmethod
    def poll(cls, context):
        """There is a material."""
        return context.material is not None

    def draw(self, context):
        """Show the user's choice, and the resulting reflection."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        self.layout.prop(context.material, "citypv_material")
        self.layout.label(text=describe_material(context.material))
