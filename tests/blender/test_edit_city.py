"""Edits of an imported city: what stands beside it joins it, a building goes; the light is that of
a full run.
"""

import json

import bpy
import numpy as np
import pandas as pd
import pytest
from small_city import house, write_gml
from steps import (
    add_box,
    add_tower,
    assert_full_run,
    colours_of,
    here,
    refuse,
    run,
    session_here,
    trace_anew,
)

from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.city.written_scene import written_scene
from citypv.core.light.change_light import trace_change
from citypv.core.light.match_light import match_light
from citypv.core.run import study
from citypv.core.run.study import change_scene, compute_energy
from citypv.core.settings.progress import silent
from citypv.operators.city.attributes import CHANGE, read_corners, read_face_attribute
from citypv.operators.city.edit_marks import describe_edit
from citypv.operators.city.session import Session, list_cities
from citypv.operators.run import update_city
from citypv.operators.run.members import list_members
from citypv.operators.run.update_city import UpdateCity, estimate_hours
from citypv.operators.show.build_legend import note_of
from citypv.operators.show.show_result import find_before


def hours_of(session):
    """Full load hours by surface."""
    return dict(
        zip(
            session.transfer.surfaces.surface_id,
            session.energy.full_load_hours.tolist(),
            strict=True,
        )
    )


def update():
    """Press Update, after Blender has noticed what was edited."""
    bpy.context.view_layer.update()
    run("update")


def sums_here():
    """Rows of the table of sums, by name."""
    return {row["name"]: row for row in json.loads(here()["citypv_compared"])["sums"]}


def refuse_to_trace(monkeypatch):
    """What is computed from here on fails."""

    def trace_change(*_, **__):
        raise AssertionError("traced")

    monkeypatch.setattr("citypv.core.run.variant.trace_change", trace_change)


@pytest.mark.slow
def test_a_tower_joins_the_city_is_moved_and_comes_back_by_undo(traced, monkeypatch):
    """What is seen is what was computed: as object of the user, at each place; known places are not
    traced again.
    """
    tower, before = add_tower(), hours_of(session_here())
    bpy.ops.ed.undo_push(message="tower")
    assert "add it to the city" in describe_edit(here())[1]
    run("add_to_city")
    assert describe_edit(here()) == ("", "")
    bpy.ops.ed.undo_push(message="added")
    session = session_here()
    first = hours_of(session)
    assert session.transfer.surfaces.building_id.count("tower") == 6
    assert np.nanmin([first[name] - value for name, value in before.items()]) < -50
    assert here()["citypv_colour_attribute"] == "change_of_full_load_hours"
    assert_full_run(session)
    # The box stands where it is seen, and shows its own colours: walls at 0 and 10 m east, 8 and 16
    # m south.
    top = session.scene.vertices[session.scene.triangles[triangles_of(session, "tower")]].reshape(
        -1, 3
    )
    assert top.min(axis=0)[:2] == pytest.approx([0, -16], abs=0.01) and top[
        :, 2
    ].max() == pytest.approx(40, abs=0.01)
    assert tower.visible_get() and "citypv_colour" in tower.data.color_attributes
    shown = here().evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert (
        len(here().data.polygons) - len(shown.data.polygons) == triangles_of(session, "tower").sum()
    )
    tower.location.x += 30
    bpy.context.view_layer.update()
    assert note_of(here(), "full_load_hours").startswith("before the last edit")
    refuse("trace", "objects of it were edited; press Update")
    run("update")
    bpy.ops.ed.undo_push(message="moved")
    second = hours_of(session_here())
    assert_full_run(session_here())
    refuse_to_trace(monkeypatch)
    bpy.ops.ed.undo()
    assert bpy.data.objects["tower"].location.x == pytest.approx(5)
    if describe_edit(here())[0]:
        run("update")
    assert hours_of(session_here()) == pytest.approx(first, rel=0, abs=0, nan_ok=True)
    bpy.ops.ed.redo()
    if describe_edit(here())[0]:
        run("update")
    assert hours_of(session_here()) == pytest.approx(second, rel=0, abs=0, nan_ok=True)
    assert describe_edit(here()) == ("", "")


@pytest.mark.slow
def test_an_edit_reads_the_weather_only_where_something_else_is_asked_for(traced, monkeypatch):
    """The light that was seen before is weighed with the same record."""
    read, read_year = [], study.read_year
    monkeypatch.setattr(study, "read_year", lambda *given: read.append(given) or read_year(*given))
    add_tower()
    weather = session_here().weather
    run("add_to_city")
    assert not read and session_here().weather is weather
    bpy.data.objects["tower"].location.x += 30
    bpy.context.scene.citypv.losses = 20.0
    update()
    assert len(read) == 1 and session_here().weather is not weather


def triangles_of(session, building):
    """Which triangles of the scene are of a building: (t,) bool."""
    rows = [
        row for row, name in enumerate(session.transfer.surfaces.building_id) if name == building
    ]
    return np.isin(session.scene.triangle_surface, rows)


@pytest.mark.slow
def test_the_files_say_what_the_table_says_of_neighbours(traced, tmp_path):
    add_tower()
    run("add_to_city")
    lost = sums_here()["existing"]
    assert 0 < lost["error"] < 0.1 * abs(lost["change"])
    for name in ("changes", "comparison"):
        assert bpy.ops.citypv.export(format=name, filepath=str(tmp_path / name)) == {"FINISHED"}
    table = pd.read_csv(tmp_path / "changes").set_index("building_id")
    shown = {row["name"]: row for row in json.loads(here()["citypv_compared"])["buildings"]}
    assert set(shown) == set(table.index)
    for building, row in shown.items():
        assert table["mwh_change"][building] == pytest.approx(row["change"], abs=2e-3)
        assert table["mwh_change_standard_error"][building] == pytest.approx(row["error"], abs=2e-3)
    assert "Who loses, who gains" in (tmp_path / "comparison").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_estimate_before_the_exact_numbers_is_close(addon, city_file):
    run("solar_city", city_path=str(city_file), samples=64, shadow_samples=16, days=4)
    session, seen = session_here(), []
    before = hours_of(session)
    higher = edit_city(session.city, CityChange(raised={"house0": 12.0}))
    change = change_scene(session.base, session.city, higher, session.base.request)
    scene = written_scene(change.scene, change.rows)

    def preview(*light):
        seen.append(estimate_hours(session, scene, light))

    edited = trace_change(session.base, change, preview=preview)
    exact = compute_energy(edited.transfer, session.weather, session.request).full_load_hours
    change = exact - [before[name] for name in scene.surfaces.surface_id]
    known = np.isfinite(exact)
    assert (np.isfinite(seen[0]) == known).all() and np.abs(change[known]).max() > 50
    assert np.abs(seen[0] - exact)[known].max() < 0.2 * np.abs(change[known]).max()


class Watched:
    """An update that shows its estimate, as in a window."""

    _keep_before = UpdateCity._keep_before

    def report(self, *_):
        """Tell nobody."""


@pytest.mark.slow
def test_an_edit_while_an_estimate_is_shown_is_one_of_what_was_traced(traced, monkeypatch):
    """A second tower comes while the estimate of the first is seen: the light is that of a full run
    with both.
    """
    monkeypatch.setattr(update_city, "is_editing", lambda context: False)
    first = add_tower()
    first["citypv_of"] = here()["citypv_id"]
    bpy.context.view_layer.update()
    shown = Watched()
    UpdateCity.work(UpdateCity.prepare(shown, bpy.context), silent)
    UpdateCity.refine(shown, bpy.context)
    assert here()["citypv_preview"] and session_here().transfer is None
    second = add_tower(25.0)
    second.name, second["citypv_of"] = "second", here()["citypv_id"]
    update()
    session = session_here()
    count = session.transfer.surfaces.building_id.count
    assert (count("tower"), count("second")) == (6, 6)
    assert_full_run(session)


@pytest.mark.slow
def test_objects_that_come_into_the_collection_are_hidden_or_deleted_are_edits(traced):
    alone = hours_of(session_here())
    tower = add_tower()
    bpy.context.scene.collection.objects.unlink(tower)
    bpy.data.collections["CityPV"].objects.link(tower)
    bpy.context.view_layer.update()
    assert describe_edit(here())[0] == "objects of it were edited"
    run("update")
    assert "tower" in session_here().transfer.surfaces.building_id
    tower.hide_set(True)
    update()
    assert hours_of(session_here()) == pytest.approx(
        alone, abs=2.0, nan_ok=True
    )  # its ground is laid anew
    tower.hide_set(False)
    update()
    bpy.data.objects.remove(tower)
    update()
    assert hours_of(session_here()) == pytest.approx(
        alone, abs=2.0, nan_ok=True
    )  # its ground is laid anew


@pytest.mark.slow
def test_a_building_becomes_an_object_and_is_raised(traced):
    """In place with its ids it changes nothing; its roof moved up is an edit, after which its ids
    are the same.
    """
    alone, names = hours_of(session_here()), list(session_here().transfer.surfaces.surface_id)
    assert (
        bpy.ops.citypv.show_building(building="house1") == {"FINISHED"}
        and here()["citypv_highlight"]
    )
    assert bpy.ops.citypv.edit_building(building="house1") == {"FINISHED"}
    house = bpy.context.object
    assert "citypv_highlight" not in here()  # it would stay where the house was
    assert (house.name, describe_edit(here())) == ("house1", ("", ""))
    assert hours_of(session_here()) == pytest.approx(alone, rel=0, abs=0, nan_ok=True)
    assert "citypv_colour" in house.data.color_attributes
    top = max(vertex.co.z for vertex in house.data.vertices)
    for vertex in house.data.vertices:
        if vertex.co.z > 0.1:
            vertex.co.z += 10
    house.data.update()
    update()
    assert set(session_here().transfer.surfaces.surface_id) == set(names)
    assert_full_run(session_here())
    assert max(vertex.co.z for vertex in house.data.vertices) == pytest.approx(top + 10)
    facts = session_here().transfer.facts  # its file's
    assert (facts.building, facts.name) == (["house1"], ["Old mill"])
    assert hours_of(session_here()) != pytest.approx(alone, nan_ok=True)
    refuse("edit_building", "it is an object of its own already", building="house1")


@pytest.mark.slow
def test_the_mesh_of_the_city_is_edited_in_place(traced):
    city, session = here(), session_here()
    number = list(city["citypv_buildings"]).index("house2")
    own = read_face_attribute(city.data, "building") == number
    place = np.unique(read_corners(city.data).reshape(-1, 3)[own]).tolist()
    ridge = max(city.data.vertices[k].co.z for k in place)
    moved = [city.data.vertices[k] for k in place if city.data.vertices[k].co.z > ridge - 0.01]
    for vertex in moved:
        vertex.co.z += 8
    city.data.update()
    bpy.context.view_layer.update()
    assert moved and describe_edit(city)[0] == "its mesh was edited"
    highest = max(vertex.co.z for vertex in moved)
    run("update")
    after = session_here()
    own = after.scene.triangles[triangles_of(after, "house2")]
    assert after.scene.vertices[own].reshape(-1, 3)[:, 2].max() == pytest.approx(highest, abs=1e-3)
    assert set(after.transfer.surfaces.building_id) == set(session.transfer.surfaces.building_id)
    assert_full_run(after)
    assert describe_edit(here()) == ("", "")


@pytest.mark.slow
def test_a_building_goes(traced):
    name = session_here().transfer.surfaces.building_id[0]
    assert bpy.ops.citypv.remove_building(building=name) == {"FINISHED"}
    left = session_here()
    assert name not in left.transfer.surfaces.building_id
    assert left.transfer.diffuse_relative == pytest.approx(
        trace_anew(left).diffuse_relative, abs=0.01
    )
    for wrong, problem in (
        ("x", "no building of the city has this id"),
        ("", "none is named"),
        (name, "already"),
    ):
        refuse("remove_building", problem, building=wrong)


@pytest.mark.slow
def test_without_light_that_can_be_edited_classify_takes_what_is_seen(traced, city_file, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    assert not bpy.ops.citypv.update.poll() and not bpy.ops.citypv.edit_building.poll()
    add_tower()
    run("add_to_city")
    assert "Import and trace again" in describe_edit(here())[1]
    run("import_city", city_path=str(city_file))
    assert describe_edit(here())[0] == "objects of it were edited"
    run("classify")
    assert describe_edit(here()) == ("", "")
    assert session_here().scene.surfaces.building_id.count("tower") == 6


@pytest.mark.slow
def test_a_city_of_meshes_is_edited_as_well(addon):
    boxes = [add_box(f"box{number}", (20.0 * number, 0, 3)) for number in range(3)]
    bpy.ops.object.select_all(action="SELECT")
    addon.own_place, addon.latitude, addon.longitude = True, 48.0, 11.0
    run("take_meshes", "classify", "trace", "energy", samples=32, shadow_samples=4, days=4)
    boxes[1].location.y += 4
    update()
    assert describe_edit(here()) == ("", "")
    assert_full_run(session_here())
    bpy.data.objects.remove(boxes[2])
    update()
    assert set(session_here().transfer.surfaces.building_id) == {"box0", "box1"}
    assert_full_run(session_here())


@pytest.mark.slow
def test_variants_have_objects_and_results_of_their_own(traced, monkeypatch):
    """A as imported, B with a tower, C with the tower elsewhere; each is compared with any other,
    nothing is traced.
    """
    run("new_variant")
    add_tower()
    run("add_to_city")
    found = {"B": hours_of(session_here())}
    assert here()["citypv_variant"] == "B"
    table = sums_here()
    assert np.ptp(colours_of(here().data), axis=0).max() > 0.2  # who gains, who loses
    run("new_variant")
    still = read_face_attribute(here().data, CHANGE + "full_load_hours") == 0
    assert (
        still.any() and np.ptp(colours_of(here().data)[::3][still], axis=0).max() == 0
    )  # nothing yet
    moved = next(item for item in list_members(here()))
    assert moved.name != "tower" and not bpy.data.objects["tower"].visible_get()
    moved.location.x += 25
    update()
    found["C"] = hours_of(session_here())
    assert set(found["C"]) == set(found["B"]) and found["B"] != pytest.approx(
        found["C"], nan_ok=True
    )
    for item in bpy.context.scene.objects:  # as Alt H does
        item.hide_set(False)
    bpy.context.view_layer.update()
    assert here()["citypv_variant"] == "C" and describe_edit(here()) == ("", "")
    refuse_to_trace(monkeypatch)
    cities = {city["citypv_variant"]: city.name for city in list_cities(bpy.context.scene)}
    assert sorted(cities) == ["A", "B", "C"]
    for name in "ABCB":
        assert bpy.ops.citypv.switch_city(name=cities[name]) == {"FINISHED"}
        bpy.context.view_layer.update()
        city = here()
        assert (city["citypv_variant"], describe_edit(city)) == (name, ("", ""))
        assert [item.visible_get() for item in list_members(city)] == [True] * (name != "A")
        if name in found:
            assert hours_of(session_here()) == pytest.approx(found[name], rel=0, abs=0, nan_ok=True)
    assert bpy.ops.citypv.compare(name=cities["A"]) == {"FINISHED"}
    again = sums_here()
    assert again["new"] == table["new"]
    assert again["existing"]["change"] == pytest.approx(table["existing"]["change"], abs=1e-3)
    assert bpy.ops.citypv.switch_city(name=cities["A"]) == {"FINISHED"}
    assert bpy.ops.citypv.compare(name=cities["B"]) == {"FINISHED"}
    back = sums_here()
    assert back["existing"]["change"] == pytest.approx(-table["existing"]["change"], abs=1e-3)
    assert back["gone"]["before"] == pytest.approx(table["new"]["after"])
    assert 0 < back["existing"]["error"] < 3 * table["existing"]["error"]
    # What is kept as before takes the place of the variant.
    assert find_before(bpy.context.scene, here())["citypv_variant"] == "B"
    assert bpy.ops.citypv.keep_before() == bpy.ops.citypv.compare() == {"FINISHED"}
    assert {row["change"] for row in sums_here().values()} == {0}
    assert bpy.ops.citypv.delete_variant(name=cities["B"]) == {"FINISHED"}
    assert "tower" not in bpy.data.objects and len(list_cities(bpy.context.scene)) == 2
    refuse("delete_variant", "there is no such city", name="D")


@pytest.mark.slow
def test_what_was_added_comes_and_goes_with_its_city(traced, row_file):
    name, tower = here().name, add_tower()
    run("add_to_city")
    hours = hours_of(session_here())
    run("import_city", "classify", city_path=str(row_file))
    assert here().name != name and not tower.visible_get() and describe_edit(here()) == ("", "")
    assert bpy.ops.citypv.switch_city(name=name) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert here().name == name and tower.visible_get() and describe_edit(here()) == ("", "")
    assert hours_of(session_here()) == pytest.approx(hours, rel=0, abs=0, nan_ok=True)


@pytest.mark.slow
def test_what_was_kept_as_before_gets_the_light_that_the_edited_city_asks_for(addon, tmp_path):
    """A house with walls beside a level roof calls for Perez's sky: before is that roof
    under it.
    """
    roof = write_gml(tmp_path / "roof.gml", house("low", (0, 0), (20, 20, 0.3), ridge=0))
    run("solar_city", city_path=str(roof), samples=32, shadow_samples=4, days=4)
    session, before = session_here(), hours_of(session_here())
    assert not session.transfer.sources
    base = session.base
    add_tower()
    run("add_to_city")
    assert (
        session_here().base.decisions.plan["sky"] == "perez" and session_here().base.before is None
    )
    kept = find_before(bpy.context.scene, here())
    perez = match_light(base, "perez", session_here().base.decisions.bounces).transfer
    expected = compute_energy(perez, session.weather, session.request).full_load_hours
    known = np.isfinite(expected)
    assert known.any() and np.abs(expected - list(before.values()))[known].max() > 1
    assert Session.of(kept).energy.full_load_hours == pytest.approx(expected, nan_ok=True)
    shown = read_face_attribute(kept.data, "full_load_hours")
    assert np.nanmax(shown) == pytest.approx(np.nanmax(expected), rel=1e-5)
    assert session_here().change[0] is Session.of(kept).base
    tower = bpy.data.objects["tower"]
    tower.location.x += 30
    update()
    assert (
        session_here().change[0] is Session.of(kept).base
    )  # both have it now: nothing is solved again
