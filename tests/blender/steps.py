"""What a user of the panel does, from a script."""

import sys

import bpy
import numpy as np
import pytest

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.light.editable_city import prepare_decided
from citypv.core.run.study import trace_scene
from citypv.operators.city.session import Session, find_city


def run(*steps, **settings):
    """Change settings of the panel and run steps, which must succeed; return the city."""
    for name, value in settings.items():
        setattr(bpy.context.scene.citypv, name, value)
    for step in steps:
        assert getattr(bpy.ops.citypv, step)() == {"FINISHED"}
    return here()


def refuse(step, words, **options):
    """A step must fail with an error of one line in which a pattern is found."""
    with pytest.raises(RuntimeError, match=words) as told:
        getattr(bpy.ops.citypv, step)(**options)
    assert len(str(told.value).strip().splitlines()) == 1


def here():
    """The city that the panel works on."""
    return find_city(bpy.context.scene)[0]


def session_here():
    """What was read, traced and weighed of it."""
    return Session.of(here())


def colours_of(mesh):
    """Colours of the corners of a mesh: (l, 3) sRGB in 0–1."""
    values = np.empty(4 * len(mesh.loops), np.float32)
    mesh.color_attributes["citypv_colour"].data.foreach_get("color_srgb", values)
    return values.reshape(-1, 4)[:, :3]


def add_box(name, location):
    """A box of 10 m × 8 m × 6 m around a place."""
    bpy.ops.mesh.primitive_cube_add(size=2, location=location, scale=(5, 4, 3))
    bpy.context.object.name = name
    return bpy.context.object


def add_mesh(name, points, faces):
    """An object of these faces."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def add_tower(x=5.0):
    """A selected tower of 40 m to the south of the first house."""
    tower = add_box("tower", (x, -12.0, 20.0))
    tower.scale = (1, 1, 20 / 3)  # of 6 m
    bpy.context.view_layer.update()
    bpy.ops.object.select_all(action="DESELECT")
    tower.select_set(True)
    return tower


def trace_anew(session):
    """The city of a session in a full run, at the same place and with the same decisions; its
    ground is laid anew.
    """
    base, scene = session.base, session.base.scene
    request = base.request
    options = SceneOptions(sectors=request.sectors, site=scene.site, lattice=scene.lattice)
    scene = build_scene(
        session.city, ground=request.ground, patch_size=request.patch_size, options=options
    )
    return trace_scene(
        scene, session.weather, request, prepared=prepare_decided(base.decisions, scene, request)
    )


def assert_full_run(session):
    """The light is that of a full run of the edited city, but for the ground, which an edit leaves
    as it lies.
    """
    expected = trace_anew(session)
    assert expected.surfaces.surface_id == session.transfer.surfaces.surface_id
    assert session.transfer.visible_share == pytest.approx(expected.visible_share, abs=0.13)
    assert np.abs(session.transfer.visible_share - expected.visible_share).mean() < 0.002
    error = np.maximum(expected.diffuse_relative_standard_error, 1e-4)
    apart = (session.transfer.diffuse_relative - expected.diffuse_relative) / error
    assert np.sqrt((apart**2).mean()) < 1.1


def forget_module(monkeypatch, name):
    """Let a module be imported anew, until the patch is undone; its package forgets it, too."""
    package, _, child = name.rpartition(".")
    if package in sys.modules:
        monkeypatch.delattr(sys.modules[package], child, raising=False)
    monkeypatch.delitem(sys.modules, name)
