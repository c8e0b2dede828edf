"""From a City to the Scene for ray tracing: local origin, true north, triangles, kinds, ground."""

import copy
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..settings.errors import InputError, count_of, list_some
from ..settings.memory import check_memory
from ..settings.progress import report_part, silent
from .build_ground import PlacedCity
from .check_geometry import check_city, check_extent
from .classify import classify, find_footprints, measure_tilt
from .crowns import build_crowns
from .find_ground import find_ground, find_hanging
from .find_sheets import find_sheets
from .find_twins import find_twins
from .grid_cells import split_into_cells
from .lay_ground import lay_ground
from .locate_site import locate_site, note_outside_use
from .polygons import measure_polygons, merge_vertices, normals_of, triangulate
from .scene import Scene, Surfaces
from .site import Site
from .split_edges import refine_triangles
from .terrain import Terrain

DRAWN_TWICE = "lies on a surface that faces the same way, counted once"


@dataclass(frozen=True)
class SceneOptions:
    """What else tells how a scene is made of a city."""

    # in the city's coordinate reference system; takes the place of any other ground
    terrain: Terrain | None = None
    # [m] side of the cells that large polygons are split into, rows ``id#k``
    grid_size: float | None = None
    # the brighter the ground, the further it extends beyond the city: `Scene.ground_reach`
    ground_albedo: float = 0.25
    sectors: str = "8"  # of `classify`
    site: Site | None = (
        # of another run: where an edited city stays comparable, place, north and origin are kept
        None
    )
    # of generated ground of another scene, kept where the city still lies on it
    lattice: tuple | None = None


def build_scene(
    city,
    latitude=None,
    longitude=None,
    *,
    ground="auto",
    patch_size=10.0,
    options=None,
    report_share=silent,
):
    """Triangulated and classified scene of a city.

    Parameters
    ----------
    city : City
    latitude, longitude : float, optional
        [°] Override what the coordinate reference system says.
    ground : {'auto', 'feet', 'none'}
        Terrain of the city's own files if it reaches any building, otherwise a surface through the
        buildings' feet; always that surface; or nothing.
    patch_size : float or None
        [m] Longest edge of a triangle; None keeps the triangles of the polygons.
    options : SceneOptions, optional
    report_share : callable, optional
        Called as report_share(share) with the share that is done, 0 to 1; what it raises ends the
        work.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        If a number, an array or a setting is invalid, or the memory does not suffice.
    """
    options = options or SceneOptions()
    if ground not in ("auto", "feet", "none"):
        raise InputError("--ground", f"{ground!r} is unknown", "give auto or feet or none")
    if not 0 <= options.ground_albedo <= 1:
        raise InputError(
            "--ground-albedo",
            f"{options.ground_albedo} is out of range",
            "give a number from 0 to 1",
        )
    report_share(0.0)
    # A city that needs more memory than there is is refused. Measured: 0.3 GB for Midtown
    # Manhattan, of 167,000 corners, with what its ground takes.
    source = next(iter(city.report.files), None)
    cure = "give it more memory, or a part of the city"
    scene = f"a scene of {len(city):,} surfaces"
    check_memory(source or "the city", scene, 1800 * len(city.points), cure)
    # The city in cells where asked for. The middle of its bounds, at its lowest point, becomes the
    # origin, whose place on Earth is found, unless a site is given.
    check_city(city)
    check_extent(city)
    whole_area = measure_polygons(*city.shape)[0]
    if options.grid_size is not None:
        city, parent = split_into_cells(city, options.grid_size)
        whole_area = whole_area[parent]
    site = options.site
    if site is None:
        low, high = city.points.min(axis=0), city.points.max(axis=0)
        origin = (float(0.5 * (low[0] + high[0])), float(0.5 * (low[1] + high[1])), float(low[2]))
        there = locate_site(city.plane or city.crs, origin, latitude, longitude, source=source)
        site = Site(*there[:2], origin[2], there[2], city.crs, origin, city.axes, city.plane)
    # Surfaces with their kinds and orientation, then triangles no longer than a patch.
    points = site.from_files(city.points)
    surfaces = _describe(city, points, whole_area, options.sectors)
    shape = points, city.ring_start, city.polygon_start
    report_share(0.05)
    vertices, triangles, triangle_surface = _cut_polygons(shape, patch_size)
    # Faults of the geometry are told; footprints, and closures without light, are marked.
    report = copy.deepcopy(city.report)
    if options.site is latitude is longitude is None:
        report.notes += note_outside_use(city.crs, site.latitude, site.longitude)
    _note_faults(shape, (vertices, triangles, triangle_surface), surfaces, report)
    under = find_footprints(surfaces, city, points)
    footprint = under[triangle_surface]
    closure = (np.array(surfaces.thematic) == "ClosureSurface")[triangle_surface]
    carriers = triangles.astype(np.int32), triangle_surface.astype(np.int32), footprint, closure
    scene = Scene(
        *(vertices, *carriers, surfaces, site, report, city.colours),
        ground_albedo=options.ground_albedo,
    )
    _name_ground(scene)
    # Ground under it, with trees; footprints that hang and faces without thickness get light from
    # both sides.
    placed = PlacedCity(city, points, surfaces, under, site)
    cut, grounded = 0.27, 0.65  # shares of the time that are over then
    report_share(cut)
    lay_part = partial(report_part, report_share, cut, grounded)
    scene, floating = lay_ground(scene, placed, ground, options, patch_size, report_share=lay_part)
    report_share(grounded)
    scene.trees = build_crowns(city.trees, report, site.from_files)
    scene.footprint &= ~find_hanging(scene, floating)
    scene.sheet = find_sheets(scene, partial(report_part, report_share, grounded, 1.0))
    _note_sheets(scene)
    report_share(1.0)
    return scene


def _describe(city, points, whole_area, sectors):
    area, normal = measure_polygons(points, city.ring_start, city.polygon_start)
    surface_tilt, surface_azimuth = measure_tilt(normal)
    # A cell is eligible if the polygon it was cut from is.
    kind, orientation, eligible = classify(
        whole_area, surface_tilt, surface_azimuth, city.thematic, sectors
    )
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
        height_source=city.height_source,
    )


def _note_faults(shape, drawn, surfaces, report):
    """Exclude surfaces drawn twice from the eligible area, and report them, and polygons whose
    triangles do not cover them, for example because the outline crosses itself."""
    receiving = ~np.isin(surfaces.kind, ("ground", "downward"))
    twins = find_twins(shape, surfaces.area, surfaces.normal, receiving)
    surfaces.eligible &= ~twins
    vertices, triangles, owner = drawn
    covered = np.bincount(
        owner, 0.5 * np.linalg.norm(normals_of(vertices, triangles), axis=1), len(surfaces)
    )
    # Triangles whose area is off by more than 1 % of the polygon's are reported.
    lost = np.abs(covered - surfaces.area) > np.maximum(0.01 * surfaces.area, 1e-3)
    torn = "triangles do not match the area (crossing or strongly bent outline)"
    for reason, found in ((DRAWN_TWICE, twins), (torn, lost)):
        report.repair(reason, [surfaces.surface_id[i] for i in np.flatnonzero(found)])


def _name_ground(scene):
    """Give surfaces that nothing names, but most of the city stands on, the kind ground, and report
    them.
    """
    surfaces, found = scene.surfaces, np.unique(scene.triangle_surface[find_ground(scene)])
    rows = found[surfaces.kind[found] != "ground"]
    # Ground carries no modules and faces nowhere; what is ground alone is no building.
    if len(rows):
        surfaces.kind[rows], surfaces.orientation[rows], surfaces.eligible[rows] = (
            "ground",
            "none",
            False,
        )
        names = list(dict.fromkeys(surfaces.building_id[k] for k in rows))
        others = set(np.delete(np.array(surfaces.building_id, dtype=object), rows))
        scene.report.building_count -= len(set(names) - others)
        scene.report.notes.append(
            f"Ground: {list_some(names)} ({surfaces.area[rows].sum():,.0f} m²) has no class and "
            "most of the city "
            "stands on it; it is no building, carries no modules and has the ground's albedo."
        )


def _note_sheets(scene):
    """Report the surfaces that are lit from both sides."""
    rows = np.unique(scene.triangle_surface[scene.sheet])
    if len(rows):
        area, names = scene.surfaces.area[rows].sum(), [scene.surfaces.surface_id[i] for i in rows]
        scene.report.notes.append(
            f"{count_of(len(rows), 'surface')} ({area:,.0f} m²) without thickness, enclosing "
            "nothing: backs receive "
            f"and reflect light too, the row is the front as drawn: {list_some(names)}"
        )


def _cut_polygons(shape, patch_size):
    """Triangles of polygons, their edges no longer than the patch size.

    Polygons that share corners are cut together, since what one of them shares with another is cut
    for both.

    Parameters
    ----------
    shape : tuple
        points (m, 3) float64 [m], ring_start (r + 1,), polygon_start (n + 1,).
    patch_size : float or None
        [m] None keeps the triangles of the polygons.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
        Ordered by polygon.
    polygon : array, (t,) int64
    """
    triangles, polygon = triangulate(*shape)
    vertices, triangles = merge_vertices(shape[0], triangles)
    if patch_size is not None:
        vertices, triangles, origin = refine_triangles(vertices, triangles, patch_size, polygon)
        polygon = polygon[origin]
    return vertices, triangles, polygon
