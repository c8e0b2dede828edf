"""Triangles of a city's polygons, no larger than a patch; after an edit, only of those that it reaches.

Polygons that share corners, also by way of others, are cut together, since what one of them shares with another is cut
for both. A group of them that is drawn as before has the triangles that it had before.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..rays.random_numbers import are_among, mix
from .polygons import polygon_bounds, triangulate
from .refine import refine_triangles

MERGED = 1e5  # corners at one place in units of 1 / MERGED [m] are one vertex


@dataclass
class Known:
    """What a scene before an edit tells of the polygons of the edited city."""

    before: object  # Scene
    same: np.ndarray  # (n,) int, the row there of each polygon that is drawn as it was; -1: none
    place: np.ndarray  # (n,) int, likewise, of those whose triangles are the same too


def cut_polygons(shape, patch_size, known=None):
    """Triangles of polygons, their edges no longer than the patch size.

    Parameters
    ----------
    shape : tuple
        points (m, 3) float64 [m], ring_start (r + 1,), polygon_start (n + 1,).
    patch_size : float or None
        [m] None keeps the triangles of the polygons.
    known : Known, optional

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
        Ordered by polygon.
    polygon : array, (t,) int64
    """
    if known is not None:
        return join_known(known, shape, patch_size)
    triangles, polygon = triangulate(*shape)
    vertices, triangles = merge_vertices(shape[0], triangles)
    if patch_size is not None:
        vertices, triangles, origin = refine_triangles(vertices, triangles, patch_size, polygon)
        polygon = polygon[origin]
    return vertices, triangles, polygon


def join_known(known, shape, patch_size):
    """The same of a city after an edit, of which only the polygons that are not known are cut."""
    before, place = known.before, known.place
    number = np.full(len(before.surfaces) + 1, -1)
    number[place[place >= 0]] = np.flatnonzero(place >= 0)
    own = number[before.triangle_surface]
    kept = np.flatnonzero((own >= 0) & drawn_triangles(before))
    vertices, triangles, polygon = before.vertices, before.triangles[kept], own[kept]
    rows = np.flatnonzero(place < 0)
    if len(rows):
        more, corners, owner = cut_polygons(take_shape(shape, rows), patch_size)
        vertices = np.concatenate([vertices, more])
        triangles = np.concatenate([triangles, corners + len(before.vertices)])
        polygon = np.concatenate([polygon, rows[owner]])
    order = np.argsort(polygon, kind="stable")
    used, corners = np.unique(triangles[order], return_inverse=True)
    return vertices[used], corners.reshape(-1, 3), polygon[order]


def drawn_triangles(scene):
    """Triangles of surfaces, but no backs of sheets: (t,) bool."""
    own = scene.triangle_surface >= 0
    return own if scene.back_of is None else own & (scene.back_of < 0)


def take_shape(shape, rows):
    """Some polygons, (k,) int, ascending: a tuple as of `cut_polygons`."""
    points, ring_start, polygon_start = shape
    chosen = np.zeros(len(polygon_start) - 1, bool)
    chosen[rows] = True
    rings = np.repeat(chosen, np.diff(polygon_start))
    counts = [np.diff(starts)[some] for starts, some in ((ring_start, rings), (polygon_start, chosen))]
    return points[np.repeat(rings, np.diff(ring_start))], *(np.append(0, np.cumsum(count)) for count in counts)


def merge_vertices(points, triangles):
    """Merge identical points (to 0.01 mm) into one vertex, and drop unused ones.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
    """
    used, corners = np.unique(triangles, return_inverse=True)
    keys = cells_of(points[used])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return points[used[first]], inverse.reshape(-1)[corners].reshape(-1, 3)


def cells_of(points):
    """Places of points, (k, 3) [m], such as are merged if they are the same: (k, 3) int64."""
    return np.round(points * MERGED).astype(np.int64)


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
    pairs = coo_array((np.ones(len(corner), bool), (polygon, vertex + len(place))), (len(place) + len(corners),) * 2)
    group = connected_components(pairs, directed=False)[1]
    lost = before.triangles[lost_triangles(before, place)]
    reached = np.zeros(len(place) + len(corners), bool)
    reached[group[: len(place)][place < 0]] = True
    reached[group[len(place) :][are_among(corners, name_cells(before.vertices[np.unique(lost)]))]] = True
    return Known(before, place, np.where(reached[group[: len(place)]], -1, place))


def near_lost(known, shape, within):
    """Polygons no further than a distance [m] from the box around all that an edit took away or cut anew: (n,) bool."""
    before, (points, *starts) = known.before, shape
    corners = before.vertices[before.triangles[lost_triangles(before, known.place)]].reshape(-1, 3)
    near = np.full(len(known.place), len(corners) > 0)
    for axis in range(3) if len(corners) else ():
        low, high = polygon_bounds(points[:, axis], *starts)
        near &= (low <= corners[:, axis].max() + within) & (high >= corners[:, axis].min() - within)
    return near


def name_cells(points):
    """A number of 64 bits for the place of each point: (k,) uint64."""
    words = np.zeros(len(points), np.uint64)
    for column in cells_of(points).view(np.uint64).T:
        words = mix(words + np.uint64(1) ^ column)
    return words


def lost_triangles(before, place):
    """Triangles of surfaces of a scene before an edit that are no other's place, (n,) int: (t,) bool."""
    lost = np.ones(len(before.surfaces) + 1, bool)
    lost[place[place >= 0]] = False
    return lost[before.triangle_surface] & drawn_triangles(before)
