"""The sky and the horizon: how the sky's light is shared out, and what distant terrain hides of
sky and sun.

In: a Weather; a file of heights or angles. Out: SkyParts, HorizonBand, TerrainHorizon, SunlitYear.
Read first: sky_models.py, then horizon.py.
"""
