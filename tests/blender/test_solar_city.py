"""From a file to full load hours with one button, and what the panel says of the steps."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from steps import here, run

from citypv.core.light import sun_blocks
from citypv.core.settings.progress import SUN_STAGE, CancelledError
from citypv.operators import run_step
from citypv.operators.attributes import read_face_attribute
from citypv.operators.city.read_settings import STEPS, state_of_step
from citypv.operators.session import find_city, find_session

WEATHER = Path(__file__).parents[1] / "data" / "weather"


@pytest.fixture
def quick(addon):
    """Settings of a quick run."""
    addon.suns, addon.typical_days, addon.samples, addon.shadow_samples = "typical-days", 1, 16, 2
    return addon


def states(settings):
    return [state_of_step(here(), step, settings) for step in STEPS]


def totals_of(city):
    rows = [row.split("|") for row in city["citypv_totals"]]
    return {name: [float(cell.replace(" ", "")) for cell in cells] for name, *cells in rows}


def test_one_button_does_what_the_steps_do(quick, city_file):
    assert states(quick) == ["next", "", "", ""]
    assert bpy.ops.citypv.solar_city(filepath=str(city_file)) == {"FINISHED"}
    city = here()
    hours = read_face_attribute(city.data, "full_load_hours")
    assert states(quick) == ["done"] * 4
    assert (quick.attribute, city["citypv_colour_attribute"]) == ("full_load_hours", "full_load_hours")
    assert "climatology" in city["citypv_weather"]
    run("import_city", "classify", "trace", "energy")
    np.testing.assert_array_equal(read_face_attribute(here().data, "full_load_hours"), hours)


def test_totals_are_sums_of_roofs_and_facades(quick, city_file):
    bpy.ops.citypv.solar_city(filepath=str(city_file))
    city = here()
    totals, energy = totals_of(city), find_session(city).energy
    kwp, mwh, hours = totals["All"]
    assert kwp == pytest.approx(totals["Roofs"][0] + totals["Facades"][0], abs=1.01)  # of numbers without decimals
    assert mwh == pytest.approx(kwp * hours / 1000, rel=0.02)
    mean = np.average(energy.full_load_hours[energy.eligible], weights=energy.counted_area[energy.eligible])
    assert hours == pytest.approx(mean, rel=0.01)
    assert totals["Roofs"][2] > totals["Facades"][2]


def test_a_changed_setting_makes_its_step_and_those_after_it_stale(quick, city_file):
    bpy.ops.citypv.solar_city(filepath=str(city_file))
    quick.albedo = 0.4
    assert states(quick) == ["done", "done", "stale", "stale"]
    quick.albedo = 0.25
    assert states(quick) == ["done"] * 4
    quick.weather = "clear-sky"
    assert states(quick) == ["done", "done", "done", "stale"]
    bpy.ops.citypv.energy()
    assert states(quick) == ["done"] * 4
    bpy.ops.citypv.classify()
    assert states(quick) == ["done", "done", "next", ""]


def test_a_cancelled_run_keeps_its_suns_and_weighs_them(quick, city_file, monkeypatch):
    quick.typical_days = 6
    monkeypatch.setattr(sun_blocks, "SUNS_PER_BLOCK", 12)

    def cancel(stage, done, total, unit):
        if stage == SUN_STAGE and done >= total / 2:
            raise CancelledError

    monkeypatch.setattr(run_step, "silent", cancel)
    assert bpy.ops.citypv.solar_city(filepath=str(city_file)) == {"FINISHED"}
    city = here()
    assert city["citypv_interrupted"].startswith("Interrupted: kept ")
    assert np.isfinite(read_face_attribute(city.data, "full_load_hours")).any()


def test_a_dropped_weather_file_is_used_at_once(quick, city_file):
    bpy.ops.citypv.solar_city(filepath=str(city_file))
    quick.allow_distance = 1400
    path = str(WEATHER / "USA_NY_New.York-CentralPark_TMY3.epw.gz")
    assert bpy.ops.citypv.drop_weather(filepath=path) == {"FINISHED"}
    assert (quick.weather, quick.weather_file) == ("file", path)
    assert "km away" in here()["citypv_weather_place"]


def test_files_can_be_dropped(addon):
    dropped = {item.bl_idname: item for item in bpy.types.FileHandler.__subclasses__() if "CITYPV" in item.bl_idname}
    assert {".gml", ".json", ".jsonl", ".obj"} <= set(dropped["CITYPV_FH_city"].bl_file_extensions.split(";"))
    assert {".epw", ".nc"} <= set(dropped["CITYPV_FH_weather"].bl_file_extensions.split(";"))
    for item in dropped.values():
        assert getattr(bpy.ops.citypv, item.bl_import_operator.partition(".")[2]).get_rna_type()


def test_materials_need_an_imported_city(quick, city_file):
    quick.albedo_source = "materials"
    with pytest.raises(RuntimeError, match="Albedo: the faces have no materials before the city is imported"):
        bpy.ops.citypv.solar_city(filepath=str(city_file))
    assert find_city(bpy.context.scene) == (None, None)
