"""A town of boxes as a City: float64, in the coordinates of a file, to the millimetre."""

import numpy as np

from citypv.core.city.city import City

OUTWARDS = {
    "RoofSurface": [[4, 5, 6, 7]],
    "GroundSurface": [[0, 3, 2, 1]],
    "WallSurface": [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
}


def city_of_polygons(polygons, thematic=None, building=None, crs=None):
    """A City of polygons without holes, each (k, 3)."""
    count = len(polygons)
    lengths = [len(polygon) for polygon in polygons]
    return City(
        surface_id=[f"s{index}" for index in range(count)],
        building_id=[f"b{index}" for index in (range(count) if building is None else building)],
        thematic=[""] * count if thematic is None else list(thematic),
        points=np.concatenate([np.asarray(polygon, float) for polygon in polygons]),
        ring_start=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        polygon_start=np.arange(count + 1),
        crs=crs,
    )


def draw_town(across=16, seed=5, cell=20.0, tiles=8):
    """Houses on a square plain: one box at a random place of each cell of a grid.

    Returns
    -------
    polygons : list of (4, 3) float64 [m]
    thematic : list of str
    building : list of int
    """
    generator = np.random.default_rng(seed)
    polygons, thematic, building = [], [], []
    for house in range(across**2):
        size = np.round(generator.uniform([6, 6, 4], [14, 14, 25]), 3)
        corner = np.round(cell * np.array(divmod(house, across)) + generator.uniform(0, cell - 14.5, 2), 3)
        x, y = corner[0] + np.array([0, size[0]]), corner[1] + np.array([0, size[1]])
        base = np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
        points = np.vstack([np.column_stack([base, np.full(4, z)]) for z in (0, size[2])])
        for kind, faces in OUTWARDS.items():
            for face in faces:
                polygons.append(points[face])
                thematic.append(kind)
                building.append(house)
    edge, size = across * cell, across * cell / tiles
    for tile in range(tiles**2):
        x, y = size * np.array(divmod(tile, tiles))
        polygons.append(np.array([[x, y, 0], [x + size, y, 0], [x + size, y + size, 0], [x, y + size, 0]]))
        thematic.append("TINRelief")
        building.append(across**2 + tile)
    assert max(polygon.max() for polygon in polygons) == edge
    return polygons, thematic, building


def turned(points, degrees):
    """Points turned counter-clockwise about the vertical."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return np.asarray(points) @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])


def moved(points, by):
    """Points moved by a vector."""
    return np.asarray(points, float) + np.asarray(by, float)


def spun(generator):
    """A random rotation: (3, 3)."""
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))
