"""Lay ground under a city: terrain given by the user, terrain of its own files, a surface through
its feet, or none.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ..settings.errors import list_some
from ..settings.tolerances import GEOMETRY
from .build_ground import build_ground, faces_up, feet_or_corners
from .build_terrain import build_terrain
from .check_geometry import check_terrain
from .find_feet import find_feet
from .find_ground import find_ground, height_below, upward_areas
from .polygons import drop_unused, polygon_bounds
from .terrain import HORIZON, NEAR, Layer, measure_heights, nearest_heights


def lay_ground(scene, placed, ground, options, patch_size, *, report_share):
    """The scene with its ground, and the footprints that do not touch it.

    Parameters
    ----------
    scene : Scene
    placed : PlacedCity
    ground : {'auto', 'feet', 'none'}
    options : SceneOptions
    patch_size : float or None
    report_share : callable
        As of `build_scene`, of the ground.

    Returns
    -------
    Scene
    (h,) int
        Surfaces that are footprints without a foot on the ground.
    """
    notes, reach = scene.report.notes, scene.ground_reach
    # What becomes of the terrain in the file is said.
    if placed.city.terrain is not None:
        words = (
            "errain of the file: "
            f"{sum(len(layer.triangles) for layer in placed.city.terrain.layers):,} triangles"
        )
        if options.terrain is not None:
            notes.append(f"T{words}, not used: {options.terrain.source} takes its place.")
        else:
            notes.append(
                f"Ground: t{words}."
                if ground == "auto"
                else f"T{words}, left out (--ground {ground})."
            )
    # Terrain: the user's, or else the file's own.
    chosen = options.terrain or (placed.city.terrain if ground == "auto" else None)
    if chosen is not None:
        layers = [
            Layer(scene.site.from_files(layer.points), layer.triangles) for layer in chosen.layers
        ]
        moved = replace(chosen, layers=layers)
        check_terrain(moved)
        # Houses that end above the terrain are carried down to it; only thin things float above it.
        feet = feet_or_corners(
            placed,
            lambda places, thin: np.where(thin, measure_heights(moved, places[:, :2]), np.nan),
        )
        # The user's terrain is used in any case, the file's if it has a height under any foot or
        # near one: joined to the feet, and said what it moved. Else it is left out, with a note.
        places = feet.start[:, :2]  # under any of them, or close beside it
        heights = measure_heights(moved, places), nearest_heights(moved, places, NEAR)
        if options.terrain is not None or np.isfinite(heights).any():
            laid = build_terrain(feet, placed.points, moved, patch_size, reach, site=scene.site)
            for reason, polygons in (
                ("ends above the terrain, extended down to it", laid.raised),
                ("continues below the terrain, cut off at it", laid.below_ground),
                ("footprint above the ground, which continues below it", feet.hanging),
            ):
                scene.report.repair(reason, [scene.surfaces.surface_id[k] for k in polygons])
            notes += laid.notes
            scene = _join_ground(scene, laid.vertices, laid.triangles, laid.hidden)
            return replace(scene, terrain_laid=True), feet.hanging
        notes[-1] = (
            f"Terrain of the file left out: no height under any building or within {NEAR:g} m of "
            "one."
        )
    # Without terrain the model may have ground of its own, and feet are held against that.
    known = partial(_height_of_own_ground, scene, find_ground(scene))
    if ground == "none":
        # No ground is laid. Footprints all of whose corners lie over the model's own count as not
        # touching it, like those without a foot: whether they get light from below is asked later.
        city, points = placed.city, placed.points
        over = np.isfinite(known(points, np.zeros(len(points), bool))).astype(float)
        above = placed.footprint & (
            polygon_bounds(over, city.ring_start, city.polygon_start)[0] > 0
        )
        return scene, np.union1d(find_feet(*placed[:4], known).hanging, np.flatnonzero(above))
    # Else a surface is generated through the feet, and footprints that stay above it are told.
    vertices, triangles, floating, scene.lattice = build_ground(
        placed,
        patch_size,
        reach=reach,
        lattice=options.lattice,
        ground_height=known,
        report_share=report_share,
    )
    if len(floating):
        names = list_some([scene.surfaces.surface_id[i] for i in floating])
        notes.append(
            f"{len(floating)} footprints are above the ground, which continues below them: {names}"
        )
    return _join_ground(scene, vertices, triangles), floating


def _height_of_own_ground(scene, ground, places, thin):
    """Height of the model's own surfaces below places, `ground`, (t,) bool, among them, as for
    `find_floating`.
    """
    # Height straight below: things look from above for the ground, thin ones from their own height
    # for whatever carries them.
    upward = upward_areas(scene.vertices, scene.triangles) > 0
    height, highest = np.full(len(places), -np.inf), scene.vertices[:, 2].max() + 1
    # A thing that rests on a face may be drawn a corner's inaccuracy below it.
    for chosen, faces, start in (
        (~thin, ground & upward, highest),
        (thin, upward, places[:, 2] + GEOMETRY.corner),
    ):
        if chosen.any() and faces.any():
            from_above = np.broadcast_to(start, len(places))[chosen]
            height[chosen] = height_below(
                scene.vertices, scene.triangles[faces], places[chosen], from_above
            )
    return np.where(height > -np.inf, height, np.nan)


def _join_ground(scene, vertices, triangles, hidden=False):
    """Add the triangles of the ground, which have no row in the tables, to a scene.

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
    scene = scene.append_triangles(triangles + len(scene.vertices), footprint=hidden)
    return replace(scene, vertices=np.concatenate([scene.vertices, vertices]))


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
    # Only triangles with all corners within the horizon of the city.
    low, high = scene.vertices.min(axis=0)[:2] - HORIZON, scene.vertices.max(axis=0)[:2] + HORIZON
    count = sum(len(layer.triangles) for layer in terrain.layers)
    scene.report.notes.append(f"Terrain of the file: {count:,} triangles.")
    for layer in terrain.layers:
        points = scene.site.from_files(layer.points)
        near = (
            ((points[:, :2] >= low) & (points[:, :2] <= high))
            .all(axis=1)[layer.triangles]
            .all(axis=1)
        )
        points, triangles = drop_unused(points, layer.triangles[near])
        scene = _join_ground(scene, points, faces_up(points, triangles))
    return scene
