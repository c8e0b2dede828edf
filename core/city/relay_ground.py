"""Ground of a city after an edit: that of before, but for a window around what the edit changed.

┌───────────────────┐   What the ground is at a place follows from what is near it. So it is generated for the buildings
│ before    rim     │   in a window around the edit, and those in a margin around that, alone. In the rim of the window
│   ┌───────────┐   │   it must be that of before, triangle by triangle: then it is so outside of it, and all that
│   │  ┌─────┐  │   │   differs lies inside. Else, as where an edit at the end of the city raises the ground around it,
│   │  │ edit│  │   │   all of it is generated.
│   │  └─────┘  │   │
"""

from dataclasses import replace

import numpy as np

from ..rays.random_numbers import name_rows
from .build_ground import PlacedCity, build_ground, sort_by_place
from .city import number_names, take_polygons
from .known_polygons import lost_triangles
from .polygons import drop_unused, merge_vertices, polygon_bounds
from .scene import corners_of, surface_of_triangles, take_surfaces

INNER, RIM, MARGIN = 25.0, 40.0, 110.0  # [m] around the edit, around that, and around that again
MOST = 0.5  # of the polygons; of more, all are taken


def relay_ground(placed, known, patch_size, how):
    """Ground of a city after an edit, as of `build_ground`; None where all of it is to be generated.

    Parameters
    ----------
    placed : PlacedCity
    known : Known
    patch_size : float or None [m]
    how : dict
        Further arguments of `build_ground`.
    """
    before = known.before
    if before.lattice is None or before.floating is None:
        return None
    changed = corners_of(before, lost_triangles(before, known.same)).reshape(-1, 3)
    city, points = placed.city, placed.points
    low, high = polygon_bounds(points[:, :2], city.ring_start, city.polygon_start)
    new = known.same < 0
    places = np.concatenate([changed[:, :2], low[new], high[new]])
    laid = drop_unused(np.asarray(before.vertices, float), before.triangles[surface_of_triangles(before) < 0])
    if not len(places):
        return *laid, number_floating(known), before.lattice
    inner = places.min(axis=0) - INNER, places.max(axis=0) + INNER
    rim = inner[0] - RIM, inner[1] + RIM
    building = number_names(city.building_id)
    near = ((low <= rim[1] + MARGIN) & (high >= rim[0] - MARGIN)).all(axis=1)
    rows = np.flatnonzero(np.bincount(building, near)[building] > 0)
    if len(rows) > MOST * len(city):
        return None
    vertices, triangles, hanging, lattice = build_ground(take_placed(placed, rows), patch_size, **how)
    if lattice is not before.lattice:
        return None
    parts = [(one, lie_in(one, rim), lie_in(one, inner)) for one in (laid, (vertices, triangles))]
    names = [np.sort(name_rows([one[0][one[1][wide & ~deep]]])) for one, wide, deep in parts]
    if not np.array_equal(*names):
        return None
    (old, _, replaced), (_, _, taken) = parts
    kept = np.concatenate([old[1][~replaced], triangles[taken] + len(old[0])])
    found = np.zeros(len(city), bool)
    found[number_floating(known)] = True
    inside = ((low[rows] <= inner[1]) & (high[rows] >= inner[0])).all(axis=1)
    found[rows[inside]] = np.isin(np.flatnonzero(inside), hanging)
    merged = merge_vertices(np.concatenate([old[0], vertices]), kept)
    return *sort_by_place(*merged), np.flatnonzero(found), lattice


def lie_in(ground, box):
    """Triangles, of vertices and triangles, whose middle lies in a rectangle, two (2,) [m]: (t,) bool."""
    vertices, triangles = ground
    middle = vertices[triangles, :2].mean(axis=1)
    return ((middle >= box[0]) & (middle <= box[1])).all(axis=1)


def number_floating(known):
    """Footprints that floated before an edit and are drawn as they were: (h,) int."""
    floats = np.zeros(len(known.before.surfaces) + 1, bool)
    floats[known.before.floating] = True
    return np.flatnonzero(floats[known.same])


def take_placed(placed, rows):
    """Some polygons, (k,) int, ascending, of a PlacedCity."""
    city, kept = placed.city, np.zeros(len(placed.city), bool)
    kept[rows] = True
    part = take_polygons(replace(city, points=placed.points), kept)
    return PlacedCity(part, part.points, take_surfaces(placed.surfaces, rows), placed.footprint[rows], placed.site)
