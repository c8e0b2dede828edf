"""Presets, switches of effects, module search, preferences, menus: each does what the command line
does.
"""

from types import SimpleNamespace

import bpy
import pytest
from steps import refuse, run

from citypv.citypv_addon import CLASSES
from citypv.citypv_addon.menus import GROUPS
from citypv.core.commands.command_line import build_parser, read_request
from citypv.core.effects.table import TABLE
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import declared_settings
from citypv.operators.city import preferences as preferences_module
from citypv.operators.city import read_settings as read_settings_module
from citypv.operators.city.keys import Key
from citypv.operators.city.preferences import folder_of_answers
from citypv.operators.city.read_settings import read_settings, state_of_step
from citypv.operators.city.run_step import in_panel_words
from citypv.operators.run.plan_trace import find_preset, read_plan

# Operators of a row.
INNER = {
    "cancel",
    "copy_group",
    "delete_variant",
    "explain_effect",
    "switch_city",
}
INNER |= {"ask_place", "drop_albedo", "drop_horizon", "drop_terrain", "drop_weather"}


@pytest.mark.parametrize("preset", ["draft", "standard", "reference"])
def test_a_preset_is_that_of_the_command_line(addon, preset):
    addon.samples, addon.days, addon.patch_size = 17, 3, 3.0
    assert bpy.ops.citypv.use_preset(preset=preset) == {"FINISHED"}
    assert find_preset(addon) == preset
    request = read_settings(addon)
    options = build_parser().parse_args(
        ["simulate", "city.gml", "--out", "out", "--preset", preset]
    )
    implied = read_request(options)
    for name in ("samples", "shadow_samples", "suns"):
        assert getattr(request, name) == getattr(implied, name)
    assert (request.patch_size, request.max_bounces) == (
        (5.0, 5) if preset == "reference" else (10.0, None)
    )
    addon.samples += 1
    assert find_preset(addon) == ""


def test_reflections_are_left_to_the_program_by_a_switch(addon):
    assert addon.auto_max_bounces
    assert read_settings(addon).max_bounces is None
    addon.auto_max_bounces = False
    assert read_settings(addon).max_bounces == addon.max_bounces > 0
    addon.max_bounces = 5
    addon.auto_max_bounces = True
    assert read_settings(addon).max_bounces is None


def test_every_setting_has_words_and_its_unit(addon):
    declared = {name: details for name, _, details in declared_settings()}
    seeing = bpy.context.scene.citypv_seeing
    for group in (addon, seeing):
        for one in group.bl_rna.properties:
            if one.identifier in ("rna_type", "name"):
                continue
            assert len(one.description) > 8, one.identifier
            assert all(item.description for item in getattr(one, "enum_items", ())), one.identifier
    for name, details in declared.items():
        if details.title and details.unit:
            one = addon.bl_rna.properties[name]
            told = (
                one.subtype in ("DISTANCE", "PERCENTAGE")
                or f"[{details.unit}]" in one.name + one.description
            )
            assert told, name


@pytest.mark.slow
def test_plan_and_predictions_of_a_city(addon, city_file):
    refuse("plan_effects", "Classify the city first")
    city = run(
        "import_city",
        "classify",
        "plan_effects",
        "predict",
        city_path=str(city_file),
        effect_far_ground="off",
    )
    plan = read_plan(city)
    assert set(plan) == set(TABLE)
    assert plan["far-ground"][0].startswith("off")
    assert plan["temperature"][0].startswith("on")
    assert bpy.ops.citypv.explain_effect(effect="reflections") == {"FINISHED"}
    refuse("explain_effect", "'wind' is no effect", effect="wind")
    prices = city[Key.PREDICTED]
    assert list(prices) == ["draft", "standard", "reference"]
    assert prices["draft"][0] < prices["reference"][0]
    assert prices["draft"][1] > prices["reference"][1] > 0
    remembered = state_of_step(city, "trace", addon)
    assert remembered == "next"


@pytest.mark.slow
def test_a_switched_effect_makes_its_step_stale(addon, city_file):
    city = run("solar_city", city_path=str(city_file), samples=16, shadow_samples=2, days=1)
    assert set(read_plan(city)) == set(TABLE)
    addon.effect_temperature = "off"
    assert [state_of_step(city, step, addon) for step in ("trace", "energy")] == ["done", "stale"]
    addon.effect_temperature, addon.effect_perez = "auto", "off"
    assert [state_of_step(city, step, addon) for step in ("trace", "energy")] == ["stale", "stale"]


def test_preferences_are_what_a_new_scene_begins_with(addon, monkeypatch, tmp_path):
    preferences = SimpleNamespace(
        weather="clear-sky", weather_file="", threads=3, cache_folder=str(tmp_path)
    )
    for module in (read_settings_module, preferences_module):
        monkeypatch.setattr(module, "find_preferences", lambda: preferences)
    preferences_module.choose_weather(addon)
    assert addon.weather == "clear-sky"
    addon.weather = "climate"
    preferences_module.choose_weather(addon)
    assert addon.weather == "climate"
    assert read_settings(addon).threads == 3
    addon.threads = 1
    assert read_settings(addon).threads == 1
    monkeypatch.delitem(preferences_module.sys.modules, "numba", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    preferences_module.use_cache_folder()
    assert preferences_module.os.environ["NUMBA_CACHE_DIR"] == str(tmp_path)


def test_every_operator_is_in_the_menu_that_f3_searches(addon):
    listed = {name for group in GROUPS for name in group}
    own = {item for item in CLASSES if issubclass(item, bpy.types.Operator)}
    assert {item.bl_idname.partition(".")[2] for item in own} == listed | INNER
    for item in own:
        kind = getattr(bpy.ops.citypv, item.bl_idname.partition(".")[2]).get_rna_type()
        assert kind.name and len(kind.description) > 15, item


def test_weather_without_a_place_is_given_one(addon, tmp_path):
    addon.weather, addon.weather_file = "file", str(tmp_path / "year.csv")
    assert read_settings(addon).weather_place is None
    addon.weather_place = "52.38, 13.06"
    assert read_settings(addon).weather_place == (52.38, 13.06)
    addon.weather_place = "Potsdam"
    with pytest.raises(
        InputError,
        match="Measured at: 'Potsdam' is not a latitude and a longitude; give two numbers",
    ):
        read_settings(addon)
    addon.weather = "climate"
    assert read_settings(addon).weather_place is None


@pytest.mark.parametrize(
    ("told", "shown"),
    [
        (
            "trace --suns sky-grid:N, or --allow-distance 9560",
            "trace with Suns: Sky grid, or Within [km] 9560",
        ),
        ("give --weather-place LATITUDE LONGITUDE", "give Measured at (latitude and longitude)"),
        (
            "give its location with --latitude D --longitude D",
            "give its location with Own location",
        ),
        ("citypv simulate CITY --out DIR", "citypv simulate CITY --out DIR"),
    ],
)
def test_errors_name_what_the_panel_has(told, shown):
    assert in_panel_words(told) == shown


def test_the_time_axis_is_that_of_the_command_line(addon):
    assert read_settings(addon).time_axis == "file"
    addon.time_axis = "+01:00"
    assert read_settings(addon).time_axis == "+01:00"
    addon.time_axis = ""
    assert read_settings(addon).time_axis == "file"


def test_work_asks_blender_for_no_folder(addon, tmp_path):
    """Answers of services are kept beside the file that was open when the settings were read."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "city.blend"))
    read_settings(addon)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert folder_of_answers() == tmp_path / "asked_weather"
