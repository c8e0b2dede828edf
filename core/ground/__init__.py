"""The ground of a city: generated through the base edges of the buildings, or measured terrain.

In: the polygons of a City and, where given, a Terrain. Out: triangles. Read first: build_ground.py.
"""
