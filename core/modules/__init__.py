"""Modules as they are mounted: rows of rectangles on the polygons of a city.

In: outlines of surfaces, their open part, the size of a module, storeys and windows. Out: a
ModuleLayout. Read first: lay_modules.py.
"""

DOORS = (
    "lay_city.LayoutRules",
    "lay_city.OPENINGS",
    "lay_city.lay_city",
    "lay_modules.ModuleLayout",
    "read_facades.check_facades",
    "read_facades.read_facades",
)
