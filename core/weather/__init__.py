"""Weather of one or more years: readers for all formats, checks, and the built-in climate.

In: a file, or a place for the climate and the clear sky. Out: a Weather in UTC, or a Source of the
weather of many places (find_source.py). Read first: read_weather.py.
"""

DOORS = (
    "check_weather.LIMITS",
    "climate_grid.is_land",
    "find_source.check_source",
    "find_source.find_source",
    "find_source.refuse_settings",
    "formats.FORMATS",
    "formats.suffixes_of_weather",
    "grid_sources.MEANINGS",
    "grid_sources.Places",
    "read_weather.check_sources",
    "read_weather.read_weather",
    "sources.ASKED_BY_KEY",
    "weather.Weather",
)
