"""Which parts of surfaces are taken: covered, or without room for modules, as shapes in their
planes.

A part consists of cover cells, the 64 equal parts of each patch. Only surfaces that are taken in
part, and carry modules on the rest, have one.
"""

import numpy as np
import shapely

from ..city.plan_geometry import join_triangles
from ..city.polygons import plane_axes
from ..patches.cover_cells import unpack_cells
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.sample_points import Cells
from ..settings.tolerances import GEOMETRY
from .measure_cover import average_room, share_without_room
from .sun_matrix import cover_of_surfaces


def find_taken(scene, to_surface, covered, cramped):
    """What modules cannot take of surfaces, at each clearance.

    Parameters
    ----------
    scene : Scene
    to_surface : (n, p) sparse float64
        Of `area_means`.
    covered : array, (p, cells) bool
    cramped : array, (p, k) uint64
        As of `find_cramped`.

    Returns
    -------
    covered_share : array, (n,)
    no_room : array, (n, k)
        Share that is open but has no room.
    parts : array, (n, k) of shapely geometries or None
        Of `outline_taken`.
    """
    covered_share, no_room = shares = share_taken(to_surface, covered, cramped)
    return *shares, outline_taken(scene, covered, cramped, covered_share[:, None] + no_room)


def share_taken(to_surface, covered, cramped):
    """The first two of `find_taken`."""
    covered_share = cover_of_surfaces(to_surface, covered.mean(axis=1, dtype=np.float32))
    return covered_share, average_room(to_surface, share_without_room(cramped, covered))


def outline_taken(scene, covered, cramped, shares, *, most=0.5):
    """Shapes of the parts of surfaces that are covered or have no room.

    Parameters
    ----------
    scene : Scene
    covered : array, (p, cells) bool
    cramped : array, (p, k) uint64
        As of `find_cramped`.
    shares : array, (n, k) float
        Share of each surface that is taken.
    most : float
        Surfaces that have more taken carry no modules, and have no shapes.

    Returns
    -------
    array, (n, k) of shapely geometries or None
        None where nothing or more than `most` is taken. In the axes of `plane_axes` of each normal,
        from the scene's origin [m].
    """
    parts = np.full(shares.shape, None, object)
    wanted = (shares > 0) & (shares <= most)
    # Corners of the patches of these surfaces, in the plane of each.
    owner = np.append(wanted.any(axis=1), False)[scene.triangle_surface]
    rows = np.flatnonzero(owner)
    surface = scene.triangle_surface[rows]
    axes = np.stack(plane_axes(np.asarray(scene.surfaces.normal, float)[surface]), axis=1)
    corners = np.asarray(scene.vertices, float)[scene.triangles[rows]]
    corners = np.einsum("tci,tji->tcj", corners, axes)  # (t, 3, 2)
    weights = Cells(CELL_DIVISIONS).corners().astype(float)  # (cells, 3, 2)
    weights = np.concatenate([1 - weights.sum(axis=2, keepdims=True), weights], axis=2)
    before = None
    for column in range(shares.shape[1]):
        cells = covered[rows] | unpack_cells(cramped[rows, column])
        cells &= wanted[surface, column, None]
        # Where a clearance takes the cells that the one before took, its shapes are used again.
        if before is not None and np.array_equal(cells, before):
            parts[:, column] = parts[:, column - 1]
            continue
        before = cells
        # A triangle for each cell, its corners rounded so that neighbours share them; then one
        # shape a surface.
        patch, cell = np.nonzero(cells)
        places = np.einsum("mcw,mwj->mcj", weights[cell], corners[patch])
        triangles = shapely.polygons(GEOMETRY.corner * np.rint(places / GEOMETRY.corner))
        kept = np.flatnonzero(shapely.area(triangles) > 0)
        names, shapes = join_triangles(triangles[kept], surface[patch[kept]])
        parts[names, column] = shapes
    return parts
