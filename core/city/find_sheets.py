"""Faces without thickness: carports, sails, noise barriers, billboards drawn as single faces.

    sky      sky        Whether a face encloses something follows from what lies on its two sides. Rays start from
      ↖      ↗          its back and its front and continue from whatever they hit, as light would. Behind the wall
        ╲  ╱            of a house most of them hit backs; behind cladding they hit the wall at once; between a roof
  back  │  front        and the ground, and in a room, they never escape. If they reach the sky from both sides, the
▂▂▂▂▂▂▂▂│▂▂▂▂▂▂▂▂▂▂▂▂   face is a sheet: neither side of it is the inside of anything.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import njit

from ..rays import sample_points
from ..rays.random_numbers import GOLDEN, mix, uniform
from ..rays.ray_scene import RayScene
from ..settings.progress import report_part, silent
from ..settings.threads import map_in_order, usable_threads
from .find_ground import find_ground
from .join_sheets import look

FEW, MANY = 8, 64  # rays per triangle: to exclude clear cases, and to judge the others
# share of the time for the FEW rays, and for each pass of the next four
AFTER_FEW, EACH = (
    0.35,
    0.125,
)
RAYS_PER_TASK = 1 << 13  # so that what they need stays in the cache
PERPENDICULAR = 4  # points per triangle with a ray straight ahead


@dataclass
class _Faces:
    """Triangles and the tracer that finds them."""

    ray_scene: RayScene
    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int into vertices
    along: np.ndarray  # (t, 3) float64, a tangent: the first edge
    normal: np.ndarray  # (t, 3) float64
    area: np.ndarray  # (t,) float64 [m²]
    width: np.ndarray  # (t,) float64 [m], the least height
    offset: np.ndarray  # (t,) float64 [m], distance of ray origins from the face
    footprint: np.ndarray  # (t,) bool, counts as a back from either side
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
        faces = faces_of_scene(scene)
        judge_faces(faces, np.flatnonzero(judged & (faces.area > 0)), sheet, report_share)
    return sheet


def find_judged(scene):
    """Triangles that may be sheets: (t,) bool."""
    return (scene.triangle_surface >= 0) & ~scene.footprint & ~scene.closure & ~find_ground(scene)


def judge_faces(faces, rows, sheet, report_share, *, enclosed=0.4):
    """Mark which triangles of some whole surfaces are sheets, where the other sheets are known.

    Parameters
    ----------
    faces : Faces
    rows : (r,) int
    sheet : (t,) bool
        Written.
    report_share : callable
    """
    count = faces.surface.max() + 1

    def mean(rows, values):
        """Area-weighted mean over the surface of each triangle; all triangles of each surface are
        given.
        """
        surface, area = faces.surface[rows], faces.area[rows]
        whole, total = np.bincount(surface, area, count), np.bincount(surface, area * values, count)
        return np.divide(total, whole, out=np.zeros(count), where=whole > 0)[surface]

    # A sheet is a face without thickness that encloses nothing: from both of its sides rays reach
    # the sky. Faces narrower than 1 cm are rounding of the data.
    rows = rows[mean(rows, faces.width[rows]) >= 0.01]
    backs, _ = _follow_rays(
        faces, rows, -1, FEW, hops=1, report_share=partial(report_part, report_share, 0, AFTER_FEW)
    )
    # Where three quarters of the rays hit backs, the face is clearly inside.
    rows = rows[mean(rows, backs / FEW) < 0.75]
    # A face up to 0.3 m in front of another is its cladding, and belongs to it.
    rows = rows[mean(rows, _look_straight(faces, rows, -1, 0.3)) < 0.5]
    begin = AFTER_FEW
    # Few rays exclude clear cases, more judge the rest; an open face has a tenth of its rays escape
    # to the sky.
    for rays, least in ((16, 1e-9), (MANY, 0.1)):
        backs = []
        for side in (-1, 1):
            tell = partial(report_part, report_share, begin, begin + EACH)
            found, sky = _follow_rays(faces, rows, side, rays, report_share=tell)
            kept = mean(rows, sky / rays) >= least
            rows, backs = rows[kept], [one[kept] for one in (*backs, found)]
            begin += EACH
    # Inside on a side: enough of its rays hit backs; what is inside on neither is a sheet.
    # Enclosed: so many rays hit backs. A wall beside a floor without a roof has half, a vault 0.36.
    inside = np.array([mean(rows, found / MANY) >= enclosed for found in backs])
    news = sheet.any()  # those that are known do not count so far
    # Faces below or behind sheets are judged again, as backs of sheets are not an inside.
    for _ in range(4):
        found = ~inside.any(axis=0)
        if not found.any() and not news:
            break
        news, sheet[rows[found]] = False, True
        rows, inside = rows[~found], inside[:, ~found]
        for side, doubtful in zip((-1, 1), inside, strict=True):
            some = rows[doubtful]
            backs, _ = _follow_rays(faces, some, side, MANY, hops=1, sheet=sheet)
            doubtful[doubtful] = mean(some, backs / MANY) >= enclosed


def faces_of_scene(scene, *, at_once=1 << 16):
    """Faces of a scene."""
    vertices, count, tiny = (
        np.asarray(scene.vertices, float),
        len(scene.triangles),
        np.finfo(float).tiny,
    )
    along, normal = np.empty((2, count, 3))
    area, width, offset = np.empty((3, count))
    # `at_once`: triangles that are measured together, so that they need little memory.
    for first in range(0, count, at_once):
        some = slice(first, first + at_once)
        # Edges, normal and area of each triangle; width  its least height, 2 · area over the
        # longest edge.
        corners = vertices[scene.triangles[some]]
        edges = corners[:, [1, 2, 2]] - corners[:, [0, 0, 1]]
        length, across = np.linalg.norm(edges, axis=2), np.cross(edges[:, 0], edges[:, 1])
        doubled = np.linalg.norm(across, axis=1)
        along[some] = edges[:, 0] / np.maximum(length[:, :1], tiny)
        normal[some], area[some] = across / np.maximum(doubled, tiny)[:, None], doubled / 2
        width[some] = doubled / np.maximum(length.max(axis=1), tiny)
        reach = np.abs(corners).max(axis=(1, 2)) + np.abs(edges[:, :2]).max(axis=(1, 2))
        # Rays start 16 spacings of float32 off their face.
        offset[some] = 16 * np.finfo(np.float32).eps * reach
    ray_scene = RayScene(vertices, scene.triangles)
    kept = scene.footprint, scene.triangle_surface
    return _Faces(ray_scene, vertices, scene.triangles, along, normal, area, width, offset, *kept)


def _follow_rays(faces, rows, side, count, *, hops=8, sheet=None, report_share=silent):
    """Trace cosine-distributed rays from one side of some triangles, and on from whichever side of
    a face they hit.

    Every triangle sends the same rays in its own frame, so that the result does not depend on its
    name or index, and more rays begin with the same ones as fewer.

    Parameters
    ----------
    faces : Faces
    rows : (r,) int
    side : {-1, 1}
        Back or front.
    count : int
        Rays from each triangle.
    hops : int
    sheet : (t,) bool, optional
        Triangles whose backs count as fronts.
    report_share : callable, optional
        Called as report_share(share) with the share that is done, 0 to 1.

    Returns
    -------
    backs : (r,) int64
        Number of the rays that hit a back first.
    sky : (r,) int64
        Number that reaches the sky, directly or after hops.
    """
    # Places on the triangle and directions from it, and fresh directions for each hop.
    u, v, w, x = sample_points.additive_recurrence(count, 4).T
    keys = np.arange(1, count + 1).astype(np.uint64) * GOLDEN
    onward = [
        sample_points.cosine_direction(*uniform(mix(keys + np.uint64(hop)), 2).T)
        for hop in range(hops - 1)
    ]
    rays = (
        np.array(sample_points.barycentric_of_square(u, v)),
        np.array([sample_points.cosine_direction(w, x), *onward]),
    )
    threads = usable_threads()
    # Triangles in portions small enough for the cache, spread over the threads.
    step = max(1, min(RAYS_PER_TASK // count, -(-len(rows) // threads)))
    tasks, found = (
        [rows[first : first + step] for first in range(0, len(rows), step)],
        [np.zeros((2, 0), np.int64)],
    )
    for part in map_in_order(
        lambda some: _follow_some(faces, some, side, rays, sheet), tasks, threads
    ):
        found.append(part)
        report_share((len(found) - 1) / len(tasks))
    return np.concatenate(found, axis=1)


def _follow_some(faces, rows, side, rays, sheet):
    """What `_follow_rays` returns, of some triangles.

    `rays` are the same for all: barycentric weights of where they start, (2, n), and unit vectors
    in the frames of the triangle and of each face that they hit, (hops, 3, n), all float32.
    """
    weights, local = rays
    count, sky = local.shape[2], np.zeros(len(rows), np.int64)
    # Ray and triangle of each row; a hop starts where the one before ended, on the side that it
    # hit.
    owner, number = np.divmod(np.arange(len(rows) * count), count)
    met, sides, weights = rows[owner], np.full(len(owner), float(side)), weights[:, number]
    for hop, towards in enumerate(local):
        origins, directions = _leave_faces(faces, met, weights, sides, towards[:, number])
        hit, *weights = faces.ray_scene.trace_places(origins, directions)
        # First hits on backs are counted, and rays that leave upwards at any hop.
        along = (faces.normal[hit] * directions).sum(axis=1)  # positive at backs
        if hop == 0:
            back = (hit >= 0) & ((along > 0) | faces.footprint[hit])
            back &= True if sheet is None else ~sheet[hit]
            backs = np.bincount(owner[back], minlength=len(rows))
        sky += np.bincount(owner[(hit < 0) & (directions[:, 2] > 0)], minlength=len(rows))
        going = np.flatnonzero(hit >= 0)
        if not len(going):
            break
        owner, number, met, sides = owner[going], number[going], hit[going], -np.sign(along[going])
        weights = [weight[going] for weight in weights]
    return backs, sky


def _leave_faces(faces, rows, weights, sides, local):
    """Origins and directions, (m, 3) float32 each, of rays from places on triangles, on one side or
    the other.
    """
    weights, local = (
        tuple(np.asarray(part, float) for part in parts) for parts in (weights, local)
    )
    rays = np.empty((2, 3, len(rows)), np.float32)
    shapes = faces.vertices, faces.triangles, faces.along, faces.normal, faces.offset
    _write_rays(
        shapes, (np.asarray(rows, np.int32), *weights, np.asarray(sides, float)), local, rays
    )
    return rays[0].T, rays[1].T


@njit(nogil=True, cache=True)
def _write_rays(shapes, places, local, rays):
    """Write origins and directions, (2, 3, m) float32, for `_leave_faces`.

    Parameters
    ----------
    shapes : tuple
        `vertices`, `triangles`, `along`, `normal` and `offset` of Faces.
    places : tuple of (m,) int32 and three (m,) float64
        Face, barycentric weights, and side of each.
    local : tuple of three (m,) float64
        Directions in the frame of the face.
    rays : (2, 3, m) float32
    """
    (vertices, triangles, along, normal, offset), (rows, b1, b2, sides), (x, y, z) = (
        shapes,
        places,
        local,
    )
    for ray in range(len(rows)):
        face = rows[ray]
        a, b, c = triangles[face, 0], triangles[face, 1], triangles[face, 2]
        for axis in range(3):
            # The frame of the face, on the side of the ray: along, across, up.
            one, other = (axis + 1) % 3, (axis + 2) % 3
            up = sides[ray] * normal[face, axis]
            across = normal[face, one] * along[face, other] - normal[face, other] * along[face, one]
            # The place between the corners a, b and c, lifted off the face.
            start = vertices[a, axis]
            place = (
                start
                + b1[ray] * (vertices[b, axis] - start)
                + b2[ray] * (vertices[c, axis] - start)
            )
            rays[0, axis, ray] = place + offset[face] * up
            rays[1, axis, ray] = x[ray] * along[face, axis] + y[ray] * across + z[ray] * up


def _look_straight(faces, rows, side, reach):
    """Share of the points of each triangle with a front straight ahead of one of its sides, within
    `reach`.

    Parameters
    ----------
    faces : Faces
    rows : (r,) int
    side : {-1, 1}
    reach : float [m]

    Returns
    -------
    (r,) float64
    """
    # A ray along the normal from a few points; the share of them that has a front near.
    found, points = np.zeros(len(rows)), sample_points.additive_recurrence(PERPENDICULAR, 2)
    step = RAYS_PER_TASK // PERPENDICULAR
    for first in range(0, len(rows), step):
        owner = np.repeat(rows[first : first + step], PERPENDICULAR)
        weights = sample_points.barycentric_of_square(
            *np.tile(points.T, len(owner) // PERPENDICULAR)
        )
        ahead = np.zeros(len(owner)), np.zeros(len(owner)), np.ones(len(owner))
        origins, directions = _leave_faces(
            faces, owner, weights, np.full(len(owner), float(side)), ahead
        )
        seen = look(faces.vertices, faces.triangles, origins, directions, ray_scene=faces.ray_scene)
        near = seen.front & (seen.distance < reach)
        found[first : first + step] = near.reshape(-1, PERPENDICULAR).mean(axis=1)
    return found
