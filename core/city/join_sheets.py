"""Ground that is drawn in several sheets: which of them belong together, and which are roofs or
decks.

────────┐ ┌─────────── a deck: walls hang      Sheets meet where one goes on beyond the rim of
                                               another, at most a
        │ │            from its rim, or it     curb higher or lower. A canopy or a deck may touch the ground too, by
════════╪═╪═╗          lies above another      a ramp: it is told by the walls that hang from its rim, or by the
  sheet │ │ ╚════════  sheet                   upward face below it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..rays.ray_scene import RayScene
from ..settings.tolerances import GEOMETRY
from .polygons import edges_of, normals_of, number_connected

UP = np.array([0.0, 0.0, 1.0])


@dataclass
class _Rim:
    """Places on the outlines of sheets."""

    place: np.ndarray  # (m, 3) float64 [m]
    outward: np.ndarray  # (m, 3) float64, unit, level, away from the sheet
    length: np.ndarray  # (m,) float64 [m], of the edge
    sheet: np.ndarray  # (m,) int


class _Seen(NamedTuple):
    """What rays meet first."""

    hit: np.ndarray  # (m,) int, -1 for nothing
    distance: np.ndarray  # (m,) float64 [m]
    front: np.ndarray  # (m,) bool, the front of a face


def join_sheets(vertices, triangles, sheet, among, *, share=0.5):
    """Number sheets that together may be ground.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (k, 3) int
        Of the sheets, all facing up.
    sheet : (k,) int
        Of each triangle, 0 to n - 1.
    among : (t, 3) int
        All triangles of the scene.

    Returns
    -------
    (n,) int
        The group of each sheet; -1 for those that are above something.
    """
    count, rim = sheet.max() + 1, _look_at_rims(vertices, triangles, sheet)
    area = np.linalg.norm(normals_of(vertices, triangles), axis=1)
    # Above something: below most of its area lies a front.
    seen = look(vertices, among, vertices[triangles].mean(axis=1) - GEOMETRY.step * UP, -UP)
    above = _share_of(sheet, area, seen.front, count)
    # Walled: just below most of its rim stands a wall that faces outwards, as under a roof.
    # Sheets that meet have gaps in plan up to a seam.
    seam = GEOMETRY.uneven
    seen = look(vertices, among, rim.place + seam * rim.outward - GEOMETRY.step * UP, -rim.outward)
    walled = _share_of(rim.sheet, rim.length, seen.front & (seen.distance < 2 * seam), count)
    # Most of a rim or an area is half of it.
    lowest = (above <= share) & (walled <= share)
    triangles, sheet = triangles[lowest[sheet]], sheet[lowest[sheet]]
    # What is neither is joined with what lies as high just beyond its rim, but for a curb.
    seen = look(vertices, triangles, rim.place + seam * rim.outward + GEOMETRY.step * UP, -UP)
    meets = lowest[rim.sheet] & seen.front & (seen.distance <= 2 * GEOMETRY.step)
    return np.where(lowest, number_connected(rim.sheet[meets], sheet[seen.hit[meets]], count), -1)


def _look_at_rims(vertices, triangles, sheet):
    """Places on the edges that belong to one triangle of a sheet: Rim."""
    edges, owner = edges_of(triangles), np.tile(sheet, 3)
    named = np.column_stack([owner, np.sort(edges, axis=1)])
    _, first, shared = np.unique(named, axis=0, return_index=True, return_counts=True)
    # Edges that only one triangle of the sheet has, with their length in plan, and outwards from
    # them.
    rim = first[shared == 1]
    start = vertices[edges[rim, 0]]
    along = vertices[edges[rim, 1]] - start
    length = np.hypot(along[:, 0], along[:, 1])
    outward = (
        np.column_stack([along[:, 1], -along[:, 0], 0 * length])
        / np.maximum(length, np.finfo(float).tiny)[:, None]
    )
    # Each edge is looked at in the middles of its thirds.
    place = np.concatenate([start + share * along for share in (1 / 6, 1 / 2, 5 / 6)])
    return _Rim(place, np.tile(outward, (3, 1)), np.tile(length, 3), np.tile(owner[rim], 3))


def look(vertices, triangles, origins, directions, *, ray_scene=None):
    """What rays, (m, 3) float, meet first: Seen. `ray_scene` holds the triangles, if it is built
    already.
    """
    directions = np.broadcast_to(directions, origins.shape)
    ray_scene = ray_scene or RayScene(vertices, triangles)
    hit = ray_scene.trace_closest(origins.astype(np.float32), directions.astype(np.float32))
    distance, front, met = np.full(len(hit), np.inf), np.zeros(len(hit), bool), hit >= 0
    faces = triangles[hit[met]]
    normal = normals_of(vertices, faces)
    towards = -(normal * directions[met]).sum(axis=1)
    away = ((origins[met] - vertices[faces[:, 0]]) * normal).sum(axis=1)
    distance[met], front[met] = (
        away / np.where(towards == 0, np.finfo(float).tiny, towards),
        towards > 0,
    )
    return _Seen(hit, distance, front)


def _share_of(owner, weight, chosen, count):
    """Share of the weight of each owner that is chosen: (count,)."""
    return np.bincount(owner, weight * chosen, count) / np.maximum(
        np.bincount(owner, weight, count), np.finfo(float).tiny
    )
