"""The sun, the sky and the horizon: where they stand, which suns are traced, and how the sky's
light is shared out.

In: times and a place; a Weather; a file of heights or angles. Out: Suns, SunMatch, SkyParts,
TerrainHorizon. Read first: sun_sampling.py, then sky_models.py and horizon.py.
"""
