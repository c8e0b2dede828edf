"""Patches: the triangles that receive and reflect light, what they reflect, and which parts of them
are covered.

In: a Scene. Out: Patches, covered cells, BRDFs, and a FacingScene for tracing rays. Read first:
patches.py.
"""
