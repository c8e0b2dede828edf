"""Edits of an imported city: what stands beside it joins it, a building goes; the light is that of a full run."""

import bpy
import numpy as np
import pytest
from steps import add_box, here, run, session_here

from citypv.core.light.editable_city import prepare_decided
from citypv.core.study import stand_city, trace_scene
from citypv.operators.in_place import describe_edit
from citypv.operators.picture.show_result import find_before


@pytest.fixture
def traced(addon, city_file):
    return run("solar_city", city_path=str(city_file), samples=32, shadow_samples=4, days=4)


def trace_anew(session):
    """The city of a session in a full run, at the same place and with the same decisions."""
    base, _ = session.base
    request = base.request
    scene = stand_city(session.city, request, like=base.leaf.prepared.scene)
    return trace_scene(scene, session.weather, request, prepared=prepare_decided(base.decisions, scene, request))


def test_a_tower_beside_the_city_joins_it(traced):
    before = np.array(session_here().energy.full_load_hours)
    names = list(session_here().transfer.surfaces.surface_id)
    tower = add_box("tower", (5.0, -12.0, 20.0))
    tower.scale = (1, 1, 20 / 3)  # of 6 m
    bpy.context.view_layer.update()
    bpy.ops.object.select_all(action="DESELECT")
    tower.select_set(True)
    assert "add it to the city" in describe_edit(here())[1]
    run("add_to_city")
    bpy.context.view_layer.update()
    assert describe_edit(here()) == ("", "")
    session = session_here()
    surfaces = session.transfer.surfaces
    assert surfaces.building_id.count("tower") == 6
    place = [surfaces.surface_id.index(name) for name in names]
    change = session.energy.full_load_hours[place] - before
    assert np.nanmin(change) < -50 and here()["citypv_colour_attribute"] == "change_of_full_load_hours"
    assert find_before(bpy.context.scene) is not None and tower.hide_get()
    expected = trace_anew(session)
    assert expected.surfaces.surface_id == surfaces.surface_id
    assert session.transfer.visible_share == pytest.approx(expected.visible_share)
    assert session.transfer.diffuse_relative == pytest.approx(expected.diffuse_relative)
    # The box stands where it is seen: its walls at 0 and 10 m east, 8 and 16 m south of the city's origin.
    top = session.scene.vertices[session.scene.triangles[surfaces_of(session, "tower")]].reshape(-1, 3)
    assert top.min(axis=0)[:2] == pytest.approx([0, -16], abs=0.01) and top[:, 2].max() == pytest.approx(40, abs=0.01)


def surfaces_of(session, building):
    rows = [row for row, name in enumerate(session.transfer.surfaces.building_id) if name == building]
    return np.isin(session.scene.triangle_surface, rows)


def test_a_building_goes_and_comes_back_by_undo(traced):
    name = session_here().transfer.surfaces.building_id[0]
    assert bpy.ops.citypv.remove_building(building=name) == {"FINISHED"}
    left = session_here()
    assert name not in left.transfer.surfaces.building_id
    assert left.transfer.diffuse_relative == pytest.approx(trace_anew(left).diffuse_relative)
    with pytest.raises(RuntimeError, match="no building of the city has this id"):
        bpy.ops.citypv.remove_building(building=name)
    with pytest.raises(RuntimeError, match="Building: none is named"):
        bpy.ops.citypv.remove_building()


def test_without_the_rays_it_says_what_to_do(traced, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    with pytest.raises(RuntimeError, match="Trace the light of the city first"):
        bpy.ops.citypv.remove_building(building="x")
