"""Small cities made of boxes, and rays from above that ask where the ground is."""

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from citypv.core.city.city import City


def make_city(polygons, crs=None):
    """City of (building, thematic, rings) in the order given."""
    rings = [np.asarray(ring, float) for _, _, polygon in polygons for ring in polygon]
    return City(
        surface_id=[f"s{k}" for k in range(len(polygons))],
        building_id=[building for building, _, _ in polygons],
        thematic=[thematic for _, thematic, _ in polygons],
        points=np.concatenate(rings),
        ring_start=np.cumsum([0, *[len(ring) for ring in rings]]),
        polygon_start=np.cumsum([0, *[len(polygon) for _, _, polygon in polygons]]),
        crs=crs,
    )


def box(building, *bounds, semantics=True):
    """Six polygons of a box: ground, four walls, roof; normals outwards."""
    x, y, width, depth, low, high = bounds
    corners = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
    names = ("GroundSurface", "WallSurface", "RoofSurface") if semantics else ("", "", "")
    bottom, top = ([(*corner, z) for corner in corners] for z in (low, high))
    walls = [[bottom[k - 1], bottom[k], top[k], top[k - 1]] for k in range(4)]
    return [
        (building, names[0], [bottom[::-1]]),
        *[(building, names[1], [wall]) for wall in walls],
        (building, names[2], [top]),
    ]


def heights_below(vertices, triangles, places):
    """Height where a ray from far above first meets the triangles, NaN where it meets none, by
    Embree.
    """
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, vertices.astype(np.float32), triangles.astype(np.int32))
    top = float(vertices[:, 2].max()) + 10.0
    origins = np.column_stack([places[:, :2], np.full(len(places), top)]).astype(np.float32)
    down = np.tile(np.float32([0, 0, -1]), (len(places), 1))
    hits = scene.run(origins, down, query="DISTANCE")
    heights = top - hits.astype(float)
    heights[hits > 1e30] = np.nan
    return heights
