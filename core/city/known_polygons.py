"""Which polygons of a city are known from a scene before an edit, and which triangles an edit took or brought.

A polygon is known by its name and its points. Its triangles are known too where all that shares corners with it, also
by way of others, is: what one shares with another is cut for both.
"""

from dataclasses import dataclass

import numpy as np

from ..rays.random_numbers import are_among, mix, name_rows
from ..rays.trail import boxes_of
from .polygons import MERGED, number_connected, polygon_bounds
from .scene import corners_of


@dataclass
class Known:
    """What a scene before an edit tells of the polygons of the edited city."""

    before: object  # Scene
    same: np.ndarray  # (n,) int, the row there of each polygon that is drawn as it was; -1: none
    place: np.ndarray  # (n,) int, likewise, of those whose triangles are the same too


def name_polygons(points, ring_start, polygon_start):
    """A number of 64 bits for each polygon, which tells its points and rings: (n,) uint64."""
    words = mix(place_in_run(ring_start))
    for column in np.ascontiguousarray(points).view(np.uint64).T:
        words = mix(words + np.uint64(1) ^ column)
    rings = mix(np.add.reduceat(words, ring_start[:-1]) ^ mix(place_in_run(polygon_start)))
    return np.add.reduceat(rings, polygon_start[:-1])


def place_in_run(start):
    """Number of each member of runs that begin at `start`, (k + 1,), within its run, from 1: (start[-1],) uint64."""
    return (np.arange(1, start[-1] + 1) - np.repeat(start[:-1], np.diff(start))).astype(np.uint64)


def find_known(before, surface_id, drawn, shape):
    """What a scene before an edit tells of the polygons of a city: Known, or None if it tells nothing.

    Parameters
    ----------
    before : Scene
    surface_id : list of str
        Of the n polygons.
    drawn : (n,) uint64
        Of `name_polygons`.
    shape : tuple
        As of `cut_polygons`.
    """
    if before.drawn is None:
        return None
    number = {name: row for row, name in enumerate(before.surfaces.surface_id[: len(before.drawn)])}
    place = np.array([number.get(name, -1) for name in surface_id])
    place[before.drawn[place] != drawn] = -1
    if (np.diff(place[place >= 0]) < 0).any():  # which of several corners is kept follows from the order
        return None
    points, ring_start, polygon_start = shape
    polygon = np.repeat(np.repeat(np.arange(len(place)), np.diff(polygon_start)), np.diff(ring_start))
    corner = name_cells(points)
    corners, vertex = np.unique(corner, return_inverse=True)
    group = number_connected(polygon, vertex + len(place), len(place) + len(corners))
    lost = before.triangles[lost_triangles(before, place)]
    reached = np.zeros(len(place) + len(corners), bool)
    reached[group[: len(place)][place < 0]] = True
    reached[group[len(place) :][are_among(corners, name_cells(before.vertices[np.unique(lost)]))]] = True
    return Known(before, place, np.where(reached[group[: len(place)]], -1, place))


def name_cells(points):
    """A number of 64 bits for the place of each point, the same for such as are merged: (k,) uint64."""
    words = np.zeros(len(points), np.uint64)
    for column in np.round(points * MERGED).astype(np.int64).view(np.uint64).T:
        words = mix(words + np.uint64(1) ^ column)
    return words


def near_lost(known, shape, within):
    """Polygons no further than a distance [m] from the box around all that an edit took away or cut anew: (n,) bool."""
    before, (points, *starts) = known.before, shape
    corners = before.vertices[before.triangles[lost_triangles(before, known.place)]].reshape(-1, 3)
    low, high = polygon_bounds(points, *starts)
    least, most = corners.min(axis=0, initial=np.inf) - within, corners.max(axis=0, initial=-np.inf) + within
    return ((low <= most) & (high >= least)).all(axis=1)


def lost_triangles(before, place):
    """Triangles of surfaces of a scene before an edit that are no other's place, (n,) int: (t,) bool."""
    lost = np.append(np.ones(len(before.surfaces), bool), False)  # -1, ground and backs, takes the last
    lost[place[place >= 0]] = False
    return lost[before.triangle_surface]


def match_surfaces(known, scene, judged):
    """The same surface before an edit for each surface, (n,) int, -1 if there is none; and boxes around all triangles
    that only one of the scenes has, or judges alone: (b, 2, 3) float64 [m].

    `judged`, two (t,) bool, are the triangles that may be sheets before and after.
    """
    before, cut = known.before, known.place
    number = {name: row for row, name in enumerate(before.surfaces.surface_id)}
    place = np.array([number.get(name, -1) for name in scene.surfaces.surface_id])
    spared = np.zeros(len(before.surfaces) + 1, bool)
    spared[cut[cut >= 0]] = True
    rows, kinds, names = [], [], []
    both = (before, np.arange(len(before.surfaces)), spared), (scene, place, np.append(cut >= 0, False))
    for (one, surface, of_known), wanted in zip(both, judged, strict=True):
        own = np.ones(len(one.triangles), bool) if one.back_of is None else one.back_of < 0
        some = own & of_known[one.triangle_surface]
        others = np.flatnonzero(own & ~some)
        rows.append((np.flatnonzero(some), others))
        kinds.append(np.stack([one.footprint, one.closure, wanted], axis=1))
        owner = np.append(surface, -1)[one.triangle_surface[others]]
        names.append(name_rows([corners_of(one, others), owner, kinds[-1][others]]))
    turned = (kinds[0][rows[0][0]] != kinds[1][rows[1][0]]).any(axis=1)  # triangles that are known, but of another kind
    alone = [
        np.concatenate([some[turned], others[~are_among(mine, theirs)]])
        for (some, others), mine, theirs in zip(rows, names, names[::-1], strict=True)
    ]
    lost = np.zeros(len(before.surfaces) + 1, bool)
    lost[before.triangle_surface[alone[0]]] = True
    same = (place >= 0) & ~lost[place]
    new = scene.triangle_surface[alone[1]]
    same[new[new >= 0]] = False
    parts = [corners_of(one, some) for one, some in zip((before, scene), alone, strict=True)]
    return np.where(same, place, -1), boxes_of(np.concatenate(parts))


def boxes_of_surfaces(scene):
    """Box around the triangles of each surface: (n, 2, 3) float64 [m]; that of one without any touches nothing."""
    boxes = np.full((len(scene.surfaces), 2, 3), [[np.inf], [-np.inf]])
    order = np.argsort(scene.triangle_surface, kind="stable")[(scene.triangle_surface < 0).sum() :]
    corners, surface = np.asarray(scene.vertices, float)[scene.triangles[order]], scene.triangle_surface[order]
    first = np.flatnonzero(np.diff(surface, prepend=-1))
    boxes[surface[first], 0] = np.minimum.reduceat(corners.min(axis=1), first)
    boxes[surface[first], 1] = np.maximum.reduceat(corners.max(axis=1), first)
    return boxes
