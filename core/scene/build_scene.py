"""From a City to the Scene for ray tracing: local origin, true north, triangles, kinds, ground."""

import copy
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..city.check_geometry import check_city, check_extent, check_terrain
from ..city.city import City
from ..city.measure_polygons import measure_polygons, polygon_bounds
from ..city.triangulate import triangulate
from ..ground.build_ground import build_ground, choose_reach, feet_or_corners
from ..ground.build_terrain import build_terrain
from ..ground.choose_terrain import choose_terrain, reaches_feet
from ..ground.find_feet import find_feet
from ..ground.terrain import NEAR, measure_heights
from ..settings.errors import InputError
from ..settings.progress import ignore_share, report_part
from ..trees.build_crowns import build_crowns
from .classify import classify, measure_tilt
from .find_footprints import find_footprints
from .find_ground import find_ground, height_below
from .find_hanging import find_hanging, upward_areas
from .find_sheets import find_sheets
from .find_twins import find_twins
from .grid_cells import split_into_cells
from .join_ground import join_ground
from .local_frame import bring_to_origin
from .locate_site import locate_site, note_outside_use
from .refine import refine_triangles
from .scene import Scene, Site, Surfaces

GROUNDS = ("auto", "feet", "none")
DRAWN_TWICE = "lies on a surface that faces the same way, counted once"
SLACK = 0.001  # [m] how far below a face something that rests on it may be drawn
TRIANGULATED, CUT, GROUNDED = 0.05, 0.27, 0.65  # shares of the time that are over then
LOST_SHARE = 0.01  # relative deviation of the triangles' area from the polygon's from which it is reported


def build_scene(
    city,
    latitude=None,
    longitude=None,
    *,
    ground="auto",
    terrain=None,
    patch_size=10.0,
    grid_size=None,
    ground_albedo=0.25,
    report_share=ignore_share,
):
    """Triangulated and classified scene of a city.

    Parameters
    ----------
    city : City
    latitude, longitude : float, optional
        [°] Override what the coordinate reference system says.
    ground : {'auto', 'feet', 'none'}
        Terrain of the city's own files if it reaches any building, otherwise a surface through the buildings' feet;
        always that surface; or nothing.
    terrain : Terrain, optional
        In the city's coordinate reference system; takes the place of any other ground.
    patch_size : float or None
        [m] Longest edge of a triangle; None keeps the triangles of the polygons.
    grid_size : float, optional
        [m] Side of the cells that large polygons are split into, rows ``id#k``.
    ground_albedo : float
        The brighter the ground, the further it extends beyond the city: see `choose_reach`.
    report_share : callable, optional
        Called as report_share(share) with the share that is done, 0 to 1; what it raises ends the work.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        If a number, an array or a setting is invalid.
    """
    if ground not in GROUNDS:
        raise InputError("--ground", f"{ground!r} is unknown", f"give {' or '.join(GROUNDS)}")
    if not 0 <= ground_albedo <= 1:
        raise InputError("--ground-albedo", f"{ground_albedo} is out of range", "give a number from 0 to 1")
    report_share(0.0)
    check_city(city)
    check_extent(city)
    whole_area = _areas(city)
    if grid_size is not None:
        city, parent = split_into_cells(city, grid_size)
        whole_area = whole_area[parent]
    site = _place(city, latitude, longitude)
    points = bring_to_origin(city.points, site)
    surfaces = _describe(city, points, whole_area)
    triangles, triangle_surface = triangulate(points, city.ring_start, city.polygon_start)
    report = copy.deepcopy(city.report)
    report.notes += note_outside_use(city.crs, site.latitude, site.longitude) if latitude is longitude is None else []
    _count_once(city, points, surfaces, report)
    _note_lost_area(points, triangles, triangle_surface, surfaces, report)
    vertices, triangles = merge_vertices(points, triangles)
    report_share(TRIANGULATED)
    if patch_size is not None:
        vertices, triangles, origin_triangle = refine_triangles(vertices, triangles, patch_size, triangle_surface)
        triangle_surface = triangle_surface[origin_triangle]
    under = find_footprints(surfaces, city, points)
    footprint = under[triangle_surface]
    closure = (np.array(surfaces.thematic) == "ClosureSurface")[triangle_surface]
    carriers = triangles.astype(np.int32), triangle_surface.astype(np.int32), footprint, closure
    scene = Scene(vertices, *carriers, surfaces, site, report, city.colours)
    extent, placed = Extent(patch_size, choose_reach(ground_albedo)), PlacedCity(city, points, surfaces, under)
    report_share(CUT)
    lay_part = partial(report_part, report_share, CUT, GROUNDED)
    scene, floating = _lay_ground(scene, placed, ground, terrain, extent, report_share=lay_part)
    report_share(GROUNDED)
    scene.trees = build_crowns(city.trees, report, lambda places: bring_to_origin(places, site))
    scene.footprint &= ~find_hanging(scene, floating)
    scene.sheet = find_sheets(scene, partial(report_part, report_share, GROUNDED, 1.0))
    _note_sheets(scene)
    report_share(1.0)
    return scene


class PlacedCity(NamedTuple):
    """A city in the scene's axes, as ground is laid under it."""

    city: City
    points: np.ndarray  # (m, 3) float64 [m], of the city, z up, local origin
    surfaces: Surfaces
    footprint: np.ndarray  # (n,) bool


class Extent(NamedTuple):
    """Size of the ground that is laid, and of its patches."""

    patch_size: float | None  # [m]
    reach: float  # beyond the city [building heights]


def merge_vertices(points, triangles):
    """Merge identical points (to 0.01 mm) into one vertex, and drop unused ones.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
    """
    used, corners = np.unique(triangles, return_inverse=True)
    keys = np.round(points[used] * 1e5).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return points[used[first]], inverse.reshape(-1)[corners].reshape(-1, 3)


def _place(city, latitude, longitude):
    low, high = city.points.min(axis=0), city.points.max(axis=0)
    origin = (float(0.5 * (low[0] + high[0])), float(0.5 * (low[1] + high[1])), float(low[2]))
    latitude, longitude, convergence = locate_site(city.crs, origin, latitude, longitude)
    return Site(latitude, longitude, origin[2], convergence, city.crs, origin)


def _areas(city):
    return measure_polygons(city.points, city.ring_start, city.polygon_start)[0]


def _describe(city, points, whole_area):
    area, normal = measure_polygons(points, city.ring_start, city.polygon_start)
    surface_tilt, surface_azimuth = measure_tilt(normal)
    # A cell is eligible if the polygon it was cut from is.
    kind, orientation, eligible = classify(whole_area, surface_tilt, surface_azimuth, city.thematic)
    return Surfaces(
        surface_id=city.surface_id,
        building_id=city.building_id,
        thematic=city.thematic,
        kind=kind,
        orientation=orientation,
        eligible=eligible,
        area=area,
        surface_tilt=surface_tilt,
        surface_azimuth=surface_azimuth,
        normal=normal,
        material=city.material,
    )


def _count_once(city, points, surfaces, report):
    """Exclude surfaces drawn twice from the eligible area, and report them."""
    shape = points, city.ring_start, city.polygon_start
    receiving = ~np.isin(surfaces.kind, ("ground", "downward"))
    twins = find_twins(shape, surfaces.area, surfaces.normal, receiving)
    surfaces.eligible &= ~twins
    report.repair(DRAWN_TWICE, [surfaces.surface_id[i] for i in np.flatnonzero(twins)])


def _note_lost_area(points, triangles, triangle_surface, surfaces, report):
    """Report polygons whose triangles do not cover them, for example because the outline crosses itself."""
    corners = points[triangles]
    size = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    covered = np.bincount(triangle_surface, size, minlength=len(surfaces))
    lost = np.abs(covered - surfaces.area) > np.maximum(LOST_SHARE * surfaces.area, 1e-3)
    if lost.any():
        reason = "triangles do not match the area (crossing or strongly bent outline)"
        report.repair(reason, [surfaces.surface_id[i] for i in np.flatnonzero(lost)])


def _lay_ground(scene, placed, ground, terrain, extent, *, report_share):
    """The scene with its ground, and the footprints that do not touch it.

    Parameters
    ----------
    scene : Scene
    placed : PlacedCity
    ground : str
    terrain : Terrain or None
    extent : Extent
    report_share : callable
        As of `build_scene`, of the ground.
    """
    chosen, words = choose_terrain(placed.city, ground, terrain)
    scene.report.notes += words
    if chosen is not None:
        moved = chosen.moved(lambda places: bring_to_origin(places, scene.site))
        check_terrain(moved)
        feet = feet_or_corners(*placed, _height_of_terrain(moved))
        if terrain is not None or reaches_feet(moved, feet):
            return _stand_on_terrain(scene, feet, placed.points, moved, extent), feet.hanging
        words = f"Terrain of the file left out: no height under any building or within {NEAR:g} m of one."
        scene.report.notes[-1] = words
    known = _height_of_own_ground(scene)
    if ground == "none":
        return scene, np.union1d(find_feet(*placed, known).hanging, _above_own_ground(placed, known))
    size = {"patch_size": extent.patch_size, "reach": extent.reach}
    vertices, triangles, floating = build_ground(*placed, ground_height=known, report_share=report_share, **size)
    if len(floating):
        names = [scene.surfaces.surface_id[i] for i in floating[:5]]
        scene.report.notes.append(
            f"{len(floating)} footprints are above the ground, which continues below them: {', '.join(names)} …"
        )
    return join_ground(scene, vertices, triangles), floating


def _height_of_own_ground(scene):
    """Height of the model's own surfaces below a place, as a function for `find_floating`."""
    upward = upward_areas(scene.vertices, scene.triangles) > 0
    ground, highest = find_ground(scene) & upward, scene.vertices[:, 2].max() + 1

    def ground_height(places, thin):
        height = np.full(len(places), -np.inf)
        for chosen, faces, start in ((~thin, ground, highest), (thin, upward, places[:, 2] + SLACK)):
            if chosen.any() and faces.any():
                from_above = np.broadcast_to(start, len(places))[chosen]
                height[chosen] = height_below(scene.vertices, scene.triangles[faces], places[chosen], from_above)
        return np.where(height > -np.inf, height, np.nan)

    return ground_height


def _above_own_ground(placed, known):
    """Footprints all of whose corners lie over the model's own ground, (h,) int; no other ground is laid under them."""
    city, points = placed.city, placed.points
    over = np.isfinite(known(points, np.zeros(len(points), bool))).astype(float)
    return np.flatnonzero(placed.footprint & (polygon_bounds(over, city.ring_start, city.polygon_start)[0] > 0))


def _note_sheets(scene):
    """Report the surfaces that are lit from both sides."""
    rows = np.unique(scene.triangle_surface[scene.sheet])
    if len(rows):
        area, names = scene.surfaces.area[rows].sum(), [scene.surfaces.surface_id[i] for i in rows[:5]]
        scene.report.notes.append(
            f"{len(rows):,} surfaces ({area:,.0f} m²) have no thickness and enclose nothing: their backs receive and "
            f"reflect light too, their rows are the fronts as drawn: {', '.join(names)} …"
        )


def _height_of_terrain(terrain):
    """Height of a terrain below a place, as `find_floating` asks for it."""

    def ground_height(places, thin):  # houses that end above the terrain are carried down to it
        return np.where(thin, measure_heights(terrain, places[:, :2]), np.nan)

    return ground_height


def _stand_on_terrain(scene, feet, points, terrain, extent):
    """The scene on measured ground; the report says what was done at the feet of walls."""
    names = scene.surfaces.surface_id
    ground = build_terrain(feet, points, terrain, *extent)
    for reason, polygons in (
        ("ends above the terrain, extended down to it", ground.raised),
        ("continues below the terrain, cut off at it", ground.below_ground),
        ("footprint above the ground, which continues below it", ground.hanging),
    ):
        scene.report.repair(reason, [names[k] for k in polygons])
    scene.report.notes += ground.notes
    return replace(join_ground(scene, ground.vertices, ground.triangles, ground.hidden), terrain_laid=True)
