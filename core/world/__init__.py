"""Capacity factors of traced environments at every point of a weather grid.

In: Transfers with a sky grid, weather of many places. Out: World, world.nc. Read first: compute_world.py.
"""
