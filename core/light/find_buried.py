"""Floors that lie on the ground or in it: they look into the earth and receive nothing."""

import numpy as np

from .check_arrays import check_scene
from .ray_scene import RayScene

CONTACT = 0.01  # [m] a floor this little above the ground lies on it
UPRIGHT = np.sin(np.radians(1))  # a face that leans less than one degree is a wall
ROUNDING = 8 * np.finfo(np.float32).eps  # of coordinates, as a share of them


def find_buried(scene):
    """Triangles that face downwards at or below the ground, or rest on another surface.

    The ground has no thickness, so a ray that starts under it would meet nothing. What lies under it is found by
    looking down onto the ground from above each triangle's middle. Where no ground was laid, a footprint is the floor.
    What rests on anything that faces up, be it a roof or ground without a name, is found by looking down from the
    middle itself.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (t,) bool
    """
    check_scene(scene)
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    upright = UPRIGHT * np.linalg.norm(normal, axis=1)  # walls, which rounding leans a little this way or that
    downward = np.flatnonzero((normal[:, 2] < -upright) & (scene.triangle_surface >= 0))
    buried = np.zeros(len(scene.triangles), bool)
    if not len(downward):
        return buried
    middle = corners[downward].mean(axis=1)
    ground = np.flatnonzero(is_ground(scene))
    if len(ground):
        highest = np.full(len(middle), scene.vertices[:, 2].max() + 1)
        height = height_below(scene, ground, middle, highest)
        buried[downward] = np.where(height > -np.inf, middle[:, 2] <= height + CONTACT, scene.footprint[downward])
    # Start as far above the middle as rounding may have put it below what it rests on.
    slack = ROUNDING * np.abs(corners[downward]).max(axis=(1, 2))
    height = height_below(scene, np.flatnonzero(normal[:, 2] > upright), middle, middle[:, 2] + slack)
    buried[downward] |= middle[:, 2] <= height + CONTACT
    return buried


def is_ground(scene):
    """Triangles of the ground, generated or given: (t,) bool."""
    surface = scene.triangle_surface
    named = np.append(np.asarray(scene.surfaces.kind) == "ground", True)  # the generated ground's -1 takes the last
    return named[surface] & ~scene.footprint


def height_below(scene, triangles, points, start):
    """Height of the first of some triangles below a starting height at the place of each point.

    Parameters
    ----------
    scene : Scene
    triangles : (k,) int
        Of the scene.
    points : (n, 3) float64 [m]
    start : (n,) float64 [m]

    Returns
    -------
    (n,) float64 [m]
        -inf where there is none.
    """
    chosen = scene.triangles[triangles]
    origins = np.column_stack([points[:, :2], start]).astype(np.float32)
    down = np.tile(np.float32([0, 0, -1]), (len(points), 1))
    hit = RayScene(scene.vertices, chosen).trace_closest(origins, down)
    height = np.full(len(points), -np.inf)
    met = hit >= 0
    height[met] = height_on_triangles(np.asarray(scene.vertices, float)[chosen[hit[met]]], points[met])
    return height


def height_on_triangles(corners, points):
    """Height of each triangle's plane at the place of a point.

    Parameters
    ----------
    corners : (n, 3, 3) float64 [m]
    points : (n, 3) float64 [m]

    Returns
    -------
    (n,) float64 [m]
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    away = points[:, :2] - corners[:, 0, :2]
    return corners[:, 0, 2] - (normal[:, :2] * away).sum(axis=1) / normal[:, 2]
