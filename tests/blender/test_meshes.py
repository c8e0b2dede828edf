"""Meshes, collections and instances of the user's scene become buildings, and what cannot be used
is told.
"""

import bpy
import numpy as np
import pytest
from steps import add_box, add_mesh, here, refuse, run, session_here

from citypv.core.city.build_scene import build_scene
from citypv.core.city.join_contents import join_contents
from citypv.core.settings.errors import InputError
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.run.take_meshes import read_meshes


def take(items):
    return join_contents([read_meshes("Boxes", items, bpy.context)[0]], orient="auto")


def move(item, collection):
    bpy.context.scene.collection.objects.unlink(item)
    collection.objects.link(item)
    return item


def test_a_mesh_of_the_user_becomes_a_city(addon):
    bpy.ops.mesh.primitive_cube_add(size=2, location=(3, 4, 5), scale=(5, 4, 3))
    box = bpy.context.object
    city = take([box])
    surfaces = build_scene(city, latitude=50.0, longitude=8.0).surfaces
    by_kind = {
        kind: sorted(surfaces.area[surfaces.kind == kind].tolist())
        for kind in ("facade", "flat", "downward")
    }
    expected = {"facade": [48.0, 48.0, 60.0, 60.0], "flat": [80.0], "downward": [80.0]}
    for kind, areas in expected.items():
        np.testing.assert_allclose(by_kind[kind], areas, rtol=1e-6)
    np.testing.assert_allclose(city.points.min(axis=0), [-2, 0, 2], atol=1e-6)
    np.testing.assert_allclose(city.points.max(axis=0), [8, 8, 8], atol=1e-6)
    # Mirrored, its outside stays outside.
    box.scale.x = -box.scale.x
    bpy.context.view_layer.update()
    mirrored = build_scene(take([box]), latitude=50.0, longitude=8.0).surfaces
    assert sorted(mirrored.kind) == sorted(surfaces.kind)
    assert sorted(mirrored.orientation) == sorted(surfaces.orientation)


@pytest.mark.slow
def test_a_mesh_of_the_user_goes_through_the_steps(addon):
    bpy.ops.mesh.primitive_cube_add(size=10, location=(0, 0, 5))
    run("take_meshes")
    refuse("classify", "its location on Earth is unknown; enable Own location")
    city = run(
        "classify",
        "trace",
        "energy",
        days=2,
        samples=64,
        own_place=True,
        latitude=48.0,
        longitude=11.0,
    )
    assert len(np.unique(read_face_attribute(city.data, "full_load_hours"))) >= 4


def test_meshes_without_faces_are_refused(addon):
    bpy.ops.object.add(type="MESH")
    with pytest.raises(InputError, match="Boxes: they have no faces"):
        take([bpy.context.object])


def test_the_scale_of_the_scene_counts(addon):
    box = add_box("box", (0, 0, 3))
    bpy.context.scene.unit_settings.scale_length = 0.01
    city = take([box])
    np.testing.assert_allclose(np.ptp(city.points, axis=0), [0.1, 0.08, 0.06], rtol=1e-6)


def test_a_collection_gives_its_meshes_those_below_it_and_its_instances(addon):
    town, quarter, model = (bpy.data.collections.new(name) for name in ("Town", "Quarter", "Model"))
    bpy.context.scene.collection.children.link(town)
    town.children.link(quarter)
    move(add_box("house", (0, 0, 3)), town)
    move(add_box("barn", (40, 0, 3)), quarter)
    move(add_box("shed", (0, 0, 0)), model)  # the model itself is not in the scene
    for place in ((0, 50, 3), (40, 50, 3)):
        row = bpy.data.objects.new("row", None)
        row.instance_type, row.instance_collection, row.location = "COLLECTION", model, place
        quarter.objects.link(row)
    add_box("elsewhere", (500, 0, 3))
    run("take_meshes", collection=town)
    city = session_here().city
    names = sorted(set(city.building_id))
    assert names == ["barn", "house", "row.001/shed", "row/shed"]
    assert len(city) == 24
    points = {
        name: city.points[city.ring_start[:-1]][np.array(city.building_id) == name]
        for name in names
    }
    np.testing.assert_allclose(points["row.001/shed"].min(axis=0), [35, 46, 0], atol=1e-5)
    np.testing.assert_allclose(points["row/shed"].max(axis=0), [5, 54, 6], atol=1e-5)
    assert list(here()["citypv_report"])[:2] == [
        "Collection Town",
        "4 buildings, 0 parts, 24 surfaces",
    ]


def test_instances_of_geometry_nodes_are_buildings(addon):
    box = add_box("box", (0, 0, 3))
    tree = bpy.data.node_groups.new("Row", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ("MeshLine", "ObjectInfo", "InstanceOnPoints")
    line, info, instance = (tree.nodes.new("GeometryNode" + kind) for kind in kinds)
    line.inputs["Count"].default_value, line.inputs["Offset"].default_value = 3, (20, 0, 0)
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = box, True
    tree.links.new(line.outputs["Mesh"], instance.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], instance.inputs["Instance"])
    tree.links.new(
        instance.outputs["Instances"], tree.nodes.new("NodeGroupOutput").inputs["Geometry"]
    )
    carrier = add_mesh("carrier", [], [])
    carrier.location = (0, 100, 3)
    carrier.modifiers.new("Row", "NODES").node_group = tree
    bpy.context.view_layer.update()
    city = take([carrier])
    assert sorted(set(city.building_id)) == ["carrier/box", "carrier/box~2", "carrier/box~3"]
    np.testing.assert_allclose(city.points.min(axis=0), [-5, 96, 0], atol=1e-5)
    np.testing.assert_allclose(city.points.max(axis=0), [45, 104, 6], atol=1e-5)
    assert not city.report.skipped


def test_what_cannot_be_used_of_meshes_is_reported(addon):
    box = add_box("box", (0, 0, 3))
    empty = add_mesh("empty", [], [])
    spoilt = add_mesh(
        "spoilt",
        [(20, 0, 0), (30, 0, 0), (30, 9, 0), (20, float("nan"), 0)],
        [(0, 1, 2), (0, 2, 3)],
    )
    thin = add_mesh("thin", [(20, 20, 0), (30, 20, 0), (40, 20, 0)], [(0, 1, 2)])
    curve = bpy.data.objects.new("curve", bpy.data.curves.new("curve", "CURVE"))
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    hidden = add_box("hidden", (90, 0, 3))
    hidden.hide_viewport = True
    for item in (curve, lamp):
        bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    city = take([box, empty, spoilt, thin, curve, lamp, hidden])
    assert city.report.skipped == {
        "mesh without faces": ["empty"],
        "coordinates that are not finite or beyond the Earth": ["spoilt/1"],
        "hidden in the viewport": ["hidden"],
        "no mesh: convert it to one": ["curve"],
        "no area": ["thin/0"],
    }
    assert not city.report.repaired
    assert sorted(set(city.building_id)) == ["box", "spoilt"]


def test_meshes_are_taken_from_edit_mode_as_they_are_edited(addon):
    add_box("box", (0, 0, 3))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(1, 1, 2))
    run("take_meshes")
    city = session_here().city
    assert np.ptp(city.points[:, 2]) == pytest.approx(12)


def test_nothing_to_take_says_what_to_do(addon):
    refuse("take_meshes", "Select meshes, or choose a collection")


def test_marked_meshes_are_trees(addon):
    """By a custom property, of the object or its collection, or by the name of the collection; the
    property decides.
    """
    trees = bpy.data.collections.new("Trees")
    hedges = bpy.data.collections.new("Green")
    hedges["tree"] = True
    for group in (trees, hedges):
        bpy.context.scene.collection.children.link(group)
    house, lime = add_box("House", (0, 0, 3)), add_box("Lime", (20, 0, 3))
    lime["tree"], lime["evergreen"] = True, True
    ash, kiosk = move(add_box("Ash", (40, 0, 3)), trees), move(add_box("Kiosk", (60, 0, 3)), trees)
    kiosk["tree"] = False
    hedge = move(add_box("Hedge", (80, 0, 3)), hedges)
    bpy.context.view_layer.update()
    city = take([house, lime, ash, kiosk, hedge])
    assert sorted(tree.name for tree in city.trees) == ["Ash", "Hedge", "Lime"]
    assert set(city.building_id) == {"House", "Kiosk"} and len(city) == 12
    crowns = build_scene(city, latitude=50.0, longitude=8.0).trees
    assert [
        name for name, evergreen in zip(crowns.names, crowns.evergreen, strict=True) if evergreen
    ] == ["Lime"]
    np.testing.assert_allclose(crowns.volume, 480.0, rtol=1e-5)


def test_the_place_is_asked_for_before_meshes_are_taken(addon):
    """In the background nothing can ask; the dialog's answer is kept, and the step begins."""
    bpy.ops.mesh.primitive_cube_add(size=10, location=(0, 0, 5))
    refuse("ask_place", "Give latitude and longitude", then="take_meshes")
    settings = bpy.context.scene.citypv
    assert not settings.own_place and here() is None
    settings.latitude, settings.longitude = 48.0, 11.0
    assert bpy.ops.citypv.ask_place(then="take_meshes") == {"FINISHED"}
    assert settings.own_place and len(session_here().city) == 6
