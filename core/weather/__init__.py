"""Weather of one or more years: readers for all formats, checks, and the built-in climate.

In: a file, or a place for the climate and the clear sky. Out: a Weather in UTC. Read first:
read_weather.py.
"""

DOORS = (
    "add_sun.add_sun",
    "check_weather.LIMITS",
    "check_weather.check_weather",
    "check_weather.check_years",
    "climate.INTERVAL",
    "climate.LABEL",
    "climate.clear_sky",
    "climate.hours_of_year",
    "climate.look_up_altitude",
    "climate.make_climates",
    "climate_grid.LEAST_LATITUDE",
    "climate_grid.is_land",
    "formats.FORMATS",
    "formats.recognise_weather",
    "formats.suffixes_of_weather",
    "read_era5.NEEDED",
    "read_era5.convert_era5",
    "read_era5.open_era5_grid",
    "read_era5.read_block",
    "read_weather.check_sources",
    "read_weather.read_weather",
    "sources.ASKED_BY_KEY",
    "sources.parse_asked",
    "weather.Record",
    "weather.Weather",
)
