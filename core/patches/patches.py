"""Patches: the triangles of the scene as receivers and reflectors of light."""

from dataclasses import dataclass, fields

import numpy as np

from ..sampling.random_numbers import digest_names, key_of_digests, mix
from ..scene.add_backs import other_sides
from ..scene.check_scene import check_scene
from ..scene.find_ground import find_ground
from ..settings.errors import check_array, check_seed
from .find_resting_floors import find_resting_floors

OFFSET_SPACINGS = 8  # distance of ray origins from their face in float32 spacings; at 2 the first rays get lost
LARGEST_INSET = 1 / 64  # as a share of the distance to the middle
NEIGHBOUR_SHARE = 1 / 16  # of the longest edge: error of the plane of a large neighbour, in spacings


@dataclass
class Patches:
    """One row per triangle of the scene."""

    corner: np.ndarray  # (p, 3) float32 [m], first corner of the part that rays start from
    edges: np.ndarray  # (p, 2, 3) float32 [m], from there to the second and third corner
    normal: np.ndarray  # (p, 3) float32
    tangents: np.ndarray  # (p, 2, 3) float32, with the normal an orthonormal frame
    area: np.ndarray  # (p,) float64 [m²]
    offset: np.ndarray  # (p,) float32 [m], distance of ray origins from the face
    key: np.ndarray  # (p,) uint64, key of the random numbers
    rays_before: np.ndarray  # (p,) uint32, points of the sequence that each replicate of its rays took before
    points_before: np.ndarray  # (p,) uint32, the same of its shadow points
    place_key: np.ndarray  # (p,) uint64, the same for every seed: what is covered is geometry, not chance
    albedo: np.ndarray  # (p,) float32
    facing: np.ndarray  # (p, 4) float32, normal and 2 for footprints (visible only from under a building), else 0
    ground: np.ndarray  # (p,) bool, ground: points below it are in the earth
    other_side: np.ndarray  # (p,) int32, the patch on the other side of a sheet; -1 if not a sheet
    receives: np.ndarray  # (p,) bool, false for footprints, closures, floors at rest and no area

    def __len__(self):
        return len(self.corner)


def take_patches(patches, chosen):
    """Some rows of the patches."""
    return Patches(**{field.name: getattr(patches, field.name)[chosen] for field in fields(Patches)})


def patches_of_scene(scene, albedo, seed):
    """Patches of a scene.

    Parameters
    ----------
    scene : Scene
    albedo : (t,) float
        Of each triangle.
    seed : int

    Raises
    ------
    InputError
        If an array is invalid; names it and the place in it.
    """
    check_scene(scene)
    check_seed(seed)
    albedo = check_array("albedo", albedo, (len(scene.triangles),), least=0, most=1)
    corners = np.asarray(scene.vertices, float)[scene.triangles]  # (t, 3, 3)
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    ground = find_ground(scene)
    offset = measure_offset(corners, edges, normal)
    inset = inset_triangles(corners, length, offset)
    key, place_key = keys_of_triangles(scene, seed, 0)
    return Patches(
        corner=inset[:, 0].astype(np.float32),
        edges=(inset[:, 1:] - inset[:, :1]).astype(np.float32),
        normal=normal.astype(np.float32),
        tangents=tangent_frame(edges[:, 0], normal).astype(np.float32),
        area=length / 2,
        offset=offset.astype(np.float32),
        key=key,
        rays_before=np.zeros(len(edges), np.uint32),
        points_before=np.zeros(len(edges), np.uint32),
        place_key=place_key,
        albedo=albedo.astype(np.float32),
        facing=np.column_stack([normal, 2 * scene.footprint]).astype(np.float32),
        ground=ground,
        other_side=other_sides(scene),
        receives=~scene.closure & ~find_resting_floors(scene, ground) & (length > 0),
    )


def measure_offset(corners, edges, normal):
    """How far above its face a ray must start so as not to hit the face itself or others in its plane.

    Rounding moves a point off the face only by the components of the normal along each axis: a roof at the far end of a
    wide plain needs no larger offset than one in the middle. A large neighbour in the same plane may be off by the
    rounding of its own far corners.

    Parameters
    ----------
    corners : (t, 3, 3) float64 [m]
    edges : (t, 2, 3) float64 [m]
    normal : (t, 3) float64

    Returns
    -------
    (t,) float64 [m]
    """
    own = np.abs(edges).max(axis=(1, 2), initial=0)
    reach = np.maximum(np.abs(corners).max(axis=1), NEIGHBOUR_SHARE * own.max(initial=0))
    return OFFSET_SPACINGS * np.finfo(np.float32).eps * ((np.abs(normal) * reach).sum(axis=1) + own)


def inset_triangles(corners, doubled_area, offset):
    """Triangles scaled towards their middles so that their edges lie one offset further in.

    By rounding, a ray from the very edge of a face might start on the wrong side of the adjacent face, and escape from
    a closed room.

    Parameters
    ----------
    corners : (t, 3, 3) float64 [m]
    doubled_area : (t,) float64 [m²]
    offset : (t,) float64 [m]

    Returns
    -------
    (t, 3, 3) float64 [m]
    """
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    # The middle is a third of the height away from each edge; slivers thinner than their offset shrink very little.
    height = doubled_area / np.maximum(longest, np.finfo(float).tiny)
    share = np.minimum(3 * offset / np.maximum(height, np.finfo(float).tiny), LARGEST_INSET)
    return corners + share[:, None, None] * (corners.mean(axis=1, keepdims=True) - corners)


def tangent_frame(edge, normal):
    """Two unit vectors that form an orthonormal frame with each normal, the first along an edge.

    The frame depends on the triangle only, and so turns with it: if city and suns are rotated together, the rays are
    the same.

    Parameters
    ----------
    edge, normal : (n, 3) float64

    Returns
    -------
    (n, 2, 3) float64
        Zero where the edge has no length.
    """
    length = np.linalg.norm(edge, axis=1)
    first = edge / np.maximum(length, np.finfo(float).tiny)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)


def keys_of_triangles(scene, *seeds):
    """One random key per triangle, from the name of its surface and its index among the surface's triangles.

    Returns
    -------
    list of (t,) uint64
        For each seed.
    """
    digests = digest_names([*scene.surfaces.surface_id, "\x00ground"])
    number = number_triangles(scene.triangle_surface) if scene.number is None else scene.number
    own = mix(number.astype(np.uint64) + np.uint64(1))
    # The ground's -1 takes the last name.
    return [mix(key_of_digests(digests, seed)[scene.triangle_surface] ^ own) for seed in seeds]


def number_triangles(surface):
    """Index of each triangle among those of its surface, (t,) int64, from their surfaces, (t,) int."""
    order = np.argsort(surface, kind="stable")
    first = np.searchsorted(surface[order], surface[order])
    number = np.empty(len(surface), np.int64)
    number[order] = np.arange(len(surface)) - first
    return number
