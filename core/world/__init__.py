"""Capacity factors of traced environments at every point of a weather grid, and their maps.

In: Transfers with a sky grid, weather of many places. Out: World, world.nc, pictures. Read first:
compute_world.py.
"""
