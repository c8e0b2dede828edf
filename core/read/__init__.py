"""Readers of city models and terrain: CityGML, CityJSON, OBJ, TIN relief, rasters.

In: paths. Out: a City (polygons in metres with an import report) or a Terrain. Read first:
read_city.py.
"""

DOORS = (
    "footprint_heights.HeightHints",
    "formats.DROPPED",
    "formats.READ",
    "formats.SUFFIXES",
    "netcdf_file.check_hdf5",
    "netcdf_file.netcdf_file",
    "netcdf_file.open_netcdf",
    "netcdf_file.refuse_links",
    "netcdf_file.rename_groups",
    "open_input.open_input",
    "open_input.open_text",
    "open_input.open_zip",
    "open_input.read_rows",
    "open_input.read_text",
    "parse_json.speaks_of_cityjson",
    "read_city.read_city",
    "read_districts.read_districts",
    "read_heights.is_placed_raster",
    "read_heights.read_heights",
    "read_terrain.read_terrain",
)
