"""Readers of city models and terrain: CityGML, CityJSON, OBJ, TIN relief, rasters.

In: paths. Out: a City (polygons in metres with an import report) or a Terrain. Read first:
read_city.py.
"""

DOORS = (
    "formats.DROPPED",
    "formats.READ",
    "formats.SUFFIXES",
    "open_input.FREE_BYTES",
    "open_input.LARGEST_GAIN",
    "open_input.open_input",
    "open_input.open_text",
    "open_input.read_text",
    "open_input.suffix_of",
    "open_netcdf.ENGINE",
    "open_netcdf.check_hdf5",
    "open_netcdf.open_netcdf",
    "open_netcdf.refuse_links",
    "open_netcdf.rename_groups",
    "parse_json.speaks_of_cityjson",
    "read_city.read_city",
    "read_heights.open_placed",
    "read_heights.read_heights",
    "read_terrain.RASTERS",
    "read_terrain.RELIEFS",
    "read_terrain.read_terrain",
)
