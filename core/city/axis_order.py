"""The order of the two coordinates of a file: along the meridian first, or second.

Registries have northing or latitude first in many systems, and many files have them second. What
decides is, in this order: which coordinates lie within the area of use of the system; the envelope
of the file; which places lie on land and near the latitude and longitude that the user gives; and
the classes of surfaces, where roofs face up and grounds down in one order alone. Else the order of
the registry is taken.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pyproj

from ..settings.errors import InputError
from .name_crs import hash_plane, name_crs
from .transform_crs import find_globe_places, plane_of, registered_axes

# [°] outside the area of use of a system; surveys and zones reach a few kilometres beyond theirs
MARGIN = 1.0
CLASSES = "classes of surfaces"
ORDERS = ("xy", "yx")
WORDS = {"xy": "east first", "yx": "north first"}


@dataclass(frozen=True)
class PlaceHints:
    """What the user tells of the place of a city, and what is known of the Earth."""

    axes: str = "auto"  # 'xy' or 'yx' where the user gives the order
    latitude: float | None = None  # [°]
    longitude: float | None = None  # [°]
    # callable(latitude, longitude): whether a place is on land or near it; None: unknown
    is_land: object = None
    # City or Site in whose system, order and plane the files are; None: as they say
    like: object = None
    # callable of a City of outlines that stand at 0: what tells the ground under places, as of
    # `extrude_footprints`; None: as their files say
    find_ground: object = None
    heights: object = None  # read.footprint_heights.HeightHints, of outlines


@dataclass(frozen=True)
class _AxisOrder:
    """An order of axes, and what decides it."""

    axes: str  # 'xy' or 'yx'
    reason: str = ""  # "" where nothing decides
    registered: str = "xy"
    doubtful: bool = False  # nothing decides, and the other order is as likely


def order_axes(middle, crs, hints, content=None):
    """Order of the coordinates of a file.

    Parameters
    ----------
    middle : (2,) float64 or None
        A point in the order and the units of the file.
    crs : str
        Their system.
    hints : PlaceHints
    content : FileContent, optional
        With the envelopes of the file and the classes of its surfaces.

    Returns
    -------
    AxisOrder

    Raises
    ------
    InputError
        `hints` name an unknown order.
    """
    if hints.axes not in ("auto", *ORDERS):
        raise InputError("--axes", f"{hints.axes!r} is not an order", "give auto, xy or yx")
    plane, _ = plane_of(crs)
    registered = registered_axes(plane)
    if hints.axes != "auto" or middle is None:
        given = hints.axes != "auto"
        return _AxisOrder(
            hints.axes if given else registered, "--axes" if given else "", registered
        )
    left = ORDERS
    for reason, left in _narrow(middle, (crs, plane, registered), hints, content):
        if len(left) == 1 and (reason != CLASSES or registered == "yx"):
            return _AxisOrder(left[0], reason, registered)
    # Surfaces inside out do not exchange axes that the registry has east first: their rings are
    # turned instead.
    return _AxisOrder(registered, "", registered, registered == "yx" or list(left) == ["yx"])


def _narrow(middle, system, hints, content):
    """The evidence for an order of coordinates, step by step: tuples of its name, and of the orders
    that it leaves among what earlier steps left: one, both where it does not decide, or none where
    it tells nothing. The caller stops at the first that leaves one.

    `middle` is a point of the file; `system` its crs, its plane, and the order of the registry.
    """
    (crs, plane, registered), left = system, list(ORDERS)
    places = {axes: _place_of(middle, plane, axes) for axes in ORDERS}

    def keep(test):
        """The orders that pass a test, or all of them where none does."""
        # A test that neither order passes tells nothing: all that were left stay.
        return [axes for axes in left if test(*places[axes])] or left

    # Coordinates outside the area of use in one order alone have the other one.
    # Tests follow one another, each on the orders that those before it left; a test that no order
    # passes leaves them all. What an envelope says of its own axes, and what roofs say, changes
    # nothing for the tests after it.
    yield "area of use", (left := keep(lambda *place: _is_within(place, plane.area_of_use)))
    # The envelope of the file names its axes, or lies in another system or order. By its axes alone
    # later steps are not narrowed.
    if content is not None:
        yield (
            "envelope",
            [axes for axes in left if axes == _order_of_extents(content, middle, registered)],
        )
        for elsewhere in _places_of_extents(content, crs):
            yield "envelope", (left := keep(partial(_is_near, elsewhere)))
    # A city stands on land, and near the place that the user gives.
    if hints.is_land and np.isfinite(list(places.values())).all():
        yield "land", (left := keep(hints.is_land))
    if hints.latitude is not None and hints.longitude is not None:
        yield (
            "--latitude, --longitude",
            (left := keep(partial(_is_near, (hints.latitude, hints.longitude)))),
        )
    # Roofs may face up in one order alone.
    if content is not None:
        yield CLASSES, [axes for axes in left if _faces_right(content, axes)]


def note_order(order, crs):
    """Sentences on an order that is not as usual, or that little decides: list of str."""
    other = next(axes for axes in ORDERS if axes != order.axes)
    instead = f"--axes {other} reads them {WORDS[other]}."
    if order.doubtful:
        words = (
            f"Nothing decides the order of the coordinates in {crs}: read {WORDS[order.axes]}, as "
            "registered."
        )
        return [f"{words} {instead}"]
    known = order.reason in ("", "--axes") or (order.reason == "area of use" and order.axes == "xy")
    if known or (order.axes == order.registered and order.reason != CLASSES):
        return []
    return [
        f"Coordinates in {crs} were read {WORDS[order.axes]}, told by: {order.reason}. {instead}"
    ]


def middle_of(content):
    """Median of the first points of all outlines, (2,) float64; None without any."""
    drawn = [*content.polygons, *(polygon for tree in content.trees for polygon in tree.polygons)]
    firsts = [polygon.rings[0][0, :2] for polygon in drawn if len(polygon.rings[0])]
    firsts += [tree.place[:2] for tree in content.trees if tree.place is not None]
    if content.footprints is not None and len(content.footprints.points):
        firsts.append(np.median(content.footprints.points, axis=0))
    return np.median(firsts, axis=0) if firsts else None


def _place_of(middle, plane, axes):
    """Latitude and longitude [°] of a point, infinite where there is none."""
    if plane.is_geographic:
        unit = np.degrees(plane.axis_info[0].unit_conversion_factor)
        if abs(middle[0 if axes == "yx" else 1] * unit) > 90:
            return np.inf, np.inf
    latitude, longitude = find_globe_places([middle], plane, axes)
    return float(latitude[0]), float(longitude[0])


def _is_within(place, area):
    latitude, longitude = place
    if not np.isfinite(place).all():
        return False
    if area is None:
        return True
    past_west, width = (longitude - area.west) % 360, (area.east - area.west) % 360 or 360.0
    inside = past_west <= width + MARGIN or past_west >= 360 - MARGIN
    return inside and area.south - MARGIN <= latitude <= area.north + MARGIN


def _is_near(other, latitude, longitude):
    # Near is within 100 km of the place that the user gives.
    return pyproj.Geod(ellps="WGS84").inv(longitude, latitude, *other[::-1])[2] <= 100e3


def _order_of_extents(content, middle, registered):
    """Order that the envelopes of a file tell, None where they tell nothing.

    One with names for its axes tells how the points in it are ordered; one that holds the points
    only the other way round is as registered, and they are not.
    """
    for extent in content.extents:
        if name_crs(extent.srs_name) not in (None, content.crs):
            continue
        low, high = np.minimum(extent.low, extent.high), np.maximum(extent.low, extent.high)
        holds = {
            "same": bool(((middle >= low) & (middle <= high)).all()),
            "other": bool(((middle[::-1] >= low) & (middle[::-1] <= high)).all()),
        }
        if holds["same"] == holds["other"]:
            continue
        labels = extent.labels.lower().split()[:2]
        northern = [label[0] == "n" or label.startswith("lat") for label in labels]
        own = (
            registered
            if len(labels) < 2 or northern[0] == northern[1]
            else "yx"
            if northern[0]
            else "xy"
        )
        if holds["same"] and own == registered and not any(northern):
            continue
        return own if holds["same"] else next(axes for axes in ORDERS if axes != own)
    return None


def _places_of_extents(content, crs):
    """Latitude and longitude [°] of envelopes in another system than the points'."""
    for extent in content.extents:
        other = name_crs(extent.srs_name)
        if other is None or hash_plane(other) == hash_plane(crs):
            continue
        plane, middle = plane_of(other)[0], (extent.low + extent.high) / 2
        places = [_place_of(middle, plane, axes) for axes in (registered_axes(plane), *ORDERS)]
        yield from [place for place in places if _is_within(place, plane.area_of_use)][:1]


def _faces_right(content, axes):
    """Whether the roofs of a file face up and its grounds down where its coordinates have
    an order.
    """
    up, turn = {"RoofSurface": 1.0, "GroundSurface": -1.0}, 1.0 if axes == "xy" else -1.0
    right = total = 0.0
    for polygon in content.polygons:
        if polygon.thematic in up and len(polygon.rings[0]) > 2:
            x, y = (polygon.rings[0][:, :2] - polygon.rings[0][0, :2]).T
            area = (
                0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)) * (-1.0 if polygon.flipped else 1.0)
            )
            right += max(up[polygon.thematic] * turn * area, 0.0)
            total += abs(area)
    # A share of 95 % of the area of roofs and grounds that faces the way of its class makes it
    # sure.
    return total > 0 and right >= 0.95 * total
