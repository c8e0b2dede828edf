"""Errors in the words of the panel: a setting has a title there, and an option on the command line."""

import re

from ..core.settings.request import declared_settings, option_of

PHRASES = {  # of the command line -> of properties that have another type in the panel; the longer ones first
    "--latitude D --longitude D": "Own location",
    "--weather-place LATITUDE LONGITUDE": "Measured at (latitude and longitude)",
    "--suns sky-grid:N": "with Suns: Sky grid",
    "--weather climate": "Weather: Climate",
    "--horizon FILE": "a file as Horizon",
    "--weather-place": "Measured at",
    "--albedo-file": "Albedo from: File",
    "--terrain": "Ground: Terrain",
    "--latitude": "Latitude",
    "--longitude": "Longitude",
    "--horizon": "Horizon",
    "--suns": "Suns",
    "--lod": "LoD",
}


def in_panel_words(text):
    """Text in which options of the command line are the titles of the panel, where it has them.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
    """
    titles = {option_of(name): details.title for name, _, details in declared_settings() if details.title}
    words = re.sub("|".join(rf"{phrase}(?![a-z-])" for phrase in PHRASES), lambda found: PHRASES[found[0]], str(text))
    return re.sub(r"--[a-z][a-z-]*", lambda found: titles.get(found[0], found[0]), words)
