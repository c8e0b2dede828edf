"""From relative irradiance and weather to capacity factors and full load hours.

In: a Transfer, a Weather, a module. Out: an Energy. Read first: compute_energy.py.
"""
