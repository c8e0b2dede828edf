"""Walk over a triangulation in plan view, from triangle to neighbour, to the one that holds a place.

From a triangle nearby it takes a few steps, all places at once: no search tree of triangles is built.
"""

import numpy as np

from .triangulate_plan import find_triangle, twice_areas

MOST_STEPS = 200  # a walk among triangles that are not Delaunay by rounding may not end; a search does
SAMPLE = 1000  # triangles that tell which way all turn
ROUNDING = 1e-12  # of the square of the distance to a corner: so little beyond a side, a place lies on it


def triangle_at(triangles, count):
    """One of the triangles at each vertex: (count,) int64; 0 where there is none."""
    found = np.zeros(count, np.int64)
    found[triangles.ravel()] = np.repeat(np.arange(len(triangles)), 3)
    return found


def walk(places, mesh, wanted, start):
    """The triangle in which each place lies, or one of those on whose side it lies: (k,) int64; -1 beyond all.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
    mesh : tuple of (t, 3) int64
        Delaunay triangles of the places, all turning the same way, and their neighbours.
    wanted : array, (k, 2) float64 [m]
    start : array, (k,) int
        A triangle near each.
    """
    triangles, neighbours = mesh
    found, left = np.array(start, np.int64), np.arange(len(wanted))
    here, came = found, np.full(len(wanted), -2)
    turn = np.sign(twice_areas(places[triangles[:SAMPLE]]).sum())
    easting, northing = places.T.copy()
    for _ in range(MOST_STEPS):
        if not len(left):
            return found
        corners, around = triangles[here], neighbours[here]  # (k, 3)
        x, y = easting[corners] - wanted[left, :1], northing[corners] - wanted[left, 1:]
        side = x * y[:, [1, 2, 0]] - x[:, [1, 2, 0]] * y  # twice the area between the place and each side
        side *= turn  # the sign of its own area would be noise in a triangle that has hardly any
        side[around == came[:, None]] = np.inf  # never back: two triangles without an area may each name the other
        rows, worst = np.arange(len(left)), side.argmin(axis=1)
        away = x**2 + y**2
        furthest = np.maximum(np.maximum(away[:, 0], away[:, 1]), away[:, 2])
        onward = np.flatnonzero(side[rows, worst] < -ROUNDING * furthest)
        beyond = around[onward, worst[onward]]
        found[left[onward]] = beyond
        inside = beyond >= 0
        onward = onward[inside]
        left, here, came = left[onward], beyond[inside], here[onward]
    if len(left):
        found[left] = find_triangle(places[triangles], wanted[left])
    return found
