"""Patches: the triangles of the scene as places that receive and reflect light."""

from dataclasses import dataclass

import numpy as np

from .find_buried import find_buried
from .random_numbers import key_of_names, mix

OFFSET_SPACINGS = 16  # distance of ray origins from their face, in float32 spacings at the face


@dataclass
class Patches:
    """One row per triangle of the scene."""

    corner: np.ndarray  # (p, 3) float32 [m], first vertex
    edges: np.ndarray  # (p, 2, 3) float32 [m], from the first vertex to the second and third
    normal: np.ndarray  # (p, 3) float32
    tangents: np.ndarray  # (p, 2, 3) float32, with the normal an orthonormal frame
    area: np.ndarray  # (p,) float64 [m²]
    offset: np.ndarray  # (p,) float32 [m], how far above its face a ray starts
    key: np.ndarray  # (p,) uint64, of its random numbers
    albedo: np.ndarray  # (p,) float32
    facing: np.ndarray  # (p, 4) float32, normal and 2 for footprints (whoever sees one is under a building), else 0
    receives: np.ndarray  # (p,) bool, false where a patch closes a building or lies on the ground

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
    """
    corners = scene.vertices[scene.triangles]  # (t, 3, 3) float64
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    reach = np.abs(corners).max(axis=(1, 2)) + np.abs(edges).max(axis=(1, 2))
    return Patches(
        corner=corners[:, 0].astype(np.float32),
        edges=edges.astype(np.float32),
        normal=normal.astype(np.float32),
        tangents=tangent_frame(normal).astype(np.float32),
        area=length / 2,
        offset=(OFFSET_SPACINGS * np.finfo(np.float32).eps * reach).astype(np.float32),
        key=keys_of_triangles(scene, seed),
        albedo=np.asarray(albedo, np.float32),
        facing=np.column_stack([normal, 2 * scene.footprint]).astype(np.float32),
        receives=~scene.closure & ~find_buried(scene),
    )


def tangent_frame(normal):
    """Two unit vectors that make an orthonormal frame with each normal.

    Parameters
    ----------
    normal : (n, 3) float64

    Returns
    -------
    (n, 2, 3) float64

    References
    ----------
    Duff et al. (2017), Building an orthonormal basis, revisited. JCGT 6(1).
    """
    x, y, z = normal.T
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    first = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([first, second], axis=1)


def keys_of_triangles(scene, seed):
    """One random key per triangle: of its surface's name and its place among the surface's triangles."""
    names = key_of_names([*scene.surfaces.surface_id, "\x00ground"], seed)
    surface = scene.triangle_surface  # the ground's -1 takes the last name
    order = np.argsort(surface, kind="stable")
    first = np.searchsorted(surface[order], surface[order])
    place = np.empty(len(surface), np.uint64)
    place[order] = np.arange(len(surface)) - first
    return mix(names[surface] ^ mix(place + np.uint64(1)))
