"""Faces: triangles as rays leave them and meet them.

Rays start off the plane of their face and a little inside its edges, so that by rounding they meet
neither the face itself nor a neighbour in its plane.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..settings.tolerances import GEOMETRY

SKY, FAR_GROUND, FRONT, LEAVES, BACK, DARK = range(6)  # fate of a ray; the last three carry nothing


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
        return self.classify(hit, directions)[0] == BACK


@njit(nogil=True, cache=True)
def _classify(hit, directions, kinds, answers):
    """Write fates, (m,) uint8, and sides, (m,) bool, of hits, (m,) int32, and directions, (3, m)
    float32.
    """
    (facing, other_side), (fate, behind) = kinds, answers
    for ray in range(len(hit)):
        met, x, y, z = hit[ray], directions[0, ray], directions[1, ray], directions[2, ray]
        if met < 0:
            fate[ray] = SKY if z > 0 else FAR_GROUND
            continue
        along = x * facing[met, 0] + y * facing[met, 1] + z * facing[met, 2]
        behind[ray] = along > 0
        back = along + facing[met, 3] > 0 and other_side[met] < 0
        fate[ray] = BACK if back else FRONT


def faces_of_triangles(corners, footprint, other_side):
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


def leave_faces(faces, places, local, side=1.0):
    """Rays from places on faces, in directions given in the frames of these.

    Parameters
    ----------
    faces : Faces
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
    shapes = faces.corner, faces.edges, faces.tangents, faces.normal, faces.offset
    side = np.full(len(triangle), side, np.float32)
    numbers = tuple(np.ascontiguousarray(part, np.float32) for part in (*weights, side, *local))
    _write_rays(shapes, np.ascontiguousarray(triangle, np.int32), numbers, rays)
    return rays[0].T, rays[1].T


@njit(nogil=True, cache=True)
def _write_rays(shapes, triangle, numbers, rays):
    """Write origins and directions, (2, 3, m) float32, for `leave_faces`.

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
