"""Small edits of a city, as between two variants of a plan: a box added, a building removed, a building raised."""

from dataclasses import replace

import numpy as np
from cities import box, make_city

from citypv.core.city.city import City


def join(one, other):
    """Both cities as one."""
    return replace(
        one,
        surface_id=[*one.surface_id, *(f"added {name}" for name in other.surface_id)],
        building_id=[*one.building_id, *(f"added {name}" for name in other.building_id)],
        thematic=[*one.thematic, *other.thematic],
        points=np.concatenate([one.points, other.points]),
        ring_start=np.append(one.ring_start, one.ring_start[-1] + other.ring_start[1:]),
        polygon_start=np.append(one.polygon_start, one.polygon_start[-1] + other.polygon_start[1:]),
        lod=None,
        material=None,
    )


def take(city, kept):
    """Some polygons of a city, (n,) bool."""
    rows = np.flatnonzero(kept)
    rings = [ring for row in rows for ring in city.rings(row)]
    return City(
        surface_id=[city.surface_id[row] for row in rows],
        building_id=[city.building_id[row] for row in rows],
        thematic=[city.thematic[row] for row in rows],
        points=np.concatenate(rings),
        ring_start=np.cumsum([0, *map(len, rings)]),
        polygon_start=np.cumsum([0, *np.diff(city.polygon_start)[rows]]),
        crs=city.crs,
    )


def add_box(city, place, size=20.0):
    """The city with a box at a place of its grid, (2,) [m], on the level of the building next to it."""
    x, y = place
    nearest = np.hypot(*(city.points[:, :2] - place).T).argsort()[:50]
    low = city.points[nearest, 2].min()
    return join(city, make_city(box("new", x, y, size, size, low, low + size)))


def remove_building(city, building):
    """The city without a building."""
    return take(city, np.array(city.building_id) != building)


def raise_building(city, building, rise=6.0):
    """The city with all of a building but its lowest points raised."""
    points = city.points.copy()
    for row in np.flatnonzero(np.array(city.building_id) == building):
        first, last = city.ring_start[city.polygon_start[row]], city.ring_start[city.polygon_start[row + 1]]
        part = points[first:last]
        part[part[:, 2] > points[:, 2].min() + 8.0, 2] += rise
    return replace(city, points=points)


def building_near(city, place):
    """Id of the building whose middle is nearest to a place of the grid, (2,) [m], and that middle."""
    names = np.array(city.building_id)
    middles = {
        name: np.concatenate([city.rings(row)[0] for row in np.flatnonzero(names == name)])[:, :2].mean(axis=0)
        for name in dict.fromkeys(city.building_id)
    }
    found = min(middles, key=lambda name: np.hypot(*(middles[name] - place)))
    return found, middles[found]
