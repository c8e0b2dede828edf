"""From relative irradiance and weather to capacity factors and full load hours, of the year and of
each hour.

In: a Transfer, a Weather, a module. Out: an Energy, a Timeline. Read first: compute_energy.py.
"""
