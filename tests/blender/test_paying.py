"""Which faces pay, in Blender: the property acts at once on colours, sums and comparisons."""

import bpy
import numpy as np
import pytest
from steps import run, session_here

from citypv.core.results.colour_map import MISSING, srgb_colour
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.read_settings import state_of_step
from citypv.operators.run.compare_results import read_comparison
from citypv.operators.show.colour_faces import read_scale
from citypv.operators.show.probe_faces import hit_face
from citypv.operators.show.show_modules import find_modules


def total(city):
    """kWp and MWh of the panel's first line."""
    _, kwp, mwh, _ = city["citypv_totals"][0].split("|")
    return float(kwp.replace(",", "")), float(mwh.replace(",", ""))


@pytest.mark.slow
def test_least_hours_act_at_once(addon, city_file, tmp_path):
    city = run("solar_city", city_path=str(city_file), samples=16, shadow_samples=4, days=2)
    energy, area = session_here().energy, session_here().transfer.surfaces.area
    surface, before = read_face_attribute(city.data, "surface"), total(city)
    hours = np.where(energy.kwp > 0, energy.full_load_hours * area / energy.open_area, np.nan)
    least = round(float(np.nanmedian(hours)))
    pays = hours >= least
    addon.least_hours = least
    # The map of what stays: grey below, and hours of modules elsewhere.
    assert addon.attribute == city["citypv_colour_attribute"] == "module_hours"
    shown = read_face_attribute(city.data, "module_hours")
    np.testing.assert_allclose(shown, np.where(pays, hours, np.nan)[surface], rtol=1e-6)
    scale = read_scale(city)
    assert scale.low < np.nanmin(shown) and scale.high >= np.nanmax(shown)  # of all modules
    colours = scale.colours(shown)
    grey = (colours == srgb_colour(MISSING)).all(axis=1)
    assert (grey == ~pays[surface]).all() and 0 < grey.sum() < len(grey)
    # Sums are those of what stays, by hand; the light is what it was.
    kwp = np.where(pays, energy.kwp, 0)
    assert total(city) == pytest.approx((kwp.sum(), (kwp @ np.nan_to_num(hours)) / 1000), abs=0.51)
    assert total(city)[0] < before[0]
    np.testing.assert_array_equal(session_here().energy.full_load_hours, energy.full_load_hours)
    assert state_of_step(city, "energy", addon) == "done"
    # A run of the step gives the same, and 0 gives all back.
    after = total(city)
    run("energy")
    assert total(city) == after
    addon.least_hours = 0
    assert total(city) == before and (session_here().energy.reason[pays] == "").all()
    # A list of ids takes away the rest; one that names nothing is told.
    path = tmp_path / "list.csv"
    path.write_text("id,words\nhouse1,protected\nnobody,\n", encoding="utf-8")
    run("energy", leave_out=str(path))
    left = np.array(session_here().transfer.surfaces.building_id) == "house1"
    reasons = session_here().energy.reason
    assert (reasons[left & (energy.kwp > 0)] == "left-out").all() and "left-out" not in reasons[
        ~left
    ]
    addon.leave_out = ""


@pytest.mark.slow
def test_undo_takes_the_choice_back(addon, city_file):
    run("solar_city", city_path=str(city_file), samples=16, shadow_samples=4, days=2)
    kwp = session_here().energy.kwp.sum()
    bpy.ops.ed.undo_push(message="before")
    bpy.context.scene.citypv.least_hours = 700
    bpy.ops.ed.undo_push(message="after")
    assert session_here().energy.kwp.sum() < kwp
    bpy.ops.ed.undo()
    assert bpy.context.scene.citypv.least_hours == 0
    assert session_here().energy.kwp.sum() == kwp and session_here().request.least_hours == 0
    bpy.ops.ed.redo()
    assert session_here().energy.kwp.sum() < kwp
    bpy.context.scene.citypv.least_hours = 0


def modules_here():
    """Full load hours of the modules [h], and their power [kWp], by the ids of the surfaces."""
    energy, surfaces = session_here().energy, session_here().transfer.surfaces
    hours = energy.full_load_hours * surfaces.area / np.maximum(energy.open_area, 1e-9)
    values = zip(np.nan_to_num(hours).tolist(), energy.kwp.tolist(), strict=True)
    return dict(zip(surfaces.surface_id, values, strict=True))


@pytest.mark.slow
def test_a_comparison_counts_on_the_modules_of_before(addon, city_file, tower_file):
    """A tower takes the sun from the first house, whose southern roof would not pay any more."""
    few = {"samples": 16, "shadow_samples": 4, "days": 2}
    states = []
    for file in (city_file, tower_file):
        run("solar_city", city_path=str(file), **few)
        states.append(modules_here())
    least = round(np.mean([state["house0_roof_south"][0] for state in states]))
    run("solar_city", city_path=str(city_file), least_hours=least)
    modules = {name: kwp for name, (_, kwp) in modules_here().items() if name.startswith("house0")}
    run("keep_before")
    city = run("solar_city", city_path=str(tower_file))
    assert modules["house0_roof_south"] > 0 == modules_here()["house0_roof_south"][1]
    assert "would no longer pay" in city["citypv_matched"]
    rows = {row["name"]: row for row in read_comparison(city["citypv_compared"])["buildings"]}
    for word, state in zip(("before", "after"), states, strict=True):
        expected = sum(kwp * state[name][0] / 1000 for name, kwp in modules.items())
        assert rows["house0"][word] == pytest.approx(expected, abs=0.001)
    addon.least_hours = 0


@pytest.mark.slow
def test_modules_are_one_object_of_instances(addon, city_file):
    """Each lies before its face, as large as it is, and goes with the faces that do not pay."""
    city = run("solar_city", city_path=str(city_file), samples=16, shadow_samples=4, days=2)
    assert find_modules(bpy.context.scene) == []
    addon.show_modules = True
    (item,) = find_modules(bpy.context.scene)
    layout, energy = session_here().energy.layout, session_here().energy
    assert len(item.data.vertices) == len(layout) == energy.module_count.sum() > 0
    assert item.parent == city and item.hide_select
    # The evaluated instances have the corners of the layout, 5 cm before their faces.
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for one in graph.object_instances:
        if one.is_instance and one.parent.original == item:
            mesh = one.object.data
            matrix = np.array(one.matrix_world)
            points = np.array([vertex.co for vertex in mesh.vertices])
            found.append(points @ matrix[:3, :3].T + matrix[:3, 3])
    found, expected = np.array(found), layout.corners()
    assert found.shape == expected.shape
    order = [np.lexsort(points.mean(axis=1).round(3).T) for points in (found, expected)]
    np.testing.assert_allclose(found[order[0]], expected[order[1]], atol=2e-3)
    # A click on a module probes the face that carries it.
    row = int(layout.surface[0])
    outward = np.cross(layout.along[0], layout.up[0])
    middle = expected[0].mean(axis=0)
    bpy.context.view_layer.update()
    face = hit_face(bpy.context, middle + 2 * outward, -outward / np.linalg.norm(outward))
    assert read_face_attribute(city.data, "surface")[face] == row
    bpy.ops.citypv.probe(face=face)
    assert f"Modules|{energy.module_count[row]:,.0f}" in list(city["citypv_probe"])
    # What does not pay loses its modules, and all go where the energy does, or are switched off.
    least = round(
        float(np.median(hours_of_modules(city)[read_face_attribute(city.data, "surface") >= 0]))
    )
    addon.least_hours = least
    (item,) = find_modules(bpy.context.scene)
    assert len(item.data.vertices) == session_here().energy.module_count.sum() < len(layout)
    addon.least_hours = 0
    addon.show_modules = False
    assert find_modules(bpy.context.scene) == []
    addon.show_modules = True
    run("trace")
    assert find_modules(bpy.context.scene) == []
    addon.show_modules = False


def hours_of_modules(city):
    return np.nan_to_num(read_face_attribute(city.data, "module_hours"))
