"""Faces: triangles as rays leave them and meet them.

Rays start off the plane of their face and a little inside its edges, so that by rounding they meet
neither the face itself nor a neighbour in its plane.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numba import njit

from ..settings.tolerances import GEOMETRY
from .ray_scene import HitPlaces


class Fate(IntEnum):
    """What becomes of a ray; leaves, backs and darkness carry no light."""

    SKY, FAR_GROUND, FRONT, LEAVES, BACK, DARK = range(6)


@dataclass
class Faces:
    """One row per triangle."""

    corner: np.ndarray  # (t, 3) float32 [m], first corner of the part that rays start from
    edges: np.ndarray  # (t, 2, 3) float32 [m], from there to the second and third corner
    normal: np.ndarray  # (t, 3) float32
    tangents: np.ndarray  # (t, 2, 3) float32, with the normal an orthonormal frame
    offset: np.ndarray  # (t,) float32 [m], distance of ray origins from the face
    # (t, 4) float32, normal and 2 for footprints (a back from either side), else 0
    facing: np.ndarray
    other_side: np.ndarray  # (t,) int32, the face on the other side of a sheet; -1 if not a sheet

    def __len__(self):
        return len(self.corner)

    def classify(self, hit, directions):
        """Fates of rays by what they hit: the back of a face if they go along its normal or it is a
        footprint, but sheets have no back.

        Parameters
        ----------
        hit : (...) int32
            -1 where nothing is hit.
        directions : (..., 3) float32

        Returns
        -------
        fate : (...) uint8
            SKY, FAR_GROUND, FRONT or BACK.
        behind : (...) bool
            Whether they come to the side that what they hit does not face.
        """
        fate, behind = np.empty(hit.shape, np.uint8), np.zeros(hit.shape, bool)
        # In memory all x come first, then all y, then all z: nothing is copied.
        parts = np.ascontiguousarray(np.moveaxis(directions, -1, 0), np.float32).reshape(3, -1)
        kinds, answers = (self.facing, self.other_side), (fate.reshape(-1), behind.reshape(-1))
        _classify(np.ascontiguousarray(hit, np.int32).reshape(-1), parts, kinds, answers)
        return fate, behind

    def meets_back(self, hit, directions):
        """Whether rays hit the back of a face, as of `classify`: (...) bool."""
        return self.classify(hit, directions)[0] == Fate.BACK

    def leave(self, places, local, side=1.0):
        """Rays from places on faces, in directions given in the frames of these.

        Parameters
        ----------
        places : HitPlaces
            m.
        local : tuple of three (m,) float
            Along the two tangents and the normal.
        side : (m,) float or float
            1 for rays from the front, -1 from the back.

        Returns
        -------
        origins, directions : (m, 3) float32
            In memory all x come first, then all y, then all z.
        """
        triangle, *weights = places
        rays = np.empty((2, 3, len(triangle)), np.float32)
        shapes = self.corner, self.edges, self.tangents, self.normal, self.offset
        side = np.full(len(triangle), side, np.float32)
        numbers = tuple(np.ascontiguousarray(part, np.float32) for part in (*weights, side, *local))
        _write_rays(shapes, np.ascontiguousarray(triangle, np.int32), numbers, rays)
        return rays[0].T, rays[1].T

    def points(self, chosen, b1, b2):
        """Ray origins just in front of faces: (c, m, 3) float32.

        Parameters
        ----------
        chosen : (c,) int
        b1, b2 : (c, m) float32
            Barycentric weights.
        """
        places = HitPlaces(np.repeat(chosen, b1.shape[1]), b1.reshape(-1), b2.reshape(-1))
        none = np.zeros(len(places.b1), np.float32)
        origins, _ = self.leave(places, (none, none, none))
        return np.moveaxis(origins.T.reshape(3, *b1.shape), 0, -1)

    def facing_distance(self, own, hits, side=1):
        """Distance from faces to those that look back at them where their rays end: (m,) float32
        [m]; infinite where what is met does not.

        Parameters
        ----------
        own : (m,) int
            The face that each ray starts from.
        hits : HitPlaces
            m; where it ends.
        side : {-1, 1}
            Of the faces, from which the rays start.
        """
        distance = np.full(len(own), np.inf, np.float32)
        own_facing = self.facing if side == 1 else -self.facing
        shapes = self.corner, self.edges, own_facing, self.facing
        _measure_facing(shapes, own, tuple(hits), GEOMETRY.facing, distance)
        return distance

    @staticmethod
    def of_triangles(corners, footprint, other_side):
        """Faces of some triangles, and their areas.

        Parameters
        ----------
        corners : (t, 3, 3) float64 [m]
        footprint : (t,) bool
        other_side : (t,) int

        Returns
        -------
        Faces
        (t,) float64 [m²]
        """
        tiny = np.finfo(float).tiny
        # Normal and area from two edges of each triangle.
        edges = corners[:, 1:] - corners[:, :1]
        normal = np.cross(edges[:, 0], edges[:, 1])
        doubled = np.linalg.norm(normal, axis=1)
        normal /= np.maximum(doubled, tiny)[:, None]
        # The frame depends on the triangle only, and so turns with it, as its rays do.
        along = edges[:, 0] / np.maximum(np.linalg.norm(edges[:, 0], axis=1), tiny)[:, None]
        offset = _measure_offset(corners, edges, normal)
        inset = _inset_triangles(corners, doubled, offset)
        faces = Faces(
            corner=inset[:, 0].astype(np.float32),
            edges=(inset[:, 1:] - inset[:, :1]).astype(np.float32),
            normal=normal.astype(np.float32),
            tangents=np.stack([along, np.cross(normal, along)], axis=1).astype(np.float32),
            offset=offset.astype(np.float32),
            facing=np.column_stack([normal, 2 * footprint]).astype(np.float32),
            other_side=other_side.astype(np.int32),
        )
        return faces, doubled / 2


@njit(nogil=True, cache=True)
def _classify(hit, directions, kinds, answers):
    """Write fates, (m,) uint8, and sides, (m,) bool, of hits, (m,) int32, and directions, (3, m)
    float32.
    """
    (facing, other_side), (fate, behind) = kinds, answers
    for ray in range(len(hit)):
        met, x, y, z = hit[ray], directions[0, ray], directions[1, ray], directions[2, ray]
        if met < 0:
            fate[ray] = Fate.SKY if z > 0 else Fate.FAR_GROUND
            continue
        along = x * facing[met, 0] + y * facing[met, 1] + z * facing[met, 2]
        behind[ray] = along > 0
        back = along + facing[met, 3] > 0 and other_side[met] < 0
        fate[ray] = Fate.BACK if back else Fate.FRONT


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
    # Rays start some float32 spacings off their face.
    return (
        GEOMETRY.spacings * np.finfo(np.float32).eps * ((np.abs(normal) * reach).sum(axis=1) + own)
    )


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


@njit(nogil=True, cache=True)
def _write_rays(shapes, triangle, numbers, rays):
    """Write origins and directions, (2, 3, m) float32, for `Faces.leave`.

    Parameters
    ----------
    shapes : tuple
        `corner`, `edges`, `tangents`, `normal` and `offset` of Faces.
    triangle : (m,) int32
    numbers : tuple of six (m,) float32
        Barycentric weights, side, and the direction along the tangents and the normal.
    rays : (2, 3, m) float32
    """
    (corner, edges, tangents, normal, offset), (b1, b2, side, x, y, z) = shapes, numbers
    for ray in range(len(triangle)):
        face = triangle[ray]
        # By rounding a hit may lie beside its face.
        along = min(max(b1[ray], np.float32(0)), np.float32(1))
        across = min(max(b2[ray], np.float32(0)), np.float32(1) - along)
        for axis in range(3):
            # The place on the face, lifted off it; the frame of the face, on the side of the ray.
            up = side[ray] * normal[face, axis]
            start = corner[face, axis] + offset[face] * up
            rays[0, axis, ray] = (
                start + along * edges[face, 0, axis] + across * edges[face, 1, axis]
            )
            rays[1, axis, ray] = (
                x[ray] * tangents[face, 0, axis] + y[ray] * tangents[face, 1, axis] + z[ray] * up
            )


@njit(nogil=True, cache=True)
def _measure_facing(shapes, own, hits, facing_cosine, distance):
    """Write the last argument, (m,) float32 [m], for `Faces.facing_distance`.

    Parameters
    ----------
    shapes : tuple of (t, 3) float32 [m], (t, 2, 3) float32 [m] and two (t, 4) float32
        `corner`, `edges`, and `facing` of `Faces`, where rays start and where they end.
    own : (m,) int
        The face that each ray starts from.
    hits : tuple of (m,) int, (m,) float32 and (m,) float32
        Of `HitPlaces`.
    facing_cosine : float
        Of `Tolerances`.
    """
    (corner, edges, own_facing, facing), (met, b1, b2) = shapes, hits
    for ray in range(len(own)):
        # cosine  between the normals of the two faces; away  distance of the hit in front of the
        # face's plane [m].
        one, other = own[ray], met[ray]
        if other < 0:
            continue
        cosine, away = np.float32(0), np.float32(0)
        for axis in range(3):
            along = b1[ray] * edges[other, 0, axis] + b2[ray] * edges[other, 1, axis]
            cosine += own_facing[one, axis] * facing[other, axis]
            away += own_facing[one, axis] * (corner[other, axis] + along - corner[one, axis])
        if cosine < -facing_cosine:
            distance[ray] = away
