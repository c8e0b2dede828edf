"""The climate that ships with the program: long-term means of every place on land, and years drawn from them.

In: latitude and longitude, a seed. Out: arrays of irradiance, temperature and wind. Read first: make_climates.py.
"""
