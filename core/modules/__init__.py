"""Modules as they are mounted: rows of rectangles on the polygons of a city.

In: outlines of surfaces, their open part, the size of a module, storeys and windows. Out: a
ModuleLayout. Read first: lay_modules.py.
"""

DOORS = ()
