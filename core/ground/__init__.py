"""The ground a city stands on: generated through the feet of the buildings, or measured terrain.

In: the polygons of a City and, where given, a Terrain. Out: triangles. Read first: build_ground.py.
"""
