"""Fewer triangles that block the same light: flat faces whose pieces fill a triangle or rectangle.

┌──┬──┬──┐        ┌────────┐     Patches are small, so that light is resolved. Whether a point sees
│ /│ /│ /│   ─►   │     ／ │     the sun depends only on the faces that they fill together, and a
├──┼──┼──┤        │  ／    │     tree of few triangles is passed faster: Midtown's shadow rays take
│ /│ /│ /│        └────────┘     two thirds of their time, Berlin's four fifths.
└──┴──┴──┘
"""

import numpy as np


def merge_pieces(vertices, triangles, surface, offset):
    """Triangles that cover the same points with fewer of them.

    Pieces of a surface are replaced if they fill the flat quadrangle of their outermost
    corners; all others stay as they are.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (t, 3) int
        Those without area block nothing.
    surface : (t,) int
        Of each triangle, -1 for none.
    offset : (t,) float [m]
        Distance of ray origins from each; a merged face may be off by a quarter of it.

    Returns
    -------
    (k, 3) int
        Into the same vertices.
    """
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    # Pieces surface by surface, and their corners: a vertex, where it lies, and whose it is.
    rows = np.flatnonzero((surface >= 0) & (area > 0))
    rows = rows[np.argsort(surface[rows], kind="stable")]
    if not len(rows):
        return triangles
    start = np.flatnonzero(np.diff(surface[rows], prepend=-1))
    owner = np.repeat(np.arange(len(start)), 3 * np.diff(start, append=len(rows)))
    vertex, place = triangles[rows].ravel(), corners[rows].reshape(-1, 3)

    def outermost(distance):
        # The first corner of each surface with the largest distance.
        at = np.flatnonzero(distance == np.maximum.reduceat(distance, 3 * start)[owner])
        return at[np.searchsorted(owner[at], np.arange(len(start)))]

    # Two ends of the longest diagonal, and the corners furthest to its left and to its right.
    upwards = np.add.reduceat(normal[rows], start)
    total = np.add.reduceat(area[rows], start)
    one = outermost(np.linalg.norm(place - place[3 * start][owner], axis=1))
    away = place - place[one][owner]
    other = outermost(np.linalg.norm(away, axis=1))
    left = np.cross(upwards, place[other] - place[one])
    aside = (away * left[owner]).sum(axis=1)
    quadrangle = np.stack([one, outermost(-aside), other, outermost(aside)], axis=1)
    # A flat surface fills these four if it has their area and all its corners lie inside of them.
    halves = quadrangle[:, [[0, 1, 2], [0, 2, 3]]]
    first, second, third = np.moveaxis(place[halves], 2, 0)
    covered = np.linalg.norm(np.cross(second - first, third - first), axis=2)
    whole = np.abs(covered.sum(axis=1) - total) <= 1e-6 * total
    least = -np.minimum.reduceat(offset[rows], start) / 4
    turned = quadrangle[:, [1, 2, 3, 0]]
    inwards = np.cross(upwards[:, None], place[turned] - place[quadrangle])
    for corner, normals in [
        (one, upwards),
        (one, -upwards),
        *zip(quadrangle.T, np.moveaxis(inwards, 1, 0), strict=True),
    ]:
        inside = ((place - place[corner][owner]) * normals[owner]).sum(axis=1)
        whole &= np.minimum.reduceat(inside, 3 * start) >= least * np.linalg.norm(normals, axis=1)
    kept = area > 0
    kept[rows[np.repeat(whole, np.diff(start, append=len(rows)))]] = False
    return np.concatenate(
        [triangles[kept], vertex[halves[whole][covered[whole] > 1e-6 * total[whole, None]]]]
    )
