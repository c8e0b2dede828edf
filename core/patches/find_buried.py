"""Floors that lie on the ground or in it: they look into the earth and receive nothing."""

import numpy as np

from ..scene.check_scene import check_scene
from ..scene.find_ground import find_ground, height_below

CONTACT = 0.01  # [m] a floor this little above the ground lies on it
UPRIGHT = np.sin(np.radians(1))  # a face that leans less than one degree is a wall
ROUNDING = 8 * np.finfo(np.float32).eps  # of coordinates, as a share of them


def find_buried(scene, ground=None):
    """Triangles that face downwards at or below the ground, or rest on another surface.

    The ground has no thickness, so a ray that starts under it would meet nothing. What lies under it is found by
    looking down onto the ground from above each triangle's middle. Where no ground was laid, a footprint is the floor.
    What rests on anything that faces up, be it a roof or ground without a name, is found by looking down from the
    middle itself.

    Parameters
    ----------
    scene : Scene
    ground : (t,) bool, optional
        Of `find_ground`, where it is known already.

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
    ground = find_ground(scene) if ground is None else ground
    if ground.any():
        highest = np.full(len(middle), scene.vertices[:, 2].max() + 1)
        height = height_below(scene.vertices, scene.triangles[ground], middle, highest)
        buried[downward] = np.where(height > -np.inf, middle[:, 2] <= height + CONTACT, scene.footprint[downward])
    # Start as far above the middle as rounding may have put it below what it rests on.
    slack = ROUNDING * np.abs(corners[downward]).max(axis=(1, 2))
    carries = normal[:, 2] > upright
    if scene.back_of is not None:
        carries &= scene.back_of < 0  # nothing rests on its own back
    height = height_below(scene.vertices, scene.triangles[carries], middle, middle[:, 2] + slack)
    buried[downward] |= middle[:, 2] <= height + CONTACT
    return buried
