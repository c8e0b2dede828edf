"""Faces without thickness: carports, sails, noise barriers, billboards drawn as single faces.

    sky      sky        Whether a face encloses something follows from what lies on its two sides. Rays start from
      ↖      ↗          its back and its front and continue from whatever they hit, as light would. Behind the wall
        ╲  ╱            of a house most of them hit backs; behind cladding they hit the wall at once; between a roof
  back  │  front        and the ground, and in a room, they never escape. If they reach the sky from both sides, the
▂▂▂▂▂▂▂▂│▂▂▂▂▂▂▂▂▂▂▂▂   face is a sheet: neither side of it is the inside of anything.
"""

from functools import partial

import numpy as np

from ..settings.progress import ignore_share, report_part
from .find_ground import AT_ONCE, find_ground
from .follow_rays import Enough, faces_of_scene, follow_rays, look_straight

FEW, SOME, MANY = 8, 16, 64  # rays per triangle: to exclude clear cases, and to judge the others
CLEARLY_INSIDE = 0.75  # of the FEW rays hit backs
ENCLOSED = 0.4  # of the rays hit backs: a wall beside a floor without a roof has half, a vault of faces 0.36
ESCAPING = 0.1  # of the rays reach the sky
CLADDING = 0.3  # [m] a face this close in front of another belongs to it
SLIVER = 0.01  # [m] narrower faces are rounding of the data
AFTER_FEW, EACH = 0.35, 0.125  # share of the time for the FEW rays, and for each pass of the next four
MOST_ROUNDS = 4  # faces below or behind sheets are judged again, as backs of sheets are not an inside


def find_sheets(scene, report_share=ignore_share):
    """Triangles of faces that have no thickness and enclose nothing.

    Ground, footprints and closure surfaces are never sheets. Surfaces are judged as a whole. An object that is drawn
    from both sides, as two faces in one place, is a sheet too: neither of its backs is an inside.

    Parameters
    ----------
    scene : Scene
        Including its ground, if any.
    report_share : callable, optional
        As of `build_scene`, of the sheets.

    Returns
    -------
    (t,) bool
    """
    sheet = np.zeros(len(scene.triangles), bool)
    judged = (scene.triangle_surface >= 0) & ~scene.footprint & ~scene.closure & ~find_ground(scene)
    if not judged.any():
        return sheet
    faces = faces_of_scene(scene)

    def mean(rows, values):
        return mean_of_surfaces(scene, faces, rows, values)

    def weigh(rows):
        surface = scene.triangle_surface[rows]
        return surface, faces.area[rows] / np.bincount(surface, faces.area[rows])[surface]

    rows = np.flatnonzero(judged & (faces.area > 0))
    rows = rows[mean(rows, widths(faces, rows)) >= SLIVER]
    tell = partial(report_part, report_share, 0, AFTER_FEW)
    backs, _ = follow_rays(faces, rows, -1, FEW, hops=1, report_share=tell)
    rows = rows[mean(rows, backs / FEW) < CLEARLY_INSIDE]
    rows = rows[mean(rows, look_straight(faces, rows, -1, CLADDING)) < 0.5]
    begin = AFTER_FEW
    for count, least in ((SOME, 1e-9), (MANY, ESCAPING)):
        backs = []
        for side in (-1, 1):
            tell = partial(report_part, report_share, begin, begin + EACH)
            enough = Enough(*weigh(rows), least * count)
            found, sky = follow_rays(faces, rows, side, count, enough=enough, report_share=tell)
            kept = mean(rows, sky / count) >= least
            rows, backs = rows[kept], [one[kept] for one in (*backs, found)]
            begin += EACH
    inside = np.array([mean(rows, found / MANY) >= ENCLOSED for found in backs])
    for _ in range(MOST_ROUNDS):
        found = ~inside.any(axis=0)
        if not found.any():
            break
        sheet[rows[found]] = True
        rows, inside = rows[~found], inside[:, ~found]
        for side, doubtful in zip((-1, 1), inside, strict=True):
            some = rows[doubtful]
            backs, _ = follow_rays(faces, some, side, MANY, hops=1, sheet=sheet)
            doubtful[doubtful] = mean(some, backs / MANY) >= ENCLOSED
    return sheet


def widths(faces, rows):
    """Least heights of some triangles: (r,) float64 [m]."""
    height = np.empty(len(rows))
    for first in range(0, len(rows), AT_ONCE):
        corners = faces.vertices[faces.triangles[rows[first : first + AT_ONCE]]]
        edges = corners - np.roll(corners, 1, axis=1)
        doubled = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        longest = np.linalg.norm(edges, axis=2).max(axis=1)
        height[first : first + AT_ONCE] = doubled / np.maximum(longest, np.finfo(float).tiny)
    return height


def mean_of_surfaces(scene, faces, rows, values):
    """Area-weighted mean over the surface that each of some triangles belongs to: (r,) float64.

    Parameters
    ----------
    rows : (r,) int
        All triangles of each of these surfaces.
    values : (r,) float64
    """
    surface, area = scene.triangle_surface[rows], faces.area[rows]
    count = len(scene.surfaces)
    whole, total = np.bincount(surface, area, count), np.bincount(surface, area * values, count)
    return np.divide(total, whole, out=np.zeros(count), where=whole > 0)[surface]
