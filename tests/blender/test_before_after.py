"""Before and after: differences of two results, surface by surface, and what is shown of them."""

import bpy
import numpy as np
import pytest
from small_city import write_gml
from steps import colours_of, refuse, run
from street import describe_house

from citypv.core.results.colour_map import DIVERGING, MISSING, srgb_colour
from citypv.operators.city.attributes import read_face_attribute, write_face_attribute
from citypv.operators.city.session import Session, find_city, list_cities
from citypv.operators.run.compare_results import percent_of, read_comparison
from citypv.operators.show.colour_faces import colour_faces, read_scale
from citypv.operators.show.show_result import find_before

HOURS, CHANGE = "full_load_hours", "change_of_full_load_hours"


def compute(path, **changes):
    return run("solar_city", city_path=str(path), samples=32, shadow_samples=4, days=4, **changes)


def by_id(city, name):
    """Values of the surfaces by their ids."""
    ids, faces = (
        Session.of(city).transfer.surfaces.surface_id,
        read_face_attribute(city.data, "surface"),
    )
    return {
        ids[row]: value
        for row, value in zip(faces.tolist(), read_face_attribute(city.data, name), strict=True)
    }


def read_rows(city, name):
    """Rows of a table: name -> before, after and change [MWh], change [%], NaN where there
    is none.
    """
    rows = read_comparison(city["citypv_compared"])[name]
    return {
        row["name"]: [*(row[key] for key in ("before", "after", "change")), percent_of(row)]
        for row in rows
    }


@pytest.mark.slow
def test_the_difference_is_after_minus_before(addon, city_file):
    city = compute(city_file, albedo=0.2)
    before, energy = by_id(city, HOURS), dict(city["citypv_energy_totals"])
    run("keep_before")
    city = compute(city_file, albedo=0.6)
    after, change = by_id(city, HOURS), by_id(city, CHANGE)
    for name, value in change.items():
        assert np.isnan(value) == np.isnan(before[name])
        assert np.isnan(value) or value == pytest.approx(after[name] - before[name], abs=0.01)
    walls = [name for name in change if "_roof" not in name and "_ground" not in name]
    assert all(change[name] > 0 for name in walls)  # brighter walls light each other
    assert city["citypv_colour_attribute"] == CHANGE
    assert city["citypv_colour_low"] == -city["citypv_colour_high"] < 0
    rows = read_rows(city, "sums")
    assert list(rows) == ["existing", "all"]
    now = city["citypv_energy_totals"]["All"]
    expected = [energy["All"], now, now - energy["All"], 100 * (now / energy["All"] - 1)]
    assert rows["all"] == pytest.approx(expected, abs=1e-3)
    assert city["citypv_matched"].startswith("21 surfaces matched by shape; grey: 0 new")


@pytest.mark.slow
def test_a_tower_takes_light_and_is_grey_itself(addon, city_file, tower_file):
    city = compute(city_file)
    before = by_id(city, HOURS)
    bpy.ops.citypv.keep_before()
    city = compute(tower_file)
    change = by_id(city, CHANGE)
    assert all(np.isnan(value) for name, value in change.items() if name.startswith("tower"))
    assert any(
        name.startswith("house0_roof") and change[name] < -0.1 * value
        for name, value in before.items()
    )
    assert city["citypv_matched"].startswith("21 surfaces matched by shape; grey: 7 new")
    # The sums tell the tower from its neighbours, and the one that loses most stands first.
    sums, buildings = read_rows(city, "sums"), read_rows(city, "buildings")
    assert (
        list(sums) == ["existing", "new", "all"]
        and next(iter(buildings)) == "house0"
        and "tower" in buildings
    )
    order = [cells[2] for cells in buildings.values()]
    assert order == sorted(order) and order[0] < 0 < order[-1]
    assert sums["new"][:3] == [0.0, *[pytest.approx(buildings["tower"][1])] * 2] and np.isnan(
        sums["new"][3]
    )
    assert (
        sums["existing"][2] == pytest.approx(sum(order[:-1]), abs=1e-3) and sums["existing"][2] < 0
    )
    # Its grey is the colour of missing results.
    names = [
        Session.of(city).transfer.surfaces.surface_id[row]
        for row in read_face_attribute(city.data, "surface")
    ]
    grey = np.repeat([name.startswith("tower") for name in names], 3)
    np.testing.assert_allclose(
        colours_of(city.data)[grey], np.tile(srgb_colour(MISSING), (grey.sum(), 1)), atol=0.003
    )
    # And without it again: seven surfaces are gone.
    bpy.ops.citypv.forget_before()
    bpy.ops.citypv.keep_before()
    city = compute(city_file)
    assert city["citypv_matched"].endswith("; 7 are gone")


@pytest.mark.slow
def test_surfaces_of_other_names_and_places_in_the_file_are_matched_by_their_shapes(
    addon, tmp_path
):
    """A third house far in the west moves the origin of the scene, and stands before the others in
    the file.
    """
    first, second = describe_house("a", (0, 0)), describe_house("b", (30, 0))
    compute(write_gml(tmp_path / "two.gml", first, second))
    bpy.ops.citypv.keep_before()
    origin = tuple(find_before(bpy.context.scene)["citypv_origin"])
    # The second has the first's name.
    others = [text.replace('"a', '"z').replace('"b', '"a') for text in (second, first)]
    city = compute(write_gml(tmp_path / "three.gml", describe_house("far", (-900, 0)), *others))
    assert tuple(city["citypv_origin"]) != origin
    assert city["citypv_matched"].startswith("14 surfaces matched by shape; grey: 7 new")
    change, error = by_id(city, CHANGE), by_id(city, "full_load_hours_change_standard_error")
    known = [name for name in change if np.isfinite(change[name])]
    assert len(known) == 12 and not any(name.startswith("far") for name in known)
    # 900 m away little changes but the random numbers; a wall matched with another one would differ
    # by hundreds.
    assert all(abs(change[name]) < 4 * error[name] + 1 for name in known)


@pytest.mark.parametrize(("change", "end"), [(0.0, 1.0), (-30.0, 30.0), (40.0, 40.0)])
def test_zero_is_in_the_middle_and_noise_is_grey(shown, change, end):
    """Most of the city does not change: the scale is that of what does, and the rest has the colour
    of the middle.
    """
    city, ground = shown
    values = np.where(np.isfinite(read_face_attribute(city.data, HOURS)), 0.0, np.nan)
    changed, noise, still = np.flatnonzero(np.isfinite(values))[:3]
    values[changed], values[noise] = change, 0.5
    write_face_attribute(city.data, CHANGE, values)
    write_face_attribute(
        city.data, "full_load_hours_change_standard_error", np.full(len(values), 0.3)
    )
    scale, colours = colour_faces(city, ground, CHANGE), colours_of(city.data)[::3]
    assert (scale.low, scale.high) == (-end, end)
    np.testing.assert_allclose(colours[still], srgb_colour(DIVERGING.split()[8]), atol=0.01)
    grey = colours[[noise, np.flatnonzero(np.isnan(values))[0]]]
    np.testing.assert_allclose(grey, [srgb_colour(MISSING)] * 2, atol=0.01)
    red, _, blue = colours[changed]
    assert np.sign(red - blue) == np.sign(change)  # brown gains, blue loses
    assert (colour_faces(city, ground, CHANGE, (-10.0, 20.0)).low) == -20.0


@pytest.mark.slow
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
    assert max(corner[0] for corner in before.bound_box) + before.location.x < min(
        c[0] for c in city.bound_box
    )
    assert "citypv_colour" in before.data.color_attributes
    # Both in one scale: equal values have equal colours.
    stage.citypv.attribute = HOURS
    first = [colours_of(item.data) for item in (before, city)]
    expected = read_scale(city).colours(then)
    np.testing.assert_allclose(first[0][::3], expected, atol=0.01)
    assert not np.array_equal(*first)
    stage.citypv_seeing.side_by_side = False
    assert before.hide_viewport


@pytest.mark.slow
def test_another_city_is_not_compared(addon, city_file, tmp_path):
    compute(city_file)
    bpy.ops.citypv.keep_before()
    city = compute(write_gml(tmp_path / "elsewhere.gml", describe_house("house0", (500, 0))))
    assert city["citypv_colour_attribute"] == HOURS
    assert "citypv_" + CHANGE not in city.data.attributes
    refuse("compare", "of another city: no surface has the same shape")
