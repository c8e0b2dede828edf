"""Preferences of the add-on: what new scenes begin with, and what holds for all."""

import os
import sys
from pathlib import Path

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ...core.weather.formats import FORMATS, suffixes_of_weather
from ...core.weather.sources import ASKED_BY_KEY

_ADDON = __package__.rpartition(".operators")[0]  # its name in Blender
_FILES = f"One of {len(FORMATS)} formats, told by their content: {', '.join(suffixes_of_weather())}"


class WeatherSettings:
    """Mixin of a scene's settings and of the preferences, which new scenes begin with."""

    weather: EnumProperty(
        name="Weather",
        description="Source of irradiance, temperature and wind",
        items=[
            (
                "climate",
                "Climate",
                "Built-in long-term means for every location on land, with synthetic days",
            ),
            *(
                (one.key, one.title, f"Asked for with online access: {one.words}")
                for one in ASKED_BY_KEY.values()
            ),
            ("clear-sky", "Clear sky", "A year without clouds: upper bound"),
            ("file", "File", _FILES),
        ],
    )
    weather_file: StringProperty(name="File", description=_FILES, subtype="FILE_PATH")


def find_preferences():
    """Preferences of the add-on: bpy.types.AddonPreferences, or None where it was not enabled as an
    add-on.
    """
    addon = bpy.context.preferences.addons.get(_ADDON)
    return addon.preferences if addon is not None else None


def use_cache_folder(_preferences=None, _context=None):
    """Keep the compiled loops in the preferred folder (`update` of the property). Has an effect
    before the first of them is called.
    """
    preferences = find_preferences()
    folder = bpy.path.abspath(preferences.cache_folder) if preferences is not None else ""
    if folder and "numba" not in sys.modules:
        os.environ["NUMBA_CACHE_DIR"] = folder


class Preferences(WeatherSettings, bpy.types.AddonPreferences):
    """What new scenes begin with, and what holds for all."""

    bl_idname = _ADDON

    threads: IntProperty(
        name="Threads", description="Where a scene gives none; 0: all processors", min=0
    )
    cache_folder: StringProperty(
        name="Cache",
        description="Folder that keeps the loops compiled for this computer; empty: beside the "
        "add-on. "
        "A change has effect when Blender starts again",
        subtype="DIR_PATH",
        update=use_cache_folder,
    )

    def draw(self, context):
        """Show them."""
        self.layout.use_property_split = True
        column = self.layout.column()
        column.prop(self, "weather")
        if self.weather == "file":
            column.prop(self, "weather_file")
        column.prop(self, "threads")
        column.prop(self, "cache_folder")


def choose_weather(settings):
    """Let a scene in which no weather was chosen yet begin with the preferred one."""
    preferences = find_preferences()
    if preferences is not None and not settings.is_property_set("weather"):
        settings.weather, settings.weather_file = preferences.weather, preferences.weather_file


_answers = {}  # "folder": of `folder_of_answers`


def folder_of_answers():
    """Where answers of weather services are kept: beside the .blend file, else for this run of
    Blender.

    As it was when settings were read last, in Blender's thread: work in another one may ask for it.
    """
    return _answers["folder"]


def note_folder():
    """Note, in Blender's thread, where answers of weather services are kept."""
    beside = Path(bpy.data.filepath).parent if bpy.data.filepath else Path(bpy.app.tempdir)
    _answers["folder"] = beside / "asked_weather"
