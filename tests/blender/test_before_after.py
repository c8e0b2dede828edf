"""Before and after: differences of two results by surface id, and what is shown of them."""

import bpy
import numpy as np
import pytest
from steps import colours_of, run

from citypv.operators.attributes import read_face_attribute
from citypv.operators.picture.colour_faces import colours_of_values, read_scale
from citypv.operators.result.compare_results import find_before
from citypv.operators.session import find_city, find_session, list_cities

HOURS, CHANGE = "full_load_hours", "change_of_full_load_hours"


def compute(path, **changes):
    return run("solar_city", city_path=str(path), samples=32, shadow_samples=4, days=4, **changes)


def by_id(city, name):
    """Values of the surfaces by their ids."""
    ids, faces = find_session(city).transfer.surfaces.surface_id, read_face_attribute(city.data, "surface")
    return {ids[row]: value for row, value in zip(faces.tolist(), read_face_attribute(city.data, name), strict=True)}


def test_the_difference_is_after_minus_before(addon, city_file):
    city = compute(city_file, albedo=0.2)
    before, energy = by_id(city, HOURS), dict(city["citypv_energy_totals"])
    run("keep_before")
    city = compute(city_file, albedo=0.6)
    after, change = by_id(city, HOURS), by_id(city, CHANGE)
    for name, value in change.items():
        assert np.isnan(value) == np.isnan(before[name])
        assert np.isnan(value) or value == pytest.approx(after[name] - before[name], abs=0.01)
    walls = [name for name in change if "Wall" in name]
    assert all(change[name] > 0 for name in walls)  # brighter walls light each other
    assert city["citypv_colour_attribute"] == CHANGE
    assert city["citypv_colour_low"] == -city["citypv_colour_high"] < 0
    rows = dict(row.split("|", 1) for row in city["citypv_changes"])
    told = [float(text.replace("−", "-")) for text in rows["All"].split("|")]
    now = city["citypv_energy_totals"]["All"]
    assert told[:2] == pytest.approx([energy["All"], now], abs=0.51)  # written without decimals
    assert told[2] == pytest.approx(now - energy["All"], abs=0.051)
    assert city["citypv_matched"] == "21 surfaces matched by id; grey: 0 new"


def test_a_tower_takes_light_and_is_grey_itself(addon, city_file, tower_file):
    city = compute(city_file)
    before = by_id(city, HOURS)
    bpy.ops.citypv.keep_before()
    city = compute(tower_file)
    change = by_id(city, CHANGE)
    assert all(np.isnan(value) for name, value in change.items() if name.startswith("tower"))
    south = next(name for name in before if name.startswith("house0_Roof") and change[name] < -0.1 * before[name])
    assert south
    assert city["citypv_matched"].startswith("21 surfaces matched by id; grey: 7 new")
    # Its grey is the material of missing results.
    material = {city.data.materials[face.material_index].name for face in city.data.polygons}
    assert "CityPV missing" in material
    # And without it again: seven surfaces are gone.
    bpy.ops.citypv.forget_before()
    bpy.ops.citypv.keep_before()
    city = compute(city_file)
    assert city["citypv_matched"] == "21 surfaces matched by id; grey: 0 new; 7 are gone"


def test_before_is_kept_in_the_file_and_shown_beside_the_city(addon, city_file, tmp_path):
    compute(city_file, albedo=0.2)
    bpy.ops.citypv.keep_before()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "street.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "street.blend"))
    stage = bpy.context.scene
    city, before = find_city(stage)[0], find_before(stage)
    assert before.hide_viewport
    assert list_cities(stage) == [city]
    stage.citypv.weather = "clear-sky"
    run("energy")
    now, then = read_face_attribute(city.data, HOURS), read_face_attribute(before.data, HOURS)
    assert np.nanmean(now - then) > 100
    np.testing.assert_allclose(read_face_attribute(city.data, CHANGE), now - then, atol=0.01)
    stage.citypv_seeing.side_by_side = True
    bpy.context.view_layer.update()
    assert not before.hide_viewport
    assert max(corner[0] for corner in before.bound_box) + before.location.x < min(c[0] for c in city.bound_box)
    assert "citypv_colour" in before.data.color_attributes
    # Both in one scale: equal values have equal colours.
    stage.citypv.attribute = HOURS
    first = [colours_of(item.data) for item in (before, city)]
    expected = colours_of_values(read_scale(city), then)
    np.testing.assert_allclose(first[0][::3], expected, atol=0.01)
    assert not np.array_equal(*first)
    stage.citypv_seeing.side_by_side = False
    assert before.hide_viewport


def test_forgetting_removes_all_of_it(addon, city_file):
    city = compute(city_file)
    objects = set(bpy.data.objects.keys())
    bpy.ops.citypv.keep_before()
    run("compare")
    assert set(by_id(city, CHANGE).values()) <= {0.0} or np.nanmax(np.abs(list(by_id(city, CHANGE).values()))) == 0
    run("forget_before")
    assert set(bpy.data.objects.keys()) == objects
    assert "citypv_" + CHANGE not in city.data.attributes
    assert city["citypv_colour_attribute"] == HOURS
    assert not bpy.ops.citypv.compare.poll()


def test_another_city_is_not_compared(addon, city_file, row_file):
    compute(city_file)
    bpy.ops.citypv.keep_before()
    city = compute(row_file)
    assert city["citypv_colour_attribute"] == HOURS
    assert "citypv_" + CHANGE not in city.data.attributes
    with pytest.raises(RuntimeError, match="of another city: no surface has the same id"):
        bpy.ops.citypv.compare()


def test_seconds_to_halve_are_a_map_of_their_own(addon, city_file):
    city = compute(city_file)
    seconds = read_face_attribute(city.data, "seconds_to_halve")
    known = np.isfinite(read_face_attribute(city.data, HOURS))
    some = np.isfinite(seconds)
    assert some.any()
    assert not some[~known].any()
    record = find_session(city).transfer.record
    assert seconds[some].min() >= 2.9 * (sum(record.seconds.values()) - record.seconds["plan and tree"])
    addon.attribute = "seconds_to_halve"
    assert city["citypv_colour_attribute"] == "seconds_to_halve"
    addon.albedo = 0.5
    bpy.ops.citypv.trace()
    assert "citypv_seconds_to_halve" not in city.data.attributes
