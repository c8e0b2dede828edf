"""Triangles of a city's polygons, no larger than a patch; after an edit, only of those that it reaches.

Polygons that share corners, also by way of others, are cut together, since what one of them shares with another is cut
for both. A group of them that is drawn as before has the triangles that it had before.
"""

import numpy as np

from .known_polygons import cells_of, drawn_triangles
from .polygons import take_shape, triangulate
from .refine import refine_triangles


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
        more, corners, owner = cut_polygons(take_shape(*shape, place < 0), patch_size)
        vertices = np.concatenate([vertices, more])
        triangles = np.concatenate([triangles, corners + len(before.vertices)])
        polygon = np.concatenate([polygon, rows[owner]])
    order = np.argsort(polygon, kind="stable")
    used, corners = np.unique(triangles[order], return_inverse=True)
    return vertices[used], corners.reshape(-1, 3), polygon[order]


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
