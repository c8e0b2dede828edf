"""Edits of a city, as between two variants of a plan: buildings and trees added, removed, moved,
raised.
"""

import copy
from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from ..settings.errors import InputError
from .city import LISTS, free_name
from .site import turn_to_true_north


@dataclass(frozen=True)
class CityChange:
    """What is edited, by ids of buildings and names of trees of the city before; the added ones
    come last.
    """

    removed: Collection[str] = ()
    moved: dict = field(default_factory=dict)  # id -> [m] to true east and north
    # id -> [m] by which all above its foot goes up, or down
    raised: dict = field(default_factory=dict)
    added: tuple = ()  # of City, in the system of the files


def edit_city(city, change, convergence=0.0):
    """City after a change.

    Parameters
    ----------
    city : City
    change : CityChange
    convergence : float, optional
        [°] Of the city's site.

    Returns
    -------
    City

    Raises
    ------
    InputError
        An id is unknown, a tree is to be raised, a building would be lowered below its foot, an
        added city is in another system, or no building is left.
    """
    # Ids of buildings and trees must exist before anything changes; only buildings are raised.
    trees = {tree.name for tree in city.trees}
    buildings, known = np.array(city.building_id), {*city.building_id, *trees}
    for name in (*change.removed, *change.moved, *change.raised):
        if name not in known or (name in change.raised and name not in {*city.building_id}):
            raise InputError(
                name,
                "no building of the city has this id",
                "take ids from the column building_id of faces.csv",
            )
    points = city.points.copy()
    polygon = np.repeat(np.arange(len(city)), np.diff(city.ring_start[city.polygon_start]))
    # Raised: corners above the foot of the building go up, but may not pass its foot.
    for name, rise in change.raised.items():
        rows = np.flatnonzero(buildings[polygon] == name)
        above = _above_foot(city, points, rows)
        least = _height_above_foot(points, above, np.setdiff1d(rows, above))
        if rise <= -least:
            raise InputError(
                "--raise",
                f"{name} has corners {least:g} m above its foot: {rise:g} m would turn it inside "
                "out",
                f"give more than {-least:g}, or --remove {name}",
            )
        points[above, 2] += rise
    # Moved: buildings and trees go by metres of true east and north, turned to the grid of the
    # city.
    shifts = {}
    for name, (east, north) in change.moved.items():
        shifts[name] = turn_to_true_north(np.array([east, north, 0.0]), -convergence)
        points[buildings[polygon] == name] += shifts[name]
    moved = [
        _move_tree(tree, shifts[tree.name].__add__) if tree.name in shifts else tree
        for tree in city.trees
    ]
    # Removed and added last: what is told of buildings goes with them.
    told = {place: own for place, own in city.attributes.items() if place[0] not in change.removed}
    trees = [tree for tree in moved if tree.name not in change.removed]
    left = replace(city, points=points, trees=trees, attributes=told)
    left = left.take(~np.isin(buildings, list(change.removed)))
    for other in change.added:
        left = join_cities(left, other)
    if not len(left):
        raise InputError("the edited city", "no building is left", "keep one at least")
    return left


def _above_foot(city, points, rows):
    """Points of a building, (k,) int, above its foot: no GroundSurface has a point at their place,
    or, without any, they are not its lowest ones.
    """
    thematic = np.repeat(city.thematic, np.diff(city.ring_start[city.polygon_start]))[rows]
    places = np.round(points[rows], 3)
    ground = {tuple(place) for place in places[thematic == "GroundSurface"].tolist()}
    if ground:
        return rows[[tuple(place) not in ground for place in places.tolist()]]
    # A building without a GroundSurface stands on its foot up to 5 cm above its lowest point.
    return rows[places[:, 2] > places[:, 2].min(initial=np.inf) + 0.05]


def _height_above_foot(points, above, foot):
    """How high the lowest of some corners stands above the foot [m]: above the corner of it
    straight below.

    Where no corner lies straight above one of the foot, the top stands above the lowest foot.

    Parameters
    ----------
    points : (m, 3) float64 [m]
    above, foot : (k,) int
        Corners of one building.
    """
    if not len(above) or not len(foot):
        return np.inf
    lowest, highest = points[foot, 2].min(), points[above, 2].max()
    below = {}
    for x, y, z in np.round(points[foot], 3).tolist():
        below[x, y] = max(z, below.get((x, y), -np.inf))
    heights = [
        z - below[x, y] for x, y, z in np.round(points[above], 3).tolist() if (x, y) in below
    ]
    return round(min(heights, default=highest - lowest), 3)


def place_local(city, site, grid):
    """A city in metres from a site's origin, true east and north, in the system of a Grid: City."""
    trees = [_move_tree(tree, site.to_files) for tree in city.trees]
    return replace(city, points=site.to_files(city.points), trees=trees, **vars(grid))


def _move_tree(tree, move):
    """A tree whose points are moved by a function."""
    tree = copy.deepcopy(tree)
    tree.place = None if tree.place is None else move(tree.place)
    for polygon in tree.polygons:
        polygon.rings = [move(ring) for ring in polygon.rings]
    return tree


def join_cities(one, other):
    """Both cities as one: City in the system of the first, with the polygons and trees of both.

    Names of the second one that the first has already get a number. Its points stay as they are;
    without a system they are taken to be in the first one's.

    Raises
    ------
    InputError
        They are in different systems.
    """
    if other.crs is not None and other.grid != one.grid:
        raise InputError(
            "added buildings",
            f"it is in {other.crs}, the city in {one.crs}",
            "give them in the system of the city",
        )
    # Lists of names by polygon, the first city's before the other's; a city without one of them has
    # empty names there.
    lists = {
        name: [
            *(getattr(one, name) or [""] * len(one)),
            *(getattr(other, name) or [""] * len(other)),
        ]
        for name in LISTS
        if getattr(one, name) is not None or getattr(other, name) is not None
    }
    for name in ("surface_id", "building_id"):
        lists[name][len(one) :] = _rename(lists[name][len(one) :], lists[name][: len(one)])
    names = _rename([tree.name for tree in other.trees], [tree.name for tree in one.trees])
    added = [replace(tree, name=name) for tree, name in zip(other.trees, names, strict=True)]
    trees, shape = [*one.trees, *added], one.append_shape(*other.shape)
    # What is told of a building goes with its name.
    new_names = dict(zip(other.building_id, lists["building_id"][len(one) :], strict=True))
    told = {
        (new_names[building], part): own
        for (building, part), own in other.attributes.items()
        if building in new_names
    }
    # Where both tell something of one name, the first city's counts.
    joined = {"trees": trees, "attributes": one.attributes | told, **shape, **lists}
    return replace(one, colours=other.colours | one.colours, **joined)


def _rename(names, taken):
    """Names with a free number behind those that are taken: list of str."""
    taken = dict.fromkeys(taken, 1)
    new_names = {name: free_name(name, taken) for name in dict.fromkeys(names)}
    return [new_names[name] for name in names]
