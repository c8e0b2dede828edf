"""Patches: the triangles of the scene as receivers and reflectors of light, and what their rays
follow from.

All of it follows from the triangle itself, its name or its place, so that an edit of the city
elsewhere changes none.
"""

import re
from dataclasses import dataclass, fields

import numpy as np

from ..city.find_ground import find_ground, find_resting_floors
from ..rays import random_numbers
from ..settings.errors import check_array, check_seed

# of a surface, behind its building's: see `city.assemble_city`
MADE_UP = re.compile(r"(_\d+|.*~\d+)([#/].*)?")
UNNAMED = "\x00"


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
    # (p,) uint32, points of the sequence that each replicate of its rays took before
    rays_before: np.ndarray
    points_before: np.ndarray  # (p,) uint32, points that its shadow points took before
    # (p,) uint64, the same for every seed: what is covered is geometry, not chance
    place_key: np.ndarray
    albedo: np.ndarray  # (p,) float32
    # (p, 4) float32, normal and 2 for footprints (visible only from under a building), else 0
    facing: np.ndarray
    ground: np.ndarray  # (p,) bool, ground: points below it are in the earth
    other_side: np.ndarray  # (p,) int32, the patch on the other side of a sheet; -1 if not a sheet
    receives: np.ndarray  # (p,) bool, false for footprints, closures, floors at rest and no area

    def __len__(self):
        return len(self.corner)

    def take(self, chosen):
        """Some rows of the patches."""
        return Patches(
            **{field.name: getattr(self, field.name)[chosen] for field in fields(Patches)}
        )

    def meets_back(self, hit, directions):
        """Whether rays hit the back of a patch: they go along its normal, or it is a footprint.
        Sheets have no back.

        Parameters
        ----------
        hit : (c, rays) int32
            -1 where nothing is hit.
        directions : (c, rays, 3) float32

        Returns
        -------
        (c, rays) bool
        """
        facing = self.facing[hit]
        along = directions[..., 0] * facing[..., 0]
        along += directions[..., 1] * facing[..., 1]
        along += directions[..., 2] * facing[..., 2]
        along += facing[..., 3]
        return (along > 0) & (hit >= 0) & (self.other_side[hit] < 0)


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
    scene.check()
    check_seed(seed)
    albedo = check_array("albedo", albedo, (len(scene.triangles),), least=0, most=1)
    # Normal and area from two edges of each triangle.
    corners = np.asarray(scene.vertices, float)[scene.triangles]  # (t, 3, 3)
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    # The frame depends on the triangle only, and so turns with it, as its rays do.
    along = (
        edges[:, 0] / np.maximum(np.linalg.norm(edges[:, 0], axis=1), np.finfo(float).tiny)[:, None]
    )
    ground = find_ground(scene)
    # Rays start off the plane, and a little inside the edges, so that neighbours do not catch them.
    offset = _measure_offset(corners, edges, normal)
    inset = _inset_triangles(corners, length, offset)
    # Random numbers follow from the seed and from the place of the triangle.
    key, place_key = keys_of_triangles(scene, seed, 0)
    return Patches(
        corner=inset[:, 0].astype(np.float32),
        edges=(inset[:, 1:] - inset[:, :1]).astype(np.float32),
        normal=normal.astype(np.float32),
        tangents=np.stack([along, np.cross(normal, along)], axis=1).astype(np.float32),
        area=length / 2,
        offset=offset.astype(np.float32),
        key=key,
        rays_before=np.zeros(len(edges), np.uint32),
        points_before=np.zeros(len(edges), np.uint32),
        place_key=place_key,
        albedo=albedo.astype(np.float32),
        facing=np.column_stack([normal, 2 * scene.footprint]).astype(np.float32),
        ground=ground,
        other_side=scene.other_sides,
        receives=~scene.closure & ~find_resting_floors(scene, ground) & (length > 0),
    )


def _measure_offset(corners, edges, normal):
    """How far above its face a ray must start so as not to hit the face itself or others in its
    plane.

    Rounding moves a point off the face only by the components of the normal along each axis: a roof
    at the far end of a wide plain needs no larger offset than one in the middle. A large neighbour
    in the same plane may be off by the rounding of its own far corners; how large one can be is
    rounded, so that no other face changes this one's rays.

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
    largest = 2.0 ** np.ceil(np.log2(own.max(initial=1)))
    # The plane of a large neighbour errs by a spacing at a 16th of its longest edge.
    reach = np.maximum(np.abs(corners).max(axis=1), largest / 16)
    # Rays start eight float32 spacings off their face; at two the first rays get lost.
    return 8 * np.finfo(np.float32).eps * ((np.abs(normal) * reach).sum(axis=1) + own)


def _inset_triangles(corners, doubled_area, offset):
    """Triangles scaled towards their middles so that their edges lie one offset further in.

    By rounding, a ray from the very edge of a face might start on the wrong side of the adjacent
    face, and escape from a closed room.

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
    # The middle is a third of the height away from each edge; slivers thinner than their offset
    # shrink very little.
    height = doubled_area / np.maximum(longest, np.finfo(float).tiny)
    # Corners move by at most a 64th of their distance to the middle.
    share = np.minimum(3 * offset / np.maximum(height, np.finfo(float).tiny), 1 / 64)
    return corners + share[:, None, None] * (corners.mean(axis=1, keepdims=True) - corners)


def keys_of_triangles(scene, *seeds):
    """One random key per triangle, from the name of its surface and its number there, or from its
    place.

    Returns
    -------
    list of (t,) uint64
        For each seed.
    """
    names = np.where(_find_made_up(scene), UNNAMED, np.array(scene.surfaces.surface_id, object))
    digests = random_numbers.digest_names([*names, UNNAMED])
    number = number_triangles(scene) if scene.number is None else scene.number
    own = random_numbers.mix(number.astype(np.uint64) + np.uint64(1))
    # The ground's -1 takes the last name.
    return [
        random_numbers.mix(
            random_numbers.key_of_digests(digests, seed)[scene.surface_of_triangle] ^ own
        )
        for seed in seeds
    ]


def number_triangles(scene):
    """What tells each triangle from the others of its surface: (t,) int64.

    Its index among them, or, on the ground and on surfaces whose names the reader made up, its
    place: neither the order of a file nor an edit elsewhere changes it.
    """
    surface = scene.surface_of_triangle
    order = np.argsort(surface, kind="stable")
    number = np.empty(len(surface), np.int64)
    number[order] = np.arange(len(surface)) - np.searchsorted(surface[order], surface[order])
    rows = np.flatnonzero(np.append(_find_made_up(scene), True)[surface])
    corners = np.asarray(scene.vertices, float)[scene.triangles[rows]]
    # Places are rounded to centimetres, and moved off the ties that middles of corners in
    # millimetres have.
    cells = np.round(scene.site.to_files(corners.mean(axis=1)) / 0.01 + 0.0123).astype(np.int64)
    # Random numbers repeat after squares of 10 m × 2¹⁰.
    cells[:, :2] %= 1_024_000  # so a city moved by whole squares of the ground stays the same
    cells[surface[rows] < 0, 2] = 0  # ground has one height at a place
    # Hardly any face is parallel to this vector: it tells which of two opposite sides one is.
    cells[:, 2] = 2 * cells[:, 2] + (
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        @ np.array([0.36, 0.48, 0.8])
        > 0
    )
    east, north, height = cells.view(np.uint64).T
    number[rows] = random_numbers.mix(
        random_numbers.mix(random_numbers.mix(east) ^ north) ^ height
    ).view(np.int64)
    return number


def _find_made_up(scene):
    """Surfaces whose names tell only their order in the file, for want of another or of a unique
    one: (n,) bool.
    """
    surfaces = scene.surfaces
    pairs = zip(surfaces.surface_id, surfaces.building_id, strict=True)
    return np.array(
        [MADE_UP.fullmatch(name.removeprefix(building)) is not None for name, building in pairs],
        bool,
    )
