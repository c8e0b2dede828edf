"""Ray tracing with Embree: closest hits and shadow rays, in packets or as single rays.

In: triangles, ray origins, directions. Out: hit triangles, barycentric weights, visibility. Read first: ray_scene.py.
"""
