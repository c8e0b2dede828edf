"""Patches: the triangles that receive and reflect light, and which parts of them lie inside or under something.

In: a Scene. Out: Patches, covered cells, a FacingScene that rays can be sent into. Read first: patches.py.
"""
