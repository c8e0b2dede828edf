"""The sky and the horizon: how the sky's light is shared out, and what distant terrain hides of
sky and sun.

In: a Weather; a file of heights or angles. Out: SkyParts, HorizonBand, TerrainHorizon.
Read first: sky_models.py, then horizon.py.
"""

DOORS = (
    "horizon.TerrainHorizon",
    "horizon.is_above",
    "horizon_band.HorizonBand",
    "horizon_band.SOURCES",
    "read_horizon.check_horizon",
    "read_horizon.read_horizon",
    "sky_models.RAYS_SHARE",
    "sky_models.SkyParts",
    "sky_models.choose_sky",
    "sky_models.model_traced",
    "sky_models.sources_of",
    "sky_models.split_sky",
)
