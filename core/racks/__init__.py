"""Racks: rows of modules on flat roofs, as geometry that shades and has results of its own.

In: a Scene and what --racks asks for. Out: the Scene with its racks. Read first: lay_racks.py.
"""
