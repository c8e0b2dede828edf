"""The built-in climate: long-term means of every place on land, and synthetic years generated from them.

In: latitude and longitude, a seed. Out: arrays of irradiance, temperature and wind. Read first: make_climates.py.
"""
