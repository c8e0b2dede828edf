"""Rays that start on either side of faces and continue from whatever they hit, and where they end."""

from dataclasses import dataclass

import numpy as np

from ..progress import ignore_share
from ..rays.ray_scene import RayScene
from ..sampling.random_numbers import GOLDEN, mix, uniform
from ..sampling.sample_points import additive_recurrence, barycentric_of_square, cosine_direction
from ..threads import map_in_order, usable_threads

HOPS = 8  # largest number of faces that a ray is followed to
SPACINGS = 16  # of float32: distance of ray origins from their face
RAYS_PER_TASK = 1 << 16  # of some 700 bytes each
PERPENDICULAR = 4  # points per triangle with a ray straight ahead


@dataclass
class Faces:
    """Triangles and the tracer that finds them."""

    ray_scene: RayScene
    corners: np.ndarray  # (t, 3, 3) float64 [m]
    frame: np.ndarray  # (t, 3, 3) float64, two tangents and the normal
    area: np.ndarray  # (t,) float64 [m²]
    offset: np.ndarray  # (t,) float64 [m], distance of ray origins from the face
    footprint: np.ndarray  # (t,) bool, counts as a back from either side


def faces_of_scene(scene):
    """Faces of a scene."""
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    doubled = np.linalg.norm(normal, axis=1)
    tiny = np.finfo(float).tiny
    normal /= np.maximum(doubled, tiny)[:, None]
    along = edges[:, 0] / np.maximum(np.linalg.norm(edges[:, 0], axis=1), tiny)[:, None]
    reach = np.abs(corners).max(axis=(1, 2)) + np.abs(edges).max(axis=(1, 2))
    return Faces(
        ray_scene=RayScene(scene.vertices, scene.triangles),
        corners=corners,
        frame=np.stack([along, np.cross(normal, along), normal], axis=1),
        area=doubled / 2,
        offset=SPACINGS * np.finfo(np.float32).eps * reach,
        footprint=scene.footprint,
    )


def follow_rays(faces, rows, side, count, *, hops=HOPS, sheet=None, report_share=ignore_share):
    """Trace cosine-distributed rays from one side of some triangles, and on from whichever side of a face they hit.

    Every triangle sends the same rays in its own frame, so that the result does not depend on its name or index.

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
    backs : (r,) float64
        Share of the rays that hit a back first.
    sky : (r,) float64
        Share that reaches the sky, directly or after hops.
    """
    backs, sky = np.zeros((2, len(rows)))
    first, threads = additive_recurrence(count, 4), usable_threads()
    step = max(1, min(RAYS_PER_TASK // count, -(-len(rows) // threads)))

    def follow(begin):
        some = slice(begin, begin + step)
        backs[some], sky[some] = follow_some(faces, rows[some], side, first, hops=hops, sheet=sheet)

    tasks = range(0, len(rows), step)
    for done, _ in enumerate(map_in_order(follow, tasks, threads), 1):
        report_share(done / len(tasks))
    return backs, sky


def follow_some(faces, some, side, first, *, hops, sheet):
    """What `follow_rays` returns, of some triangles; `first` are the random numbers of their rays, (count, 4)."""
    count, sky = len(first), np.zeros(len(some))
    u, v, w, x = (np.tile(first[:, k], len(some)) for k in range(4))
    weights, owner = barycentric_of_square(u, v), np.repeat(np.arange(len(some)), count)
    rays, met, sides = np.tile(np.arange(count), len(some)), some[owner], np.full(len(owner), float(side))
    local = cosine_direction(w, x)
    for hop in range(hops):
        origins, directions = leave_faces(faces, met, weights, sides, local)
        hit, *weights = faces.ray_scene.trace_places(origins, directions)
        along = np.einsum("mx,mx->m", directions, faces.frame[hit, 2])
        if hop == 0:
            back = (hit >= 0) & ((along > 0) | faces.footprint[hit])
            back &= True if sheet is None else ~sheet[hit]
            backs = np.bincount(owner, back, len(some)) / count
        risen = (hit < 0) & (directions[:, 2] > 0)
        sky += np.bincount(owner, risen, len(some)) / count
        going = hit >= 0
        owner, rays, met, sides = owner[going], rays[going], hit[going], -np.sign(along[going])
        weights = [weight[going] for weight in weights]
        if not len(met):
            break
        words = mix((rays + 1).astype(np.uint64) * GOLDEN + np.uint64(hop))
        local = cosine_direction(*uniform(words, 2).T)
    return backs, sky


def leave_faces(faces, rows, weights, sides, local):
    """Origins and directions, (m, 3) float32 each, of rays from places on triangles, on one side or the other."""
    b1, b2 = (np.asarray(weight, float)[:, None] for weight in weights)
    corners, frame = faces.corners[rows], faces.frame[rows]
    places = corners[:, 0] + b1 * (corners[:, 1] - corners[:, 0]) + b2 * (corners[:, 2] - corners[:, 0])
    up = sides[:, None] * frame[:, 2]
    origins = places + faces.offset[rows, None] * up
    x, y, z = (np.asarray(part, float)[:, None] for part in local)
    return origins.astype(np.float32), (x * frame[:, 0] + y * frame[:, 1] + z * up).astype(np.float32)


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
    normal = faces.frame[hit, 2]
    along = np.einsum("mx,mx->m", directions, normal)
    away = np.einsum("mx,mx->m", faces.corners[hit, 0] - origins, normal)
    distance = np.divide(away, along, out=np.full(len(hit), np.inf), where=along < 0)
    near = (hit >= 0) & (distance < reach)
    return near.reshape(len(rows), PERPENDICULAR).mean(axis=1)
