"""Add ground to a scene: triangles without a row in the tables."""

import numpy as np

from .build_ground import faces_up
from .locate_site import bring_to_origin
from .scene import Scene
from .terrain import HORIZON, count_triangles


def join_ground(scene, vertices, triangles, hidden=None):
    """Add the triangles of the ground to a scene.

    Parameters
    ----------
    scene : Scene
        Without the backs of sheets.
    vertices : array, (v, 3) float64 [m]
        In the scene's frame.
    triangles : array, (t, 3) int64
    hidden : array, (t,) bool, optional
        Sides and bottom of the ground, seen only from the back.

    Returns
    -------
    Scene
    """
    count = len(triangles)
    hidden = np.zeros(count, bool) if hidden is None else hidden
    return Scene(
        vertices=np.concatenate([scene.vertices, vertices]),
        triangles=np.concatenate([scene.triangles, (triangles + len(scene.vertices)).astype(np.int32)]),
        triangle_surface=np.concatenate([scene.triangle_surface, np.full(count, -1, np.int32)]),
        footprint=np.concatenate([scene.footprint, hidden]),
        closure=np.concatenate([scene.closure, np.zeros(count, bool)]),
        surfaces=scene.surfaces,
        site=scene.site,
        report=scene.report,
        colours=scene.colours,
        trees=scene.trees,
        sheet=None if scene.sheet is None else np.concatenate([scene.sheet, np.zeros(count, bool)]),
    )


def show_terrain(scene, terrain):
    """Add the triangles of a terrain as read, for display only; walls are not joined to it.

    Parameters
    ----------
    scene : Scene
        Without ground.
    terrain : Terrain
        In the coordinate reference system of the files. Triangles beyond the horizon are left out.

    Returns
    -------
    Scene
    """
    low, high = scene.vertices.min(axis=0)[:2] - HORIZON, scene.vertices.max(axis=0)[:2] + HORIZON
    scene.report.notes.append(f"Terrain of the file: {count_triangles(terrain):,} triangles.")
    for layer in terrain.layers:
        points = bring_to_origin(layer.points, scene.site)
        near = ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)[layer.triangles].all(axis=1)
        used, corners = np.unique(layer.triangles[near], return_inverse=True)
        scene = join_ground(scene, points[used], faces_up(points[used], corners.reshape(-1, 3)))
    return scene
