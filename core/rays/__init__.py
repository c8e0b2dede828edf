"""Rays: where they start, in which directions, and what they hit, by Embree; loops compiled ahead.

In: triangles, ray origins, directions. Out: hit triangles, barycentric weights, visibility. Read
first: ray_scene.py.
"""
