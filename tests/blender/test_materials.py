"""What the materials of Blender do to the light: real materials on real meshes, against closed
forms.
"""

import bpy
import pytest
from steps import add_mesh, here, refuse, run, session_here

from citypv.core.patches.materials import MaterialSpec
from citypv.operators.city.read_materials import describe_material, name_face_materials, read_finish
from citypv.operators.show.colour_faces import start_emission
from citypv.operators.show.keep_report import find_row

RED = (0.5, 0.2, 0.1)
SIDE = 2000.0  # [m] of a quarter of the ground


def build_material(name, colour=(0.8, 0.8, 0.8)):
    """A material as the user makes it: with a Principled BSDF."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    find_shader(material).inputs["Base Color"].default_value = (*colour, 1.0)
    return material


def find_shader(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def add_face(name, corners, *materials):
    item = add_mesh(name, corners, [range(4)])
    for material in materials:
        item.data.materials.append(material)
    item.select_set(True)
    return item


def add_wall_and_ground(*materials):
    """A wall of a square metre, ten metres above a plain that reaches to the horizon."""
    add_face("wall", [(0, 0, 10), (1, 0, 10), (1, 0, 11), (0, 0, 11)])
    return add_face(
        "plain",
        [(-SIDE, -SIDE, 0), (SIDE, -SIDE, 0), (SIDE, SIDE, 0), (-SIDE, SIDE, 0)],
        *materials,
    )


def trace(settings, **changes):
    """Take the selected meshes as they stand, trace them; return the session."""
    settings.own_place, settings.latitude, settings.longitude = True, 48.0, 11.0
    settings.ground, settings.patch_size, settings.far_ground = "none", SIDE, False
    settings.days, settings.samples, settings.albedo_source = 1, 1024, "materials"
    for key, value in changes.items():
        setattr(settings, key, value)
    run("take_meshes", "classify", "trace")
    return session_here()


def check_wall(albedo):
    """Half of what the wall sees is sky, half a plain that sends on its albedo of the light: 1/2 +
    ρ/2.
    """
    transfer = session_here().transfer
    row = transfer.surfaces.surface_id.index("wall/0")
    error = transfer.diffuse_relative_standard_error[row]
    assert error < 0.01
    assert (
        abs(transfer.diffuse_relative[row] - 0.5 * (1 + albedo)) < 4 * error + 2e-3
    )  # the plain ends somewhere


@pytest.mark.slow
def test_a_wall_before_a_plain_of_a_material(addon):
    """Of its colour; of another one at the next trace; of the one value, where materials do not
    count.
    """
    material = build_material("red", RED)
    add_wall_and_ground(material)
    session = trace(addon)
    check_wall(0.2126 * 0.5 + 0.7152 * 0.2 + 0.0722 * 0.1)
    assert list(session.transfer.record.request["materials"]) == ["red"]
    item = here()
    assert list(item["citypv_albedos"]) == ["one value|0.250|1", "red|0.257|1"]
    assert item["citypv_unread"] == ""
    assert find_row(item, "material/red")["count"] == "1"
    find_shader(material).inputs["Base Color"].default_value = (0.8, 0.8, 0.8, 1)
    run("trace")
    check_wall(0.8)
    run("trace", albedo_source="one", ground_albedo=0.4)
    check_wall(0.4)
    assert session.transfer.record.request["materials"] == {}


@pytest.mark.slow
def test_a_material_by_its_name_and_one_that_tells_no_albedo(addon):
    """As the name says, whatever its colour; of a photograph the one value, and it is named."""
    material = build_material("Brick.007", (0, 0, 0))
    plain = add_wall_and_ground(material)
    trace(addon)
    check_wall(0.3)
    plain.data.materials[0] = material = build_material("photograph")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(
        texture.outputs["Color"], find_shader(material).inputs["Base Color"]
    )
    select("wall", "plain")
    trace(addon, ground_albedo=0.5)
    check_wall(0.5)
    item = here()
    assert set(item["citypv_albedos"]) == {"one value|0.250|1", "ground|0.500|1"}
    assert item["citypv_unread"] == "Materials without a known albedo: photograph"
    assert describe_material(material).startswith("One value: a texture")


def select(*names):
    for item in bpy.data.objects:
        item.select_set(item.name in names)


@pytest.mark.slow
def test_materials_that_are_not_there_are_told_in_one_line(addon):
    material = build_material("plaster")
    plain = add_wall_and_ground()
    with pytest.raises(RuntimeError, match="Materials: no face has a material; assign materials"):
        trace(addon)
    select("wall", "plain")
    plain.data.materials.append(material)
    trace(addon)
    material.name = "stucco"
    refuse("trace", "Materials: 'plaster' was removed or renamed; take the meshes again")


@pytest.mark.parametrize(
    ("shader", "inputs", "finish"),
    [
        ("Principled", {}, MaterialSpec(0.2566)),
        ("Principled", {"Metallic": 1.0, "Roughness": 0.0}, MaterialSpec(0.2566, "mirror")),
        ("Principled", {"Metallic": 1.0, "Roughness": 0.3}, MaterialSpec(0.2566, "glossy:0.09")),
        ("Principled", {"Metallic": 1.0, "Roughness": 0.9}, MaterialSpec(0.2566)),
        ("Principled", {"Transmission Weight": 1.0}, MaterialSpec(material="glass")),
        ("Diffuse", {}, MaterialSpec(0.2566)),
        ("Anisotropic", {"Roughness": 0.5}, MaterialSpec(0.2566, "glossy:0.25")),
        ("Glass", {}, MaterialSpec(material="glass")),
        ("Toon", {}, None),
    ],
)
def test_what_a_shader_means(shader, inputs, finish):
    material = build_material("material")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdf" + shader)
    tree.links.new(node.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    colour = "Base Color" if shader == "Principled" else "Color"
    for name, value in {colour: (*RED, 1), **inputs}.items():
        node.inputs[name].default_value = value
    found = read_finish(material)
    if finish is None:
        assert found is None
    else:
        assert (found.albedo, found.material) == (
            pytest.approx(finish.albedo, abs=1e-9),
            finish.material,
        )


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="from 5.0 on every material has nodes")
def test_a_material_without_nodes():
    material = bpy.data.materials.new("material")
    material.diffuse_color = (*RED, 1)
    assert read_finish(material).albedo == pytest.approx(0.2566, abs=1e-9)


def test_the_users_choice_counts_before_name_and_shader(addon):
    material = build_material("Brick", RED)
    assert read_finish(material) == MaterialSpec(material="brick")
    material.citypv_material = "Slate"
    assert read_finish(material) == MaterialSpec(material="slate")
    assert describe_material(material) == "slate: reflects evenly, albedo 0.100"
    material.citypv_material = "glossy:0.2"
    assert read_finish(material).material == "glossy:0.2"
    assert read_finish(material).albedo == pytest.approx(0.2566, abs=1e-9)
    material.citypv_material = "double glazing"
    assert describe_material(material) == "double glazing: reflects as glass or water"
    material.citypv_material = "cheese"
    assert describe_material(material).startswith("cheese: is not a known material")
    other = build_material("from a file", RED)
    other["citypv_material"] = "tile"
    assert read_finish(other) == MaterialSpec(material="tile")


def test_slots_of_the_object_overrule_those_of_the_mesh_and_our_own_colours_are_no_material():
    clay, lime = build_material("clay"), build_material("lime")
    item = add_face("face", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], clay, lime)
    assert name_face_materials(item, item.data) == ["clay"]
    item.data.polygons[0].material_index = 1
    assert name_face_materials(item, item.data) == ["lime"]
    item.material_slots[1].link = "OBJECT"
    assert name_face_materials(item, item.data) == [""]
    item.material_slots[1].material = clay
    assert name_face_materials(item, item.data) == ["clay"]
    start_emission("CityPV missing")
    item.material_slots[1].material = bpy.data.materials["CityPV missing"].copy()
    assert name_face_materials(item, item.data) == [""]


def test_materials_that_modifiers_give_are_those_of_the_faces(addon):
    """The second slot for the rim of a thickened face; another material, by geometry nodes, for all
    of a second.
    """
    clay, lime = build_material("clay"), build_material("lime")
    corners = [(0, 0, 0), (5, 0, 0), (5, 5, 0), (0, 5, 0)]
    solidify = add_face("slab", corners, clay, lime).modifiers.new("Solidify", "SOLIDIFY")
    solidify.material_offset_rim = 1
    tree = bpy.data.node_groups.new("Give", "GeometryNodeTree")
    for way, kind in (("INPUT", "NodeGroupInput"), ("OUTPUT", "NodeGroupOutput")):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        tree.nodes.new(kind)
    node = tree.nodes.new("GeometryNodeSetMaterial")
    node.inputs["Material"].default_value = lime
    tree.links.new(tree.nodes[0].outputs[0], node.inputs["Geometry"])
    tree.links.new(node.outputs[0], tree.nodes[1].inputs[0])
    face = add_face("face", [(x + 9, y, z) for x, y, z in corners], clay)
    face.modifiers.new("Give", "NODES").node_group = tree
    bpy.context.view_layer.update()
    run("take_meshes")
    city = session_here().city
    found = list(zip(city.building_id, city.material, strict=True))
    assert sorted(found) == [("face", "lime")] + [("slab", "clay")] * 2 + [("slab", "lime")] * 4
