"""Readers of city models and terrain: CityGML, CityJSON, OBJ, TIN relief, rasters.

In: paths. Out: a City (polygons in metres with an import report) or a Terrain. Read first:
read_city.py.
"""
