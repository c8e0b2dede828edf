"""The sun: where it stands, which positions are traced, and which of them stand for an hour.

In: times and a place. Out: Suns, SunMatch, SkyTriangles. Read first: solar_position.py, then
sun_sampling.py.
"""

DOORS = (
    "sky_grid.SkyTriangles",
    "sky_grid.sky_grid_suns",
    "solar_position.MINIMUM_ELEVATION",
    "solar_position.POSITION",
    "solar_position.geocentric_sun",
    "solar_position.is_sunny",
    "solar_position.local_middle",
    "solar_position.solar_position",
    "solar_position.sun_direction",
    "solar_position.sun_of_place",
    "sun_sampling.choose_suns",
    "sun_sampling.match_suns",
    "sun_sampling.parse_sampling",
    "sun_sampling.weigh_by_year",
    "suns.Suns",
    "suns.TimeAxis",
)
