"""Fewer triangles that block the same light: flat faces whose pieces fill a triangle or rectangle.

┌──┬──┬──┐        ┌────────┐     Patches are small, so that light is resolved. Whether a point sees
│ /│ /│ /│   ─►   │     ／ │     the sun depends only on the faces that they fill together, and a
├──┼──┼──┤        │  ／    │     tree of few triangles is passed faster: Midtown's shadow rays take
│ /│ /│ /│        └────────┘     two thirds of their time, Berlin's four fifths.
└──┴──┴──┘
"""

import numpy as np

from ..settings.tolerances import GEOMETRY


def merge_pieces(vertices, triangles, surface, offset):
    """Triangles that cover the same points with fewer of them.

    Pieces of a surface are replaced if they fill the flat quadrangle of their outermost
    corners; all others stay as they are.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (t, 3) int
        Triangles without area block nothing.
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
    rows = np.flatnonzero((surface >= 0) & (area > 0))
    # Nothing to merge where no triangle of a surface has an area.
    if not len(rows):
        return triangles
    # Of each surface its area, where it looks, and how far it may be off; then its corners.
    own = np.unique(surface[rows], return_inverse=True)[1]
    total, upwards = np.bincount(own, area[rows]), np.zeros((own.max() + 1, 3))
    np.add.at(upwards, own, normal[rows])
    least = np.full(len(total), -np.inf)
    np.maximum.at(least, own, -offset[rows] / 4)
    corner_of = np.unique(own[:, None] * len(vertices) + triangles[rows])
    owner, vertex = np.divmod(corner_of, len(vertices))
    place, start = vertices[vertex], np.flatnonzero(np.diff(owner, prepend=-1))

    def outermost(distance):
        # The first corner of each surface with the largest distance.
        at = np.flatnonzero(distance == np.maximum.reduceat(distance, start)[owner])
        return at[np.searchsorted(owner[at], np.arange(len(start)))]

    # Two ends of the longest diagonal, and the corners furthest to its left and to its right.
    one = outermost(np.linalg.norm(place - place[start][owner], axis=1))
    away = place - place[one][owner]
    other = outermost(np.linalg.norm(away, axis=1))
    left = np.cross(upwards, place[other] - place[one])
    aside = (away * left[owner]).sum(axis=1)
    quadrangle = np.stack([one, outermost(-aside), other, outermost(aside)], axis=1)
    # A flat surface fills these four if it has their area and all its corners lie inside of them.
    halves = quadrangle[:, [[0, 1, 2], [0, 2, 3]]]
    first, second, third = np.moveaxis(place[halves], 2, 0)
    covered = np.linalg.norm(np.cross(second - first, third - first), axis=2)
    whole = np.abs(covered.sum(axis=1) - total) <= GEOMETRY.tie * total
    turned = quadrangle[:, [1, 2, 3, 0]]
    inwards = np.cross(upwards[:, None], place[turned] - place[quadrangle])
    for corner, normals in [
        (one, upwards),
        (one, -upwards),
        *zip(quadrangle.T, np.moveaxis(inwards, 1, 0), strict=True),
    ]:
        inside = ((place - place[corner][owner]) * normals[owner]).sum(axis=1)
        whole &= np.minimum.reduceat(inside, start) >= least * np.linalg.norm(normals, axis=1)
    # Faces that pass are replaced by the two halves of their quadrangle.
    # Triangles without area, and halves without one, are dropped.
    kept = area > 0
    kept[rows[whole[own]]] = False
    filled = covered[whole] > GEOMETRY.tie * total[whole, None]
    return np.concatenate([triangles[kept], vertex[halves[whole][filled]]])
