"""Patches: the triangles that receive and reflect light, and which parts of them lie inside or under something.

In: a Scene. Out: Patches, covered cells, and a FacingScene for tracing rays. Read first: patches.py.
"""
