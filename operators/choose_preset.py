"""Presets: settings for a purpose, with the seconds and the error that each is predicted to have on the city."""

from dataclasses import fields
from math import isfinite

import bpy

from ..core.settings.presets import PRESET_WORDS, PRESETS
from .attributes import PREFIX
from .build_properties import UNSET
from .compile_loops import compile_loops
from .plan_effects import OfScene
from .run_step import Step
from .session import find_own_city

PRICES = PREFIX + "prices"  # property of the city
NUMBERS = {"days": "days", "typical-days": "typical_days", "sky-grid": "sky_grid"}  # way -> property with its number
ITEMS = [(name, name.capitalize(), words) for name, words in PRESET_WORDS.items()]


class UsePreset(bpy.types.Operator):
    """Set rays, suns and patches for a purpose"""

    bl_idname = "citypv.use_preset"
    bl_label = "Use preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(name="Preset", description="Settings of Trace", items=ITEMS, default="standard")

    @classmethod
    def description(cls, context, properties):
        """Tooltip: what the preset is for."""
        return PRESET_WORDS[properties.preset]

    def execute(self, context):
        """Set them."""
        settings = context.scene.citypv
        for name, value in properties_of_preset(self.preset).items():
            setattr(settings, name, value)
        self.report({"INFO"}, f"{self.preset.capitalize()}: {PRESET_WORDS[self.preset]}")
        return {"FINISHED"}


class PredictPrices(OfScene, Step, bpy.types.Operator):
    """Predict the seconds and the error of each preset on this city, from a pilot of some seconds"""

    bl_idname = "citypv.predict"
    bl_label = "Predict time and error"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def work(task, progress):
        """Trace the pilot."""
        from ..core.accuracy.price_list import list_prices
        from ..core.study import check_settings, read_year

        session, request = task
        check_settings(request)
        compile_loops(progress)
        progress("pilot", 0, 1, "pilots")
        weather = read_year(session.scene.site, request)
        listed = list_prices(session.scene, weather, request, progress=progress)
        return session, [(one.name, one.seconds, one.error) for one in listed.prices if one.name in PRESETS]

    def finish(self, context, result):
        """Store the predictions on the city."""
        session, prices = result
        city, _ = find_own_city(context.scene, session)
        city[PRICES] = [f"{name}|{seconds:.3g}|{error:.3g}" for name, seconds, error in prices]
        return "; ".join(f"{name.capitalize()}: {describe_price(row)}" for name, row in read_prices(city).items())


def properties_of_preset(preset):
    """Values of the panel's properties that a preset stands for; what it does not name is the program's default.

    Parameters
    ----------
    preset : str

    Returns
    -------
    dict
    """
    from ..core.settings.request import Request

    defaults = {one.name: getattr(Request(), one.name) for one in fields(Request)}
    named = {name for settings in PRESETS.values() for name in settings}
    chosen = {name: PRESETS[preset].get(name, defaults[name]) for name in sorted(named)}
    way, _, number = chosen.pop("suns").partition(":")
    return {name: UNSET if value is None else value for name, value in chosen.items()} | {
        "suns": way,
        NUMBERS[way]: int(number),
    }


def find_preset(settings):
    """Preset that the panel's settings are those of: str, "" if of none."""
    for name in PRESETS:
        wanted = properties_of_preset(name)
        if all(getattr(settings, key) == value for key, value in wanted.items()):
            return name
    return ""


def read_prices(city):
    """Predictions stored on a city: dict of preset to (seconds, error [%]); empty without them."""
    rows = city.get(PRICES, ()) if city is not None else ()
    return {name: (float(seconds), float(error)) for name, seconds, error in (row.split("|") for row in rows)}


def describe_price(price):
    """Seconds and error in a few words."""
    seconds, error = price
    time = f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
    return f"{time}, ± {error:.2g} %" if isfinite(error) else time  # NaN where nothing is eligible
