"""Footprints, and floors on or below the ground: they face the earth and receive nothing."""

import numpy as np

from ..scene.check_scene import check_scene
from ..scene.find_ground import find_ground, height_below

CONTACT = 0.01  # [m] a floor less than this above the ground lies on it
UPRIGHT = np.sin(np.radians(1))  # a face less than one degree off the vertical is a wall
ROUNDING = 8 * np.finfo(np.float32).eps  # of coordinates, relative


def find_resting_floors(scene, ground=None):
    """Footprints, and triangles that face downwards at or below the ground or rest on another surface.

    A footprint counts as a back from both sides: nothing can pass light to it, so it receives none. The ground has no
    thickness, so a ray that starts under it would hit nothing. Triangles under it are found by vertical rays down to
    the ground from above each triangle's middle. Triangles that rest on anything facing up, such as a roof or ground
    that is not classified as such, are found by rays down from the middle itself.

    Parameters
    ----------
    scene : Scene
    ground : (t,) bool, optional
        Result of `find_ground`, if already known.

    Returns
    -------
    (t,) bool
    """
    check_scene(scene)
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    upright = UPRIGHT * np.linalg.norm(normal, axis=1)  # walls, which rounding may tilt slightly either way
    downward = np.flatnonzero((normal[:, 2] < -upright) & (scene.triangle_surface >= 0))
    buried = scene.footprint.copy()
    if not len(downward):
        return buried
    middle = corners[downward].mean(axis=1)
    ground = find_ground(scene) if ground is None else ground
    if ground.any():
        highest = np.full(len(middle), scene.vertices[:, 2].max() + 1)
        height = height_below(scene.vertices, scene.triangles[ground], middle, highest)
        buried[downward] |= middle[:, 2] <= height + CONTACT
    # Start above the middle, which rounding may have put below the face that it rests on.
    slack = ROUNDING * np.abs(corners[downward]).max(axis=(1, 2))
    carries = normal[:, 2] > upright
    if scene.back_of is not None:
        carries &= scene.back_of < 0  # nothing rests on its own back
    height = height_below(scene.vertices, scene.triangles[carries], middle, middle[:, 2] + slack)
    buried[downward] |= middle[:, 2] <= height + CONTACT
    return buried
