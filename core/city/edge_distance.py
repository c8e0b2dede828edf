"""How far surfaces look before the city ends: beyond the edge of a file nothing stands that would
shade them.

          ┌──────── outline of the built area: footprints closed by 50 m ───────┐
          │   ▭   ▭    ▭ ├──────────── edge_distance ──────────────────────────►│
          │  ▭   ▭   ▭   middle of a facade, along its normal in plan           │
          └─────────────────────────────────────────────────────────────────────┘

It says nothing of what stands outside: a city may end there, or only its file.
"""

import numpy as np
import shapely

from .plan_geometry import join_triangles

FURTHEST = 100.0  # [m] further away the edge takes next to nothing
NEAREST = 25.0  # [m] at the rim


def measure_edge_distance(scene):
    """Distance of surfaces to the outline of the built area, along their normals in plan.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (n,) float64 [m]
        NaN beyond 100 m, for level surfaces and ground, and everywhere in scenes of fewer than
        50 buildings, or where fewer than ten have a surface within 25 m of the outline.
    """
    surfaces, found = scene.surfaces, np.full(len(scene.surfaces), np.nan)
    kind, building = (
        np.asarray(surfaces.kind),
        np.array(surfaces.building_id, dtype=object).astype(str),
    )
    built = kind != "ground"
    # Fewer than 50 buildings are no city, and have no edge.
    if len(np.unique(building[built])) < 50:
        return found
    # Flat roofs, and surfaces with a tenth or less of their unit normal in plan, look to no side.
    looks = (np.hypot(*surfaces.normal[:, :2].T) > 0.1) & (kind != "flat")
    middles = _middles_of_surfaces(scene)[:, :2]
    # Slivers have no triangles, and so no middle.
    rows = np.flatnonzero(built & looks & np.isfinite(middles).all(axis=1))
    middles, directions = middles[rows], surfaces.normal[rows, :2]
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    # The built area: roofs in plan, with streets and squares between them, and without holes.
    area = _built_area(scene, built)
    shapely.prepare(area)
    # Rays start a little inside, as the facades at the rim lie on the outline themselves.
    ends = np.stack([middles - 0.1 * directions, middles + (FURTHEST + 1) * directions], axis=1)
    inside = shapely.intersection(shapely.linestrings(ends), area)
    parts, ray = shapely.get_parts(inside, return_index=True)
    # The distance is the length of the first part of the ray in the built area, which begins where
    # the ray does; without such a part it is 0.
    begins = shapely.distance(parts, shapely.points(ends[ray, 0])) < 0.01
    length = np.zeros(len(rows))
    length[ray[begins]] = shapely.length(parts[begins])
    distance = np.maximum(length - 0.1, 0.0)
    # Only a city with ten buildings at its rim has an edge; else all distances stay NaN.
    rim = np.unique(building[rows[distance < NEAREST]])
    if len(rim) >= 10:
        found[rows] = np.where(distance <= FURTHEST, distance, np.nan)
    return found


def _middles_of_surfaces(scene):
    """Centroids of the surfaces of a scene: (n, 3) float64 [m]; NaN without triangles."""
    own = np.flatnonzero(scene.triangle_surface >= 0)
    corners = scene.vertices[scene.triangles[own]]
    area = (
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        / 2
    )
    surface, count = scene.triangle_surface[own], len(scene.surfaces)
    # Mean of the middles of a surface's triangles, weighed by their area.
    sums = [np.bincount(surface, area * values, count) for values in corners.mean(axis=1).T]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.stack(sums, axis=1) / np.bincount(surface, area, count)[:, None]


def _built_area(scene, built, *, closed_width=50.0):
    """Footprints of the buildings, their roofs seen from above, closed by `closed_width`, and
    without holes.
    """
    roofs = built & (scene.surfaces.normal[:, 2] > 0.1)
    own = np.flatnonzero(scene.triangle_surface >= 0)
    own = own[roofs[scene.triangle_surface[own]]]
    triangles = shapely.polygons(scene.vertices[scene.triangles[own]][:, :, :2])
    # Roof by roof first, which takes a third of the time of all triangles at once.
    footprints = shapely.union_all(join_triangles(triangles, scene.triangle_surface[own])[1])
    # Parts are widened one by one, which takes a seventh of the time of all at once.
    # Streets and squares of up to twice this width belong to the built area [m].
    widened = shapely.union_all(shapely.buffer(shapely.get_parts(footprints), closed_width))
    closed = shapely.buffer(widened, -closed_width)
    return shapely.union_all(shapely.polygons(shapely.get_exterior_ring(shapely.get_parts(closed))))
