"""Flat roofs with racks on them."""

import numpy as np
from cities import make_city

from citypv.core.run.study import make_scene
from citypv.core.settings.request import Request

BERLIN = 52.5, 13.4


def scene_with(racks, polygons, **more):
    """Scene of polygons at a place, Berlin unless said otherwise."""
    settings = {
        "latitude": BERLIN[0],
        "longitude": BERLIN[1],
        "ground": "none",
        "patch_size": 10.0,
    } | more
    return make_scene(make_city(polygons), Request(racks=racks, **settings))


def roof(*outline, holes=(), height=10.0):
    """A flat roof alone."""
    return [
        ("b", "RoofSurface", [[(*place, height) for place in ring] for ring in (outline, *holes)])
    ]


def rectangle(width, depth, **more):
    """A flat roof alone, from the origin to the north-east."""
    return roof((0, 0), (width, 0), (width, depth), (0, depth), **more)


def rows_of(scene):
    """Rows that are racks: (k,) int."""
    return np.flatnonzero(scene.surfaces.kind == "rack")


def fronts_in(scene):
    """Corners of the fronts as the city has them, (k, 4, 3) [m]."""
    return scene.racks + np.array(scene.site.origin)
