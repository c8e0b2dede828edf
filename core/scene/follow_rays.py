"""Rays that start on either side of faces and continue from whatever they hit, and where they end."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..rays.ray_scene import RayScene
from ..sampling.random_numbers import GOLDEN, mix, uniform
from ..sampling.sample_points import additive_recurrence, barycentric_of_square, cosine_direction
from ..settings.progress import ignore_share
from ..settings.threads import map_in_order, usable_threads
from .find_ground import AT_ONCE

HOPS = 8  # largest number of faces that a ray is followed to
SPACINGS = 16  # of float32: distance of ray origins from their face
RAYS_PER_TASK = 1 << 13  # so that what they need stays in the cache
PERPENDICULAR = 4  # points per triangle with a ray straight ahead
MARGIN = 1e-9  # relative, of sums, so that their rounding decides nothing


@dataclass
class Faces:
    """Triangles and the tracer that finds them."""

    ray_scene: RayScene
    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int into vertices
    along: np.ndarray  # (t, 3) float64, a tangent: the first edge
    normal: np.ndarray  # (t, 3) float64
    area: np.ndarray  # (t,) float64 [m²]
    offset: np.ndarray  # (t,) float64 [m], distance of ray origins from the face
    footprint: np.ndarray  # (t,) bool, counts as a back from either side


class Enough(NamedTuple):
    """When enough rays of an object have reached the sky: their number, weighted by triangles, is at least so many."""

    owner: np.ndarray  # (r,) int, the object of each triangle
    weight: np.ndarray  # (r,) float64, its share of the object's area
    least: float


def faces_of_scene(scene):
    """Faces of a scene."""
    vertices, count = np.asarray(scene.vertices, float), len(scene.triangles)
    along, normal = np.empty((2, count, 3))
    area, offset = np.empty((2, count))
    for first in range(0, count, AT_ONCE):
        some = slice(first, first + AT_ONCE)
        along[some], normal[some], area[some], offset[some] = measure_faces(vertices[scene.triangles[some]])
    ray_scene = RayScene(vertices, scene.triangles)
    return Faces(ray_scene, vertices, scene.triangles, along, normal, area, offset, scene.footprint)


def measure_faces(corners):
    """Tangent, normal, area and offset, as in `Faces`, of triangles (t, 3, 3)."""
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    doubled = np.linalg.norm(normal, axis=1)
    tiny = np.finfo(float).tiny
    normal /= np.maximum(doubled, tiny)[:, None]
    along = edges[:, 0] / np.maximum(np.linalg.norm(edges[:, 0], axis=1), tiny)[:, None]
    reach = np.abs(corners).max(axis=(1, 2)) + np.abs(edges).max(axis=(1, 2))
    return along, normal, doubled / 2, SPACINGS * np.finfo(np.float32).eps * reach


def follow_rays(faces, rows, side, count, *, hops=HOPS, sheet=None, enough=None, report_share=ignore_share):
    """Trace cosine-distributed rays from one side of some triangles, and on from whichever side of a face they hit.

    Every triangle sends the same rays in its own frame, so that the result does not depend on its name or index, and
    more rays begin with the same ones as fewer.

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
    enough : Enough, optional
        When the rays of an object are not followed any further.
    report_share : callable, optional
        Called as report_share(share) with the share that is done, 0 to 1.

    Returns
    -------
    backs : (r,) int64
        Number of the rays that hit a back first.
    sky : (r,) int64
        Number that reaches the sky, directly or after hops; with `enough`, at least so many.
    """
    backs, sky = np.zeros((2, len(rows)), np.int64)
    local, threads = directions_of_rays(count, hops), usable_threads()
    step = max(1, min(RAYS_PER_TASK // count, -(-len(rows) // threads)))

    def follow(begin):
        some = slice(begin, begin + step)
        stop = enough and Enough(number_from_zero(enough.owner[some]), enough.weight[some], enough.least)
        backs[some], sky[some] = follow_some(faces, rows[some], side, local, sheet=sheet, enough=stop)

    tasks = range(0, len(rows), step)
    for done, _ in enumerate(map_in_order(follow, tasks, threads), 1):
        report_share(done / len(tasks))
    return backs, sky


def directions_of_rays(count, hops):
    """Where rays start on any triangle, and where they go from it and from each face that they hit, in its frame.

    Returns
    -------
    weights : (2, n) float32, barycentric
    local : (hops, 3, n) float32, unit vectors
    """
    u, v, w, x = additive_recurrence(count, 4).T
    keys = np.arange(1, count + 1).astype(np.uint64) * GOLDEN
    onward = [cosine_direction(*uniform(mix(keys + np.uint64(hop)), 2).T) for hop in range(hops - 1)]
    return np.array(barycentric_of_square(u, v)), np.array([cosine_direction(w, x), *onward])


def follow_some(faces, rows, side, rays, *, sheet, enough):
    """What `follow_rays` returns, of some triangles; `rays` are those of `directions_of_rays`."""
    weights, local = rays
    count, sky = local.shape[2], np.zeros(len(rows), np.int64)
    owner, number = np.divmod(np.arange(len(rows) * count), count)
    met, sides, weights = rows[owner], np.full(len(owner), float(side)), weights[:, number]
    for hop, towards in enumerate(local):
        origins, directions = leave_faces(faces, met, weights, sides, towards[:, number])
        hit, *weights = faces.ray_scene.trace_places(origins, directions)
        along = against_normals(faces, hit, directions)
        if hop == 0:
            back = (hit >= 0) & ((along > 0) | faces.footprint[hit])
            back &= True if sheet is None else ~sheet[hit]
            backs = np.bincount(owner[back], minlength=len(rows))
        sky += np.bincount(owner[(hit < 0) & (directions[:, 2] > 0)], minlength=len(rows))
        going = hit >= 0
        if enough:
            going &= ~has_enough(enough, sky)[owner]
        going = np.flatnonzero(going)
        if not len(going):
            break
        owner, number, met, sides = owner[going], number[going], hit[going], -np.sign(along[going])
        weights = [weight[going] for weight in weights]
    return backs, sky


def number_from_zero(owner):
    """Numbers of objects, (r,) int, replaced by 0, 1, … in their order."""
    return np.unique(owner, return_inverse=True)[1]


def has_enough(enough, sky):
    """Triangles of objects of which enough rays have reached the sky: (r,) bool."""
    reached = np.bincount(enough.owner, enough.weight * sky)
    return (reached >= enough.least * (1 + MARGIN))[enough.owner]


def leave_faces(faces, rows, weights, sides, local):
    """Origins and directions, (m, 3) float32 each, of rays from places on triangles, on one side or the other."""
    (b1, b2), (x, y, z) = (np.asarray(parts, float) for parts in (weights, local))
    corners, along, normal = faces.vertices[faces.triangles[rows]], faces.along[rows].T, faces.normal[rows].T
    offset, across = faces.offset[rows], cross(normal, along)
    origins, directions = np.empty((2, 3, len(rows)), np.float32)
    for axis in range(3):  # columns, since rows of three are short for numpy
        a, b, c = (corners[:, corner, axis] for corner in range(3))
        up = sides * normal[axis]
        origins[axis] = a + b1 * (b - a) + b2 * (c - a) + offset * up
        directions[axis] = x * along[axis] + y * across[axis] + z * up
    return origins.T, directions.T


def cross(one, other):
    """Cross products of vectors, (3, n) each: x, y and z, (n,) each."""
    (a, b, c), (u, v, w) = one, other
    return b * w - c * v, c * u - a * w, a * v - b * u


def against_normals(faces, hit, directions):
    """Cosine between each ray, (m, 3), and the normal of the triangle that it hits, (m,): positive at its back."""
    (x, y, z), (u, v, w) = faces.normal[hit].T, directions.T
    return x * u + y * v + z * w


def look_straight(faces, rows, side, reach):
    """Share of the points of each triangle with a front straight ahead of one of its sides, within `reach`.

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
    step = RAYS_PER_TASK // PERPENDICULAR
    parts = [look_some(faces, rows[first : first + step], side, reach) for first in range(0, len(rows), step)]
    return np.concatenate(parts) if parts else np.zeros(0)


def look_some(faces, rows, side, reach):
    """What `look_straight` returns, of some triangles."""
    points = additive_recurrence(PERPENDICULAR, 2)
    weights = barycentric_of_square(*(np.tile(points[:, k], len(rows)) for k in (0, 1)))
    owner = np.repeat(rows, PERPENDICULAR)
    ahead = np.zeros((2, len(owner)))
    origins, directions = leave_faces(
        faces, owner, weights, np.full(len(owner), float(side)), (*ahead, np.ones(len(owner)))
    )
    hit = faces.ray_scene.trace_closest(origins, directions)
    normal, corner = faces.normal[hit], faces.vertices[faces.triangles[hit, 0]]
    along = np.einsum("mx,mx->m", directions, normal)
    away = np.einsum("mx,mx->m", corner - origins, normal)
    distance = np.divide(away, along, out=np.full(len(hit), np.inf), where=along < 0)
    near = (hit >= 0) & (distance < reach)
    return near.reshape(len(rows), PERPENDICULAR).mean(axis=1)
