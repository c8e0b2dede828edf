"""From a file to full load hours with one button, and what the panel says of the steps."""

from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from steps import here, refuse, run

from citypv.core.energy.pv_system import build_system
from citypv.core.results.write_buildings import sum_buildings
from citypv.core.results.write_summary import sum_totals
from citypv.core.settings.progress import CancelledError
from citypv.core.settings.request import Request
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.read_settings import STEPS, read_settings, state_of_step
from citypv.operators.city.run_step import Step
from citypv.operators.city.session import Session, find_city
from citypv.operators.run.solar_city import SolarCity, settings_of_look
from citypv.operators.run.summarise import summarise_energy
from citypv.operators.show.probe_faces import describe_surfaces
from citypv.operators.show.show_building import read_best

WEATHER = Path(__file__).parents[1] / "data" / "weather"
FIRST_LOOK = "First look, by 16 rays, 4 shadow points and 4 days. "


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


@pytest.mark.slow
def test_one_button_does_what_the_steps_do(quick, city_file):
    assert states(quick) == ["next", "", "", ""]
    assert bpy.ops.citypv.solar_city(filepath=str(city_file)) == {"FINISHED"}
    city = here()
    hours = read_face_attribute(city.data, "full_load_hours")
    assert states(quick) == ["done"] * 4
    assert (quick.attribute, city["citypv_colour_attribute"]) == (
        "full_load_hours",
        "full_load_hours",
    )
    assert "climatology" in city["citypv_weather"]
    assert "facade south|3|" in " ".join(city["citypv_groups"])
    assert bpy.context.scene.view_settings.view_transform == "Standard"
    # Totals are sums of all kinds.
    totals, energy = totals_of(city), Session.of(city).energy
    (kwp, mwh, mean), *kinds = totals.values()
    assert kwp == pytest.approx(
        sum(one[0] for one in kinds), abs=0.51 * len(totals)
    )  # of numbers without decimals
    assert mwh == pytest.approx(kwp * mean / 1000, rel=0.02)
    expected = np.average(
        energy.full_load_hours[energy.eligible], weights=energy.kwp[energy.eligible]
    )
    assert mean == pytest.approx(expected, rel=0.01)
    assert (
        totals["Pitched roofs"][2] > totals["Facades"][2]
        and energy.eligible[(energy.kind == "flat") & (energy.counted_area > 0)].all()
    )
    run("import_city", "classify", "trace", "energy")
    np.testing.assert_array_equal(read_face_attribute(here().data, "full_load_hours"), hours)


@pytest.mark.slow
def test_several_years_have_a_line_for_half_and_for_nine_in_ten_of_them(quick, city_file):
    """Of two years, one a tenth below and one a tenth above, P50 is the mean and P90 the
    lower one.
    """
    bpy.ops.citypv.solar_city(filepath=str(city_file))
    city, session = here(), Session.of(here())
    hours = session.energy.full_load_hours
    energy = replace(
        session.energy,
        full_load_hours_by_year=np.stack([0.9 * hours, 1.1 * hours], axis=1),
        years=2.0,
    )
    system = build_system(session.request)
    whole = sum_totals(session.transfer, energy, system)
    buildings = sum_buildings(session.transfer, energy, session.weather)
    told = {"kwp": energy.kwp_of_hours(session.transfer.surfaces.area), "ends": (0.0, 1000.0)}
    told |= {"place": "", "whole": whole, "buildings": buildings}
    summarise_energy(city, session.weather, energy, **told)
    mwh = whole["mwh_per_year"]
    assert city["citypv_totals"][-2:] == [
        f"P50 of 2 years|–|{mwh:,.0f}|–",
        f"P90 of 2 years|–|{0.9 * mwh:,.0f}|–",
    ]
    # And each building: in the list of the best, and where it is probed.
    for name, kwp, year, half, nine in read_best(city):
        (row,) = buildings[buildings["building_id"] == name].itertuples()
        assert (row.p50_mwh_per_year, row.p90_mwh_per_year) == pytest.approx(
            (row.mwh_per_year, 0.9 * row.mwh_per_year)
        )
        told = row.kwp, row.mwh_per_year, row.p50_mwh_per_year, row.p90_mwh_per_year
        assert (kwp, year, half, nine) == tuple(f"{one:,.1f}" for one in told)
    session.energy, (name, *_) = energy, read_best(city)[0]
    mwh = float(buildings["mwh_per_year"].max())
    rows = np.flatnonzero(np.array(session.transfer.surfaces.building_id) == name)
    told = dict(line.split("|") for line in describe_surfaces(session, rows))
    assert (told["P50"], told["P90"]) == (
        f"{mwh:,.2f} MWh per year",
        f"{0.9 * mwh:,.2f} MWh per year",
    )


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_dropped_weather_file_is_used_at_once(quick, city_file):
    bpy.ops.citypv.solar_city(filepath=str(city_file))
    quick.allow_distance = 1400
    path = str(WEATHER / "USA_NY_New.York-CentralPark_TMY3.epw.gz")
    assert bpy.ops.citypv.drop_weather(filepath=path) == {"FINISHED"}
    assert (quick.weather, quick.weather_file) == ("file", path)
    assert "km away" in here()["citypv_weather_place"]


def test_files_can_be_dropped(addon):
    dropped = {
        item.bl_idname: item
        for item in bpy.types.FileHandler.__subclasses__()
        if "CITYPV" in item.bl_idname
    }
    assert {".gml", ".json", ".jsonl", ".obj"} <= set(
        dropped["CITYPV_FH_city"].bl_file_extensions.split(";")
    )
    assert {".epw", ".nc"} <= set(dropped["CITYPV_FH_weather"].bl_file_extensions.split(";"))
    for item in dropped.values():
        assert getattr(bpy.ops.citypv, item.bl_import_operator.partition(".")[2]).get_rna_type()


def test_materials_need_an_imported_city(quick, city_file):
    quick.albedo_source = "materials"
    refuse(
        "solar_city",
        "Albedo: the faces have no materials before the city is imported",
        filepath=str(city_file),
    )
    assert find_city(bpy.context.scene) == (None, None)


# -- in a window: each result is shown while the next is computed, and kept on cancelling --

BODIES = ("refine", "finish", "_show_light")


@pytest.fixture
def watched(addon, city_file):
    """A step as a button starts it: the stand-in, and what its work is given."""
    addon.city_path = str(city_file)
    request = read_settings(addon)
    # The bodies of the operator, which only Blender can make.
    step = type(
        "Stand",
        (Step,),
        {name: SolarCity.__dict__[name] for name in BODIES} | {"bl_label": "Solar city"},
    )()
    step._found, step.kept, step.told = SimpleQueue(), [], []
    step.report = lambda level, text: step.told.append((level, text))
    return step, ([str(city_file)], request, settings_of_look(request), step._found)


@pytest.mark.slow
def test_results_are_shown_one_after_the_other_and_the_last_are_those_of_a_script(watched, addon):
    step, task = watched
    seen = {}

    def progress(stage, done, total, unit):
        # As the timer of the window does.
        step.refine(bpy.context)
        city = here()
        if city is not None:
            seen[step.kept[-1]] = (
                city.get("citypv_colour_attribute"),
                city.get("citypv_interrupted"),
            )

    result = SolarCity.work(task, progress)
    assert list(seen) == ["buildings", "kinds", "first look"]
    assert seen["kinds"][0] == "kind"
    shown, words = seen["first look"]
    assert shown == "full_load_hours" and words.startswith(FIRST_LOOK)
    city = here()
    look = read_face_attribute(city.data, "full_load_hours")
    assert len(Session.of(city).transfer.suns) < 60
    assert states(addon) == ["done", "done", "next", ""]
    step.finish(bpy.context, result)
    assert states(addon) == ["done"] * 4
    assert city["citypv_interrupted"] == ""
    hours = read_face_attribute(city.data, "full_load_hours")
    # Four days instead of 24 and a sixteenth of the rays: some hours of hundreds, and never the
    # same.
    counted = np.isfinite(hours)
    assert np.sqrt(np.mean((look - hours)[counted] ** 2)) < 0.05 * hours[counted].mean()
    assert not np.array_equal(look, hours, equal_nan=True)
    run("solar_city")
    np.testing.assert_array_equal(read_face_attribute(here().data, "full_load_hours"), hours)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "kept"),
    [
        ("classifying", "buildings"),
        ("first look", "buildings, kinds"),
        ("sky and reflections", None),
    ],
)
def test_a_cancelled_step_keeps_what_is_shown(watched, addon, stage, kept):
    step, task = watched

    def progress(now, done, total, unit):
        step.refine(bpy.context)
        if now.startswith(stage):
            raise CancelledError

    with pytest.raises(CancelledError):
        SolarCity.work(task, progress)
    step._job, step._leave = SimpleNamespace(error=CancelledError()), lambda context: None
    assert step._end(bpy.context) == {"FINISHED"}
    assert step.told == [
        ({"WARNING"}, f"Solar city was cancelled; kept: {kept or 'buildings, kinds, first look'}")
    ]
    if kept is None:  # its light can be weighed with other weather, and traced as the settings say
        run("energy", "trace", weather="clear-sky")
    elif kept == "buildings":
        run("classify")


@pytest.mark.slow
def test_rounds_are_shown_after_the_look(watched, addon):
    step, (paths, request, look, found) = watched
    request.samples, request.shadow_samples, request.target_error, seen = 64, 4, 0.6, []

    def progress(stage, done, total, unit):
        step.refine(bpy.context)
        city = here()
        if city is not None and "citypv_full_load_hours" in city.data.attributes:
            seen.append(
                (
                    np.nanmean(read_face_attribute(city.data, "full_load_hours")),
                    city["citypv_interrupted"],
                )
            )

    SolarCity.work((paths, request, look, found), progress)
    shown = list(dict.fromkeys(seen))
    assert len(shown) >= 3
    first, *others = [words for _, words in shown]
    assert first.startswith(FIRST_LOOK) and not any(others)


def test_a_look_is_taken_where_the_trace_is_much_longer():
    assert settings_of_look(Request()).suns == "days:4"
    assert settings_of_look(Request(estimator="forward")).estimator == "gather"
    assert settings_of_look(Request(samples=64, shadow_samples=4, suns="days:12")) is None
    look = settings_of_look(Request(target_error=1.0, time_budget=60.0))
    assert (look.target_error, look.time_budget) == (None, None)
