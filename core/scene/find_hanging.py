"""Hanging undersides: presumed footprints that lie neither on the ground nor on a roof.

Whether a building stands on the ground follows from its feet (`find_feet`). If not, it may still rest on something, as
a tower does on its podium. Rays go straight down from each triangle: if it rests on something, the next upward face is
close below; if a ray hits a back, the triangle is inside something.
"""

import numpy as np

from ..city.city import number_names
from ..rays.ray_scene import RayScene
from .find_ground import AT_ONCE, height_below

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
    corners = np.asarray(scene.vertices, float)[scene.triangles[rows]]
    upward = upward_areas(scene.vertices, scene.triangles)
    carriers, whole = scene.triangles[upward > 0], RayScene(scene.vertices, scene.triangles)
    slack = ROUNDING * np.abs(corners).max(axis=(1, 2))
    near = np.clip(thickness_above(scene, rows), CONTACT, LEVEL)
    down = np.tile(np.float32([0, 0, -1]), (len(rows), 1))
    votes = np.zeros(len(rows), int)
    for turn in range(3):
        place = np.einsum("c,rcx->rx", np.roll(WEIGHTS, turn), corners)
        clear = place[:, 2] - height_below(scene.vertices, carriers, place, place[:, 2] + slack) > near
        place[:, 2] -= np.maximum(slack, CONTACT / 10)
        met = whole.trace_closest(place.astype(np.float32), down)
        votes += clear & ~((met >= 0) & (scene.footprint[met] | (upward[met] < 0)))
    hanging[rows[votes >= 2]] = True
    return hanging


def upward_areas(vertices, triangles):
    """Twice the plan area of triangles, (t,), negative for those that face down; 0 for walls."""
    upward = np.empty(len(triangles))
    for first in range(0, len(triangles), AT_ONCE):
        corners = np.asarray(vertices, float)[triangles[first : first + AT_ONCE]]
        edges = corners[:, 1:] - corners[:, :1]
        normal = np.cross(edges[:, 0], edges[:, 1])
        upright = np.sin(np.radians(1)) * np.linalg.norm(normal, axis=1)
        upward[first : first + AT_ONCE] = np.where(np.abs(normal[:, 2]) > upright, normal[:, 2], 0.0)
    return upward


def thickness_above(scene, rows):
    """Height of the building's top above each of some triangles: (r,) float64 [m]."""
    own, height = scene.triangle_surface >= 0, np.asarray(scene.vertices, float)[:, 2]
    building = number_names(scene.surfaces.building_id)
    top = np.full(building.max(initial=-1) + 1, -np.inf)
    np.maximum.at(top, building[scene.triangle_surface[own]], height[scene.triangles[own]].max(axis=1))
    return top[building[scene.triangle_surface[rows]]] - height[scene.triangles[rows]].min(axis=1)
