"""Capacity factors of traced environments at every point of a weather grid, and their maps.

In: Transfers with a sky grid, weather of many places. Out: World, world.nc, pictures. Read first:
compute_world.py.
"""

DOORS = (
    "compute_world.compute_world",
    "compute_world.empty_world",
    "draw_world.draw_world",
    "environment.read_environments",
    "group_errors.add_mix",
    "group_errors.parse_mix",
    "write_world.write_world",
)
