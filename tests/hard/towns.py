"""Boxes and towns of boxes as polygons: float64, in the coordinates of a file, to the
millimetre.
"""

import numpy as np
from cities import make_city

from citypv.core.city.build_scene import build_scene

BOX = {
    "top": [4, 5, 6, 7],
    "bottom": [0, 3, 2, 1],
    "south": [0, 1, 5, 4],
    "east": [1, 2, 6, 5],
    "north": [2, 3, 7, 6],
    "west": [3, 0, 4, 7],
}
SIDES = list(BOX)
NAMES = ["RoofSurface", "GroundSurface", *["WallSurface"] * 4]


def box(low, high, without=(), inwards=()):
    """Faces of a box that look outwards, those of `inwards` inwards: list of (4, 3) arrays in the
    order of SIDES.
    """
    (x0, y0, z0), (x1, y1, z1) = low, high
    base = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    points = np.array([(*corner, z) for z in (z0, z1) for corner in base], float)
    drawn = {side: points[corners] for side, corners in BOX.items() if side not in without}
    return [face[::-1] if side in inwards else face for side, face in drawn.items()]


def boxes(corners, patch_size=10.0, whole=False):
    """Scene of boxes on generated ground, each a building, or all of them one."""
    building = np.repeat(np.arange(len(corners)) * (not whole), len(BOX))
    city = city_of_polygons(
        [face for low, high in corners for face in box(low, high)], building=building
    )
    return build_scene(city, 52.5, 13.4, patch_size=patch_size)


def city_of_polygons(polygons, thematic=None, building=None, crs=None):
    """A City of polygons without holes, each (k, 3)."""
    names = [f"b{index}" for index in (range(len(polygons)) if building is None else building)]
    classes = [""] * len(polygons) if thematic is None else thematic
    return make_city(
        [(*what, [ring]) for *what, ring in zip(names, classes, polygons, strict=True)], crs
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
        corner = np.round(
            cell * np.array(divmod(house, across)) + generator.uniform(0, cell - 14.5, 2), 3
        )
        polygons += box([*corner, 0], [*(corner + size[:2]), size[2]])
        thematic += NAMES
        building += [house] * len(BOX)
    size = across * cell / tiles
    for tile in range(tiles**2):
        x, y = size * np.array(divmod(tile, tiles))
        polygons.append(
            np.array([[x, y, 0], [x + size, y, 0], [x + size, y + size, 0], [x, y + size, 0]])
        )
        thematic.append("TINRelief")
        building.append(across**2 + tile)
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
