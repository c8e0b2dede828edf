"""Find polygons of a building that are drawn inside out, from their orientation relative to
adjacent polygons.
"""

from dataclasses import dataclass

import numpy as np

from ..settings.tolerances import GEOMETRY
from .polygons import measure_polygons, next_in_ring, number_connected, polygon_bounds

SURE_SHARE = 2 / 3  # of the area of a sheet that must agree for the rest to be turned


@dataclass
class Orientation:
    """Orientation of the polygons of a city."""

    flip: np.ndarray  # (n,) bool: drawn inside out
    # (n,) bool: part of a watertight shell, whose volume proves its orientation
    watertight: np.ndarray
    doubtful: np.ndarray  # (n,) bool: part of a shell that contradicts itself and proves nothing
    shell: np.ndarray  # (n,) int: number of the shell
    # (n,) bool: drawn in agreement with the volume, or the larger part, of its shell
    agree: np.ndarray
    loose: np.ndarray  # (n,) bool: shares no edge with what tells its orientation; only rays can


def orient_shells(points, ring_start, polygon_start, building):
    """Find polygons that face into their building.

    Two polygons of a building that share an edge with each other only face the same side if they
    traverse it in opposite directions. Polygons linked by such edges form a shell, which has one of
    two orientations: the right one encloses a positive volume (divergence theorem: V = sum of area
    vector · point / 3). An open shell is closed by a cone over its open edges. A shell with hardly
    any volume is a sheet: there the larger part of the area, at least two thirds, decides. Where
    corners do not meet, single faces are sheets: all faces of a building are one shell, and the
    ones that face its middle are proposed.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    ring_start : array, (r + 1,) int64
    polygon_start : array, (n + 1,) int64
    building : array, (n,) int64

    Returns
    -------
    Orientation
    """
    count = len(polygon_start) - 1
    edges = _edges(points, ring_start, polygon_start, building)
    shell, sign, twisted = _link(edges, count)
    area, normal = measure_polygons(points, ring_start, polygon_start)
    size = np.bincount(shell, area)
    middle, closed = _middles(points, edges, shell, sign)
    height = np.einsum("ij,ij->i", normal, points[ring_start[polygon_start[:-1]]] - middle[shell])
    volume = np.bincount(shell, sign * area * height) / 3
    turned = np.bincount(shell, np.where(sign < 0, area, 0.0), len(size))
    same = np.bincount(shell, np.ones(count), len(size)) == 1
    closed_shell = closed[shell]
    # A slab of 100 x 100 x 1.5 m has a volume of 0.01 area^1.5: an open shell with less is a sheet.
    sure = ~same & (np.abs(volume) > np.where(closed, 1e-6, 0.01) * size**1.5)
    agree = ~sure & (np.maximum(turned, size - turned) >= SURE_SHARE * size)
    right = np.where(sure, np.sign(volume), np.where(turned > 0.5 * size, -1.0, 1.0))
    agrees = sign == right[shell]
    doubtful = twisted | (~(sure | agree)[shell])
    loose = ~doubtful & ~sure[shell] & (turned[shell] == 0)
    asked, faces_in = _find_inward((points, ring_start, polygon_start), building, area, normal)
    agrees[loose] = ~faces_in[loose]
    # Faces that no edge links are judged together.
    shell = np.unique(np.where(loose & asked, len(size) + building, shell), return_inverse=True)[
        1
    ].reshape(-1)
    return Orientation(~agrees & ~doubtful, closed_shell & ~twisted, doubtful, shell, agrees, loose)


def _find_inward(shape, building, area, normal):
    """Polygons of buildings whose faces together cannot be an outside, and those that face its
    middle: (n,) bool.

    Area vectors of a closed surface add up to zero, to what is open if its ground is missing. They
    do not where single faces are inside out; where all are, the volume around the middle is
    negative.
    """
    low, high = polygon_bounds(*shape)
    count = building.max(initial=-1) + 1
    bounds = np.full((2, count, 3), np.inf)
    np.minimum.at(bounds[0], building, low)
    np.minimum.at(bounds[1], building, -high)
    middle = 0.5 * (bounds[0] - bounds[1])
    height = np.einsum("ij,ij->i", normal, 0.5 * (low + high) - middle[building])
    volume, size = (
        np.bincount(building, area * height, count) / 3,
        np.bincount(building, area, count),
    )
    total = np.column_stack(
        [np.bincount(building, area * normal[:, axis], count) for axis in range(3)]
    )
    slack = 0.02 * size
    open_side = (np.hypot(total[:, 0], total[:, 1]) > slack) | (total[:, 2] < -slack)
    # Fewer than four faces enclose nothing.
    doubtful = (open_side | (volume < 0)) & (np.bincount(building, minlength=count) > 3)
    return doubtful[building], doubtful[building] & (height < 0)


def turn_over(points, ring_start, polygon_start, chosen):
    """Points with the rings of the chosen polygons reversed, (m, 3) float64 [m]."""
    chosen_ring = np.repeat(chosen, np.diff(polygon_start))
    mirrored = np.repeat(ring_start[:-1] + ring_start[1:] - 1, np.diff(ring_start)) - np.arange(
        len(points)
    )
    return points[
        np.where(np.repeat(chosen_ring, np.diff(ring_start)), mirrored, np.arange(len(points)))
    ]


@dataclass
class _Edges:
    """Directed edges of all rings, sorted so that equal undirected ones are adjacent."""

    polygon: np.ndarray  # (e,)
    start: np.ndarray  # (e,) index of a point
    end: np.ndarray  # (e,)
    forward: np.ndarray  # (e,) +1 or -1: from the smaller to the larger vertex index, or back
    group: np.ndarray  # (e,) index of the undirected edge
    uses: np.ndarray  # (e,) number of uses of that edge


def _edges(points, ring_start, polygon_start, building):
    # Edges of all rings, grouped where two or more join the same two places in one building.
    ring_polygon = np.repeat(np.arange(len(polygon_start) - 1), np.diff(polygon_start))
    polygon = np.repeat(ring_polygon, np.diff(ring_start))
    cells = np.round((points - points.min(axis=0, initial=np.inf)) / GEOMETRY.corner).astype(
        np.int64
    )
    keys = np.column_stack([building[polygon], cells])
    place = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    start, end = np.arange(len(points)), next_in_ring(ring_start)
    low, high = np.minimum(place[start], place[end]), np.maximum(place[start], place[end])
    real = low < high
    key = low * np.int64(len(points) + 1) + high
    _, group, uses = np.unique(key[real], return_inverse=True, return_counts=True)
    order = np.argsort(group, kind="stable")
    start, end = start[real][order], end[real][order]
    # Two neighbours that face the same side run along their edge in opposite ways.
    forward = np.where(place[start] < place[end], 1, -1)
    group = group[order]
    return _Edges(polygon[real][order], start, end, forward, group, uses[group])


def _link(edges, count):
    """Shell of each polygon (n,), its orientation within it +1 or -1 (n,), and shells that
    contradict themselves (n,).

    Every polygon has two nodes in a graph, as drawn and turned. Nodes that agree are linked: a
    shell is a pair of connected components, mirror images of each other, or a single one if it
    contradicts itself.
    """
    pairs = np.flatnonzero(edges.uses == 2).reshape(-1, 2)
    one, other = edges.polygon[pairs].T if len(pairs) else (np.zeros(0, np.int64),) * 2
    odd = (edges.forward[pairs[:, 0]] == edges.forward[pairs[:, 1]]).astype(np.int64)
    two_faces = one != other
    one, other, odd = one[two_faces], other[two_faces], odd[two_faces]
    row = np.concatenate([2 * one, 2 * one + 1])
    column = np.concatenate([2 * other + odd, 2 * other + 1 - odd])
    drawn, turned = number_connected(row, column, 2 * count).reshape(-1, 2).T
    shell = np.unique(np.minimum(drawn, turned), return_inverse=True)[1].reshape(-1)
    return shell, np.where(drawn <= turned, 1, -1), drawn == turned


def _middles(points, edges, shell, sign):
    """Apex of the cone that closes each shell, the middle of its corners (s, 3) [m]; and if it has
    none (s,).
    """
    count, owner = shell.max(initial=-1) + 1, shell[edges.polygon]
    # Open are the edges of the consistently oriented shell whose uses do not cancel.
    key = owner.astype(np.int64) * np.int64(edges.group.max(initial=0) + 1) + edges.group
    index = np.unique(key, return_inverse=True)[1].reshape(-1)
    gap = np.abs(np.bincount(index, edges.forward * sign[edges.polygon])[index]) > 0.5
    corners = np.maximum(np.bincount(owner, minlength=count), 1)
    middle = np.column_stack(
        [np.bincount(owner, points[edges.start, axis], count) for axis in range(3)]
    )
    return middle / corners[:, None], np.bincount(owner, gap, count) == 0
