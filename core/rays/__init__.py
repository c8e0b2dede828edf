"""Embree behind one small interface: closest hits and shadow rays, by packets or single rays.

In: triangles, ray origins, directions. Out: hit triangles, barycentric weights, visibility. Read first: ray_scene.py.
"""
