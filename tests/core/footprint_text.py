"""Small maps of outlines with heights, as GeoJSON."""

import json

import numpy as np

# [°] of a metre near 0° N, 0° E on WGS 84, where a degree has 111,319.49 m of longitude and
# 110,574.28 m of latitude: numbers of the ellipsoid (a = 6,378,137 m, f = 1/298.257)
EAST, NORTH = 1 / 111_319.4908, 1 / 110_574.2758


def square(x, y, side=10.0, depth=None):
    """Ring of a rectangle [m], counter-clockwise, closed."""
    depth = side if depth is None else depth
    return [[x, y], [x + side, y], [x + side, y + depth], [x, y + depth], [x, y]]


def in_degrees(ring):
    return [[x * EAST, y * NORTH] for x, y in ring]


def feature(rings, name=None, **attributes):
    """A feature whose rings are in metres around 0° N, 0° E."""
    rings = [rings] if np.ndim(rings[0][0]) == 0 else rings
    members = {"type": "Feature"} | ({} if name is None else {"id": name})
    shape = {"type": "Polygon", "coordinates": [in_degrees(ring) for ring in rings]}
    return members | {"properties": attributes, "geometry": shape}


def collection(*features, **members):
    return {"type": "FeatureCollection", "features": list(features)} | members


def write_map(path, *features, **members):
    path.write_text(json.dumps(collection(*features, **members)), encoding="utf-8")
    return path
