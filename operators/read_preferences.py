"""Preferences of the add-on: what a new scene begins with, threads, and the folder of the compiled loops."""

import os
import sys

import bpy

ADDON = __package__.rpartition(".")[0]
WEATHER = ("weather", "weather_file")


def find_preferences():
    """Preferences of the add-on: bpy.types.AddonPreferences, or None where it was not enabled as an add-on."""
    addon = bpy.context.preferences.addons.get(ADDON)
    return addon.preferences if addon is not None else None


def read_threads(settings, preferences):
    """Number of threads of the scene, else of the preferences: int, or None for all processors."""
    return settings.threads or (preferences.threads if preferences is not None else 0) or None


def choose_weather(settings, preferences):
    """Let a scene in which no weather was chosen yet begin with the preferred one."""
    if preferences is None or settings.is_property_set("weather"):
        return
    for name in WEATHER:
        setattr(settings, name, getattr(preferences, name))


def use_cache_folder(preferences):
    """Keep the compiled loops in the preferred folder. Has an effect before the first of them is called."""
    folder = bpy.path.abspath(preferences.cache_folder) if preferences is not None else ""
    if folder and "numba" not in sys.modules:
        os.environ["NUMBA_CACHE_DIR"] = folder
