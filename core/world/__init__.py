"""Capacity factors of traced environments at every point of a weather grid, and their maps.

In: Transfers with a sky grid, weather of many places. Out: World, world.nc, pictures. Read first:
compute_world.py.
"""

DOORS = (
    "compute_world.compute_world",
    "compute_world.empty_world",
    "compute_world.find_groups",
    "draw_world.draw_world",
    "environment.read_environments",
    "group_errors.add_mix",
    "group_errors.parse_mix",
    "merge_surfaces.merge_surfaces",
    "sources.check_region",
    "sources.grid_places",
    "sources.grid_source",
    "sources.model_source",
    "sources.regular_axes",
    "sources.station_source",
    "sources.thin_axis",
    "write_world.write_world",
)
