"""Ground of an edited city: it stays as it lies, but for a hole under what is new and a patch under
what is gone.
"""

from dataclasses import replace

import numpy as np
import shapely

from ..settings.errors import list_some
from ..settings.tolerances import GEOMETRY
from .build_ground import faces_up
from .city import starts_of
from .find_ground import height_below
from .plan_geometry import draw_triangles
from .polygons import merge_vertices, triangulate
from .split_edges import refine_triangles
from .written_scene import owner_of_triangles


def _lies(scene):
    """Triangles of generated ground or terrain that have area: (t,) bool."""
    a, b, c = scene.triangles.T
    return (owner_of_triangles(scene) < 0) & (a != b) & (b != c)


def cut_ground(scene, first, gone, patch_size):
    """The scene with a hole in the ground under new footprints, and ground where those that are
    gone lay.

    Triangles from number `first` on are new; the triangles `gone`, (g,) int, go. Ground that a
    hole touches stays in the scene, beside its cut pieces, until the caller removes it.

    Returns
    -------
    Scene
    (h,) int
        Triangles of the ground that the holes touch.
    """
    # Ground as it lies, and footprints that are new, gone, or stay.
    laid = np.flatnonzero(_lies(scene)[:first])
    none = np.zeros(0, int)
    prints = scene.footprint & (scene.triangle_surface >= 0)
    stays = prints.copy()
    stays[gone] = False
    new, old = np.flatnonzero(prints[first:]) + first, gone[prints[gone]]
    # Without ground, or without footprints that come or go, the scene stays as it is.
    if not len(laid) or not len(new) + len(old):
        return scene, none
    plan = draw_triangles(scene.corners_of(laid))
    tree = shapely.STRtree(plan)
    # New footprints that stand on the ground make holes in it; those above leave it as it is.
    rise = _rise(scene, new, np.concatenate([laid, old]))
    standing = new[~(rise > GEOMETRY.step)]
    _note_ground(scene, standing, rise[~(rise > GEOMETRY.step)])
    hole, freed = _plan_of(scene, standing), _plan_of(scene, old)
    # Ground that the new footprints touch is cut along their outlines; its own plane gives the
    # heights.
    touched = np.unique(tree.query(hole, "intersects"))
    touched = touched[shapely.area(shapely.intersection(plan[touched], hole)) > 1e-4]
    pieces = [
        (part, laid[k]) for k in touched for part in _parts(shapely.difference(plan[k], hole))
    ]
    corners = [_lift(part, scene.corners_of([k])[0]) for part, k in pieces]
    # Where a footprint goes, ground closes the gap that it leaves, at the heights of its own
    # points, except where a new hole, another footprint or other ground is.
    others = np.flatnonzero(stays)
    around = shapely.STRtree(draw_triangles(scene.corners_of(others)))
    over = others[np.unique(around.query(freed, "intersects"))]
    under = plan[np.unique(tree.query(freed, "intersects"))]
    freed = shapely.difference(freed, shapely.union_all([hole, _plan_of(scene, over), *under]))
    known = scene.vertices[np.unique(scene.triangles[old])]
    corners += [_raise(part, known) for part in _parts(freed) if part.area > 0.01]
    return _append_ground(scene, [corner for corner in corners if corner], patch_size), laid[
        touched
    ]


def _plan_of(scene, rows):
    """Some triangles in plan view: one shapely geometry."""
    shapes = draw_triangles(scene.corners_of(rows))
    return shapely.union_all(shapely.make_valid(shapes)) if len(rows) else shapely.Polygon()


def _parts(shape):
    """Polygons of a geometry, without slivers of less than 1 cm²: list."""
    return [
        part
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon" and part.area > 1e-4
    ]


def _lift(polygon, corners):
    """Rings of a polygon in plan view on the plane of a triangle, (3, 3): list of (k, 3)."""
    # The plane through the triangle gives the height of each place on it.
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    rings = []
    for ring in (polygon.exterior, *polygon.interiors):
        places = np.asarray(ring.coords)[:-1, :2]
        height = corners[0, 2] - (places - corners[0, :2]) @ normal[:2] / normal[2]
        rings.append(np.column_stack([places, height]))
    return rings


def _raise(polygon, known):
    """Rings of a polygon in plan view, each place at the height of the nearest known point: list of
    (k, 3).
    """
    rings = []
    for ring in (polygon.exterior, *polygon.interiors):
        places = np.asarray(ring.coords)[:-1, :2]
        nearest = ((places[:, None] - known[None, :, :2]) ** 2).sum(axis=2).argmin(axis=1)
        rings.append(np.column_stack([places, known[nearest, 2]]))
    return rings


def _append_ground(scene, polygons, patch_size):
    """The scene with polygons of ground, lists of rings (k, 3), cut like all ground."""
    if not polygons:
        return scene
    # Rings become triangles, cut like all ground and facing up.
    rings = [ring for polygon in polygons for ring in polygon]
    starts = starts_of(list(map(len, rings))), starts_of(list(map(len, polygons)))
    triangles, polygon = triangulate(np.concatenate(rings), *starts)
    vertices, triangles = merge_vertices(np.concatenate(rings), triangles)
    if patch_size is not None:
        vertices, triangles, _ = refine_triangles(vertices, triangles, patch_size, polygon)
    triangles = faces_up(vertices, triangles)
    scene = scene.append_triangles(triangles + len(scene.vertices))
    return replace(scene, vertices=np.concatenate([scene.vertices, vertices]))


def _heights(scene, rows, places):
    """Height of some triangles at places, (k, 3) float64 [m]; -inf where there are none: (k,)
    float64 [m].
    """
    start = np.full(len(places), scene.vertices[:, 2].max() + 1)
    return height_below(scene.vertices, scene.triangles[rows], places, start)


def _rise(scene, rows, laid):
    """How far the middles of footprints lie above some triangles of the ground: (r,) float64 [m];
    inf without any.
    """
    middle = scene.corners_of(rows).mean(axis=1)
    return middle[:, 2] - _heights(scene, laid, middle)


def _note_ground(scene, rows, rise):
    """Report footprints that stand away from the ground, which a run of the edited files would lay
    through them.
    """
    # Only what stands further off than surveys err is worth a word.
    apart = np.isfinite(rise) & (np.abs(rise) > GEOMETRY.uneven)
    if apart.any():
        names = np.array(scene.surfaces.building_id, object)[scene.triangle_surface[rows[apart]]]
        scene.report.notes.append(
            f"Ground: an edit leaves it as it lies; {list_some(list(dict.fromkeys(names)))} up to "
            f"{np.abs(rise[apart]).max():.1f} m above or below it"
        )


def find_floating_new(scene, count):
    """New surfaces, behind the first `count`, that are footprints above the ground: (h,) int."""
    rows = np.flatnonzero(scene.footprint & (scene.triangle_surface >= count))
    laid = np.flatnonzero(_lies(scene))
    if not len(rows) or not len(laid):
        return np.zeros(0, int)
    rise = _rise(scene, rows, laid)
    return np.unique(scene.triangle_surface[rows[np.isfinite(rise) & (rise > GEOMETRY.step)]])
