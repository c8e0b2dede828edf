"""Floors that lie on the ground or in it: they look into the earth and receive nothing."""

import numpy as np

from .ray_scene import RayScene

CONTACT = 0.01  # [m] a floor this little above the ground lies on it


def find_buried(scene):
    """Triangles that face downwards at or below the ground.

    The ground has no thickness, so a ray that starts under it would meet nothing. What lies under it is found by
    looking down onto the ground from above each triangle's middle. Where no ground was laid, a footprint is the floor.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (t,) bool
    """
    buried = np.zeros(len(scene.triangles), bool)
    ground = scene.triangles[scene.triangle_surface < 0]
    corners = scene.vertices[scene.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    downward = np.flatnonzero((np.cross(edges[:, 0], edges[:, 1])[:, 2] < 0) & (scene.triangle_surface >= 0))
    if not len(ground) or not len(downward):
        return buried
    middle = corners[downward].mean(axis=1)
    above = middle.copy()
    above[:, 2] = scene.vertices[:, 2].max() + 1
    down = np.tile(np.float32([0, 0, -1]), (len(above), 1))
    hit = RayScene(scene.vertices, ground).trace_closest(above.astype(np.float32), down)
    height = height_on_triangles(scene.vertices[ground[hit]], middle)
    buried[downward] = np.where(hit >= 0, middle[:, 2] <= height + CONTACT, scene.footprint[downward])
    return buried


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
