"""Berlin and Manhattan, whole or cut to their middle, and which of their surfaces lie alone."""

from functools import cache
from pathlib import Path

import numpy as np
from scenes import suns_towards

from citypv.core.city.build_scene import build_scene
from citypv.core.city.city import take_polygons
from citypv.core.patches.find_coincident import find_coincident
from citypv.core.read.read_city import read_city

ROOT = Path(__file__).parents[2]
PLACE = {"latitude": 40.757, "longitude": -73.97}
CITIES = {  # file, its place, half the side of the square that is cut out [m]
    "Berlin": ("examples/berlin/berlin_3910_5817.gml", {}, 220.0),
    "Manhattan": ("tests/data/obj/nyc_midtown_citicorp_1km.obj.gz", PLACE, 110.0),
}
SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4]])


@cache
def city_and_alone(name, whole):
    """Scene, and which of its surfaces lie alone."""
    file, place, half = CITIES[name]
    city = read_city([ROOT / file])
    scene = build_scene(city if whole else middle_of(city, half), **place)
    return scene, lies_alone(scene)


def middle_of(city, half):
    """The buildings whose points' middle lies in a square about the middle of the city."""
    building = np.array(city.building_id)
    ring = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    of_point = np.repeat(ring, np.diff(np.append(city.ring_start[:-1], len(city.points))))
    names, index = np.unique(building, return_inverse=True)
    if len(names) < 20:  # the file knows no buildings: polygon by polygon
        index = np.arange(len(city))
    count = np.bincount(index[of_point])
    middle = np.stack([np.bincount(index[of_point], city.points[:, axis]) / count for axis in (0, 1)], axis=1)
    away = np.abs(middle - np.median(middle, axis=0)).max(axis=1)
    return take_polygons(city, (away < half)[index])


def lies_alone(scene):
    """Whether no face of another surface lies in the plane of a surface, within a centimetre: (n,) bool."""
    surface, alone = scene.triangle_surface, np.ones(len(scene.surfaces) + 1, bool)  # the last for the ground
    pairs = find_coincident(scene.vertices[scene.triangles], np.full(len(surface), 0.01))
    own, other = np.repeat(surface, np.diff(pairs.start)), surface[pairs.other]
    alone[own[own != other]] = False
    return alone[:-1]
