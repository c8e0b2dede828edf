"""Patches: the triangles of the scene as places that receive and reflect light."""

from dataclasses import dataclass

import numpy as np

from ..check_arrays import check_array, check_seed
from ..sampling.random_numbers import key_of_names, mix
from ..scene.add_backs import other_sides
from ..scene.check_scene import check_scene
from ..scene.find_ground import find_ground
from .find_buried import find_buried

OFFSET_SPACINGS = 8  # distance of ray origins from their face in float32 spacings; with 2 the first rays are lost
LARGEST_SHARE_DRAWN_IN = 1 / 64  # of the way to the middle
NEIGHBOUR_SHARE = 1 / 16  # of the longest edge: how far off the plane of a large neighbour may be, in spacings


@dataclass
class Patches:
    """One row per triangle of the scene."""

    corner: np.ndarray  # (p, 3) float32 [m], first corner of the part that rays start from
    edges: np.ndarray  # (p, 2, 3) float32 [m], from there to the second and third corner
    normal: np.ndarray  # (p, 3) float32
    tangents: np.ndarray  # (p, 2, 3) float32, with the normal an orthonormal frame
    area: np.ndarray  # (p,) float64 [m²]
    offset: np.ndarray  # (p,) float32 [m], how far above its face a ray starts
    key: np.ndarray  # (p,) uint64, of its random numbers
    albedo: np.ndarray  # (p,) float32
    facing: np.ndarray  # (p, 4) float32, normal and 2 for footprints (whoever sees one is under a building), else 0
    ground: np.ndarray  # (p,) bool, the ground: whatever has it above itself lies in the earth
    other_side: np.ndarray  # (p,) int32, the patch on the other side of a sheet; -1 for all that have a thickness
    receives: np.ndarray  # (p,) bool, false where a patch closes a building, lies on the ground or has no area

    def __len__(self):
        return len(self.corner)


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
        Names the array that cannot be used, and where in it.
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
    drawn_in = draw_in(corners, length, offset)
    return Patches(
        corner=drawn_in[:, 0].astype(np.float32),
        edges=(drawn_in[:, 1:] - drawn_in[:, :1]).astype(np.float32),
        normal=normal.astype(np.float32),
        tangents=tangent_frame(edges[:, 0], normal).astype(np.float32),
        area=length / 2,
        offset=offset.astype(np.float32),
        key=keys_of_triangles(scene, seed),
        albedo=albedo.astype(np.float32),
        facing=np.column_stack([normal, 2 * scene.footprint]).astype(np.float32),
        ground=ground,
        other_side=other_sides(scene),
        receives=~scene.closure & ~find_buried(scene, ground) & (length > 0),
    )


def measure_offset(corners, edges, normal):
    """How far above its face a ray must start to miss the face itself and those that lie in its plane.

    Rounding moves a point across the face only as far as the face's normal leans to each axis: a roof far out on a
    wide plain needs no more than one in the middle. A large neighbour in the same plane may be off by the rounding of
    its own far corners.

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


def draw_in(corners, doubled_area, offset):
    """Triangles drawn in towards their middles until their edges lie one offset further in.

    A ray that started on the very edge of a face might start, by rounding, on the wrong side of the next face, and
    leave a closed room.

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
    # The middle stands a third of the height above each edge; slivers thinner than their offset stay nearly whole.
    height = doubled_area / np.maximum(longest, np.finfo(float).tiny)
    share = np.minimum(3 * offset / np.maximum(height, np.finfo(float).tiny), LARGEST_SHARE_DRAWN_IN)
    return corners + share[:, None, None] * (corners.mean(axis=1, keepdims=True) - corners)


def tangent_frame(edge, normal):
    """Two unit vectors that make an orthonormal frame with each normal, the first along an edge.

    A frame that hangs on the triangle alone turns with it: a city that is turned as a whole, sun and all, sends the
    same rays.

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


def keys_of_triangles(scene, seed):
    """One random key per triangle: of its surface's name and its place among the surface's triangles."""
    names = key_of_names([*scene.surfaces.surface_id, "\x00ground"], seed)
    surface = scene.triangle_surface  # the ground's -1 takes the last name
    order = np.argsort(surface, kind="stable")
    first = np.searchsorted(surface[order], surface[order])
    place = np.empty(len(surface), np.uint64)
    place[order] = np.arange(len(surface)) - first
    return mix(names[surface] ^ mix(place + np.uint64(1)))
