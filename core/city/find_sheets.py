"""Faces without thickness: carports, sails, noise barriers, billboards drawn as single faces.

    sky      sky        Whether a face encloses something follows from what lies on its two sides. Rays start from
      ↖      ↗          its back and its front and continue from whatever they hit, as light would. Behind the wall
        ╲  ╱            of a house most of them hit backs; behind cladding they hit the wall at once; between a roof
  back  │  front        and the ground, and in a room, they never escape. If they reach the sky from both sides, the
▂▂▂▂▂▂▂▂│▂▂▂▂▂▂▂▂▂▂▂▂   face is a sheet: neither side of it is the inside of anything.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..rays import surroundings
from ..rays.faces import Faces, Fate
from ..rays.ray_scene import HitPlaces, RayScene
from ..rays.sample_points import additive_recurrence, barycentric_of_square
from ..settings.progress import report_part, silent
from ..settings.tolerances import GEOMETRY
from .find_ground import find_ground


@dataclass
class _Shapes:
    """Triangles and the tracer that finds them."""

    ray_scene: RayScene
    faces: Faces
    area: np.ndarray  # (t,) float64 [m²]
    width: np.ndarray  # (t,) float64 [m], the least height
    surface: np.ndarray  # (t,) int


def find_sheets(scene, report_share=silent):
    """Triangles of faces that have no thickness and enclose nothing.

    Ground, footprints and closure surfaces are never sheets. Surfaces are judged as a whole. An
    object that is drawn from both sides, as two faces in one place, is a sheet too: neither of its
    backs is an inside.

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
    judged, sheet = find_judged(scene), np.zeros(len(scene.triangles), bool)
    if judged.any():
        shapes = shapes_of_scene(scene)
        judge_shapes(shapes, np.flatnonzero(judged & (shapes.area > 0)), sheet, report_share)
    return sheet


def find_judged(scene):
    """Triangles that may be sheets: (t,) bool."""
    return (scene.triangle_surface >= 0) & ~scene.footprint & ~scene.closure & ~find_ground(scene)


def judge_shapes(shapes, rows, sheet, report_share, *, enclosed=0.4):
    """Mark which triangles of some whole surfaces are sheets, where the other sheets are known.

    Parameters
    ----------
    shapes : _Shapes
    rows : (r,) int
        Triangles of these surfaces, all that have area.
    sheet : (t,) bool
        Set to True where a triangle of these surfaces is a sheet; all else stays.
    report_share : callable
    """
    count = shapes.surface.max() + 1

    def mean(rows, values):
        """Area-weighted mean over the surface of each triangle; all triangles of each surface are
        given.
        """
        surface, area = shapes.surface[rows], shapes.area[rows]
        whole, total = np.bincount(surface, area, count), np.bincount(surface, area * values, count)
        return np.divide(total, whole, out=np.zeros(count), where=whole > 0)[surface]

    # A sheet is a face without thickness that encloses nothing: from both of its sides rays reach
    # the sky. What the steps down to `inside` drop from the rows is no sheet: at first faces
    # narrower than the accuracy, which are rounding of the data.
    rows = rows[mean(rows, shapes.width[rows]) >= GEOMETRY.accuracy]
    # The first rays take a third of the time, each of the next four passes an eighth.
    begin, each, many = 0.35, 0.125, 64
    tell = partial(report_part, report_share, 0, begin)
    backs, _ = _count_ends(shapes, rows, -1, 8, hops=0, report_share=tell)
    # Where three quarters of eight rays from its back hit backs, a surface is clearly inside.
    rows = rows[mean(rows, backs / 8) < 0.75]
    # What stands close in front of another face is its cladding, and belongs to it.
    rows = rows[mean(rows, _look_straight(shapes, rows, -1, GEOMETRY.cladding)) < 0.5]
    # Few rays exclude clear cases, more judge the rest; an open face has a tenth of its rays escape
    # to the sky.
    for rays, least in ((16, 1e-9), (many, 0.1)):
        backs = []
        for side in (-1, 1):
            tell = partial(report_part, report_share, begin, begin + each)
            met, sky = _count_ends(shapes, rows, side, rays, report_share=tell)
            kept = mean(rows, sky / rays) >= least
            rows, backs = rows[kept], [earlier[kept] for earlier in (*backs, met)]
            begin += each
    # Inside on a side: enough of its rays hit backs; what is inside on neither is a sheet.
    # Enclosed: so many rays hit backs. A wall beside a floor without a roof has half, a vault 0.36.
    inside = np.array([mean(rows, met / many) >= enclosed for met in backs])
    news = sheet.any()  # those that are known do not count so far
    # What is open on both sides becomes a sheet. The rest is judged again, as backs of sheets are
    # not an inside: in four rounds at most, until one brings no further sheet.
    for _ in range(4):
        open_sides = ~inside.any(axis=0)
        if not open_sides.any() and not news:
            break
        news, sheet[rows[open_sides]] = False, True
        rows, inside = rows[~open_sides], inside[:, ~open_sides]
        lit = replace(
            shapes, faces=replace(shapes.faces, other_side=np.where(sheet, 0, -1).astype(np.int32))
        )
        for side, doubtful in zip((-1, 1), inside, strict=True):
            some = rows[doubtful]
            backs, _ = _count_ends(lit, some, side, many, hops=0)
            doubtful[doubtful] = mean(some, backs / many) >= enclosed


def shapes_of_scene(scene):
    """Triangles of a scene, none of them a sheet so far: _Shapes."""
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    none = np.full(len(corners), -1, np.int32)
    faces, area = Faces.of_triangles(corners, scene.footprint, none)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    width = 2 * area / np.maximum(longest, np.finfo(float).tiny)
    ray_scene = RayScene(scene.vertices, scene.triangles)
    return _Shapes(ray_scene, faces, area, width, scene.triangle_surface)


def _count_ends(shapes, rows, side, count, *, hops=7, report_share=silent):
    """How many rays from one side of some triangles hit a back first, and how many reach the sky,
    directly or by going on from whichever sides they hit: (2, r) int64.
    """
    trace, faces = shapes.ray_scene.trace_places, shapes.faces
    keys = surroundings.number_rays(np.zeros(1, np.uint64), count)[0]

    def tally(some, met):
        fate = met.fate.reshape(-1, count)
        backs = (fate == Fate.BACK).sum(axis=1)
        ends = np.zeros((3, len(some)), np.int64)
        ends[1] = (fate == Fate.SKY).sum(axis=1)
        # Onwards by the same directions for every triangle, on the side that each ray came to.
        on = np.flatnonzero(met.places.triangle >= 0)
        point, number = np.divmod(on, count)
        side_hit = np.where(met.behind[on], np.float32(-1), np.float32(1))
        rays = met.places.take(on), side_hit, point, keys[number]
        surroundings.follow(trace, faces, rays, ends, turns=hops, as_light=True)
        return np.stack([backs, ends[1]])

    asked = {"tally": tally, "report_share": report_share}
    return surroundings.ask_sides(shapes.ray_scene, faces, rows, side, count, **asked)


def _look_straight(shapes, rows, side, reach, *, points=4):
    """Share of some points of each triangle with a face that looks back straight ahead of one of
    its sides, within `reach` [m]: (r,) float64.
    """
    weights = barycentric_of_square(*additive_recurrence(points, 2).T)
    own, (b1, b2) = np.repeat(rows, points), (np.tile(part, len(rows)) for part in weights)
    ahead = 0 * b1, 0 * b1, 1 + 0 * b1
    places = HitPlaces(own, b1, b2)
    met = surroundings.send(shapes.ray_scene.trace_places, shapes.faces, places, ahead, side)
    distance = shapes.faces.facing_distance(own, met.places, side)
    return (distance < reach).reshape(-1, points).mean(axis=1)
