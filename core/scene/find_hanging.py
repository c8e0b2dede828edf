"""Hanging undersides: presumed footprints that lie neither on the ground nor on a roof.

Whether a building stands on the ground follows from its feet (`find_feet`). If not, it may still rest on something, as
a tower does on its podium. Rays go straight down from each triangle: if it rests on something, the next upward face is
close below; if a ray hits a back, the triangle is inside something.
"""

import numpy as np

from ..rays.ray_scene import RayScene
from .find_ground import height_below

LEVEL = 0.5  # [m] largest gap, as drawn, between a resting face and what carries it
CONTACT = 0.01  # [m] least value of that gap, however thin the building is
WEIGHTS = (0.55, 0.27, 0.18)  # barycentric, of ray origins: seldom above an edge, hardly ever two of three
ROUNDING = 8 * np.finfo(np.float32).eps  # of coordinates, relative


def find_hanging(scene, floating):
    """Footprints that receive light from below.

    Parameters
    ----------
    scene : Scene
        Including its ground.
    floating : (h,) int
        Surfaces that are footprints but have no foot on the ground.

    Returns
    -------
    (t,) bool
    """
    hanging = np.zeros(len(scene.triangles), bool)
    rows = np.flatnonzero(scene.footprint & (scene.triangle_surface >= 0) & np.isin(scene.triangle_surface, floating))
    if not len(rows):
        return hanging
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    upward = upward_areas(corners)
    carriers, whole = scene.triangles[upward > 0], RayScene(scene.vertices, scene.triangles)
    slack = ROUNDING * np.abs(corners[rows]).max(axis=(1, 2))
    near = np.clip(thickness_above(scene, corners, rows), CONTACT, LEVEL)
    down = np.tile(np.float32([0, 0, -1]), (len(rows), 1))
    votes = np.zeros(len(rows), int)
    for turn in range(3):
        place = np.einsum("c,rcx->rx", np.roll(WEIGHTS, turn), corners[rows])
        clear = place[:, 2] - height_below(scene.vertices, carriers, place, place[:, 2] + slack) > near
        place[:, 2] -= np.maximum(slack, CONTACT / 10)
        met = whole.trace_closest(place.astype(np.float32), down)
        votes += clear & ~((met >= 0) & (scene.footprint[met] | (upward[met] < 0)))
    hanging[rows[votes >= 2]] = True
    return hanging


def upward_areas(corners):
    """Twice the plan area of triangles, (t, 3, 3), negative for those that face down; 0 for walls."""
    edges = corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    upright = np.sin(np.radians(1)) * np.linalg.norm(normal, axis=1)
    return np.where(np.abs(normal[:, 2]) > upright, normal[:, 2], 0.0)


def thickness_above(scene, corners, rows):
    """Height of the building's top above each of some triangles: (r,) float64 [m]."""
    own = np.flatnonzero(scene.triangle_surface >= 0)
    building = np.unique(np.array(scene.surfaces.building_id), return_inverse=True)[1]
    top = np.full(building.max(initial=-1) + 1, -np.inf)
    np.maximum.at(top, building[scene.triangle_surface[own]], corners[own, :, 2].max(axis=1))
    return top[building[scene.triangle_surface[rows]]] - corners[rows, :, 2].min(axis=1)
