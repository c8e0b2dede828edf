"""Roofs of a named shape over an outline: gabled, hipped, pyramidal, skillion.

Their height is a function of the place, linear on each of some fields that divide the outline: two
sides of a ridge, four slopes. So the solid is closed over any outline: walls go up to it.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely


class Roof(NamedTuple):
    """What attributes tell of a roof."""

    shape: str  # gabled, hipped, pyramidal, skillion
    height: float  # [m] of the roof alone
    # [°] clockwise from grid north: where it slopes down, square to its ridge; None: by `along`
    azimuth: float | None = None
    along: bool | None = None  # whether the ridge runs along the longer side, or across


def draw_shaped(outline, low, high, roof):
    """Polygons of a solid with a roof of a given shape: list of (class, rings).

    Parameters
    ----------
    outline : shapely.Polygon
        [m], its exterior counter-clockwise.
    low, high : float [m]
        Of the ground and of the top of the roof.
    roof : Roof

    Returns
    -------
    list of (str, list of (k, 3) float64 [m]), or None
        None where the roof has no height, is higher than the building, or does not fit the outline.
    """
    if not 0 < roof.height <= high - low + 1e-9:
        return None
    # The roof's own axes (along and across its ridge), and the fields that its shape has there.
    axes, middle, half = _frame(outline, roof)
    if min(half) <= 0:
        return None
    fields = _divide(outline, roof.shape, middle, half, axes)
    if fields is None:
        return None
    # Floor: the outline at the height of the ground, seen from below.
    eaves = high - roof.height
    drawn, lines = (
        [("GroundSurface", _rings(outline, lambda places: np.full(len(places), low), -1))],
        [],
    )
    # Roofs: the outline cut into fields, each with its own plane.
    for cell, slope in fields:
        for piece in shapely.get_parts(shapely.intersection(outline, cell)):
            if piece.geom_type == "Polygon" and piece.area > 1e-6:
                height = _plane(slope, eaves, roof.height, middle, axes)
                drawn.append(("RoofSurface", _rings(shapely.orient_polygons(piece), height)))
        lines.append(cell.boundary)
    # Walls: each edge of the outline, bent where it passes from one field to the next.
    borders = shapely.union_all(lines)
    for ring in (outline.exterior, *outline.interiors):
        corners = np.asarray(ring.coords)
        for start, end in pairwise(corners):
            drawn += _wall(start, end, borders, fields, (low, eaves, roof.height, middle, axes))
    return drawn


def _frame(outline, roof):
    """Axes (2, 2) of a roof, along its ridge and square to it; the middle (2,) and half the size
    (2,) [m] of the outline along them.
    """
    corners = np.asarray(outline.exterior.coords)[:-1]
    # The rectangle of least area around the outline tells its sides.
    box = np.asarray(shapely.minimum_rotated_rectangle(outline).exterior.coords)
    sides = box[1:3] - box[:2]
    length = np.linalg.norm(sides, axis=1)
    sides = sides / length[:, None]
    if roof.azimuth is not None:
        # A direction within 20° of a side is meant square to it, as compass points are.
        angle = np.radians(roof.azimuth)
        down = np.array([np.sin(angle), np.cos(angle)])
        ways = np.concatenate([sides, -sides])
        nearest = ways[np.argmax(ways @ down)]
        down = nearest if nearest @ down > np.cos(np.radians(20)) else down
    else:
        longer = int(length[1] > length[0])
        ridge = sides[longer if roof.along in (True, None) else 1 - longer]
        down = np.array([ridge[1], -ridge[0]])
    axes = np.array([[-down[1], down[0]], down])
    local = corners @ axes.T
    if roof.shape == "hipped" and np.ptp(local[:, 0]) < np.ptp(local[:, 1]):
        # The ridge of a hipped roof runs along the longer side.
        axes = np.array([-axes[1], axes[0]])
        local = corners @ axes.T
    least, most = local.min(axis=0), local.max(axis=0)
    return axes, 0.5 * (least + most) @ axes, 0.5 * (most - least)


def _divide(outline, shape, middle, half, axes):
    """Fields of a roof, each a shapely.Polygon, and its slope: share of the roof's height at the
    middle, and its change [1/m] along the two axes. None where the shape does not fit.

    `axes` are the directions of the ridge and square to it, `middle` and `half` the middle of the
    outline and half its size along them [m].
    """
    length, width = half
    # Somewhat larger than the outline, so that no corner is lost to rounding.
    far, wide = 1.01 * length + 1, 1.01 * width + 1

    def cell(*corners):
        return shapely.Polygon(middle + np.array(corners) @ axes)

    # Skillion: one plane over all, rising across the ridge's direction.
    if shape == "skillion":
        return [
            (cell((-far, -wide), (far, -wide), (far, wide), (-far, wide)), (0.5, 0, -0.5 / width))
        ]
    sides = [(1, 0, -1 / width), (1, 0, 1 / width)]
    # Gabled: two halves that fall from the ridge along the middle.
    if shape == "gabled":
        return [
            (cell((-far, 0), (far, 0), (far, wide), (-far, wide)), sides[0]),
            (cell((-far, -wide), (far, -wide), (far, 0), (-far, 0)), sides[1]),
        ]
    if shape == "pyramidal":
        # Each edge of an outline whose middle is seen from all of it rises to a point above it;
        # outlines with a court, or a middle that is not, have no such roof.
        apex = np.asarray(outline.centroid.coords)[0]
        corners = np.asarray(outline.exterior.coords)
        cells = [shapely.Polygon([*pair, apex]) for pair in pairwise(corners)]
        if (
            outline.interiors
            or abs(sum(one.area for one in cells) - outline.area) > 1e-6 * outline.area
        ):
            return None
        return [(one, _rise(one, apex, middle, axes)) for one in cells if one.area > 1e-9]
    # Any other shape but hipped is not known.
    if shape != "hipped":
        return None
    # All four slopes are alike; the ridge ends half the width before the ends.
    ridge = length - width
    ends = [(length / width, -1 / width, 0), (length / width, 1 / width, 0)]
    reach = max(far - ridge, wide)
    return [
        (cell((-ridge, 0), (ridge, 0), (ridge + reach, reach), (-ridge - reach, reach)), sides[0]),
        (
            cell((-ridge - reach, -reach), (ridge + reach, -reach), (ridge, 0), (-ridge, 0)),
            sides[1],
        ),
        (cell((ridge, 0), (ridge + reach, -reach), (ridge + reach, reach)), ends[0]),
        (cell((-ridge, 0), (-ridge - reach, reach), (-ridge - reach, -reach)), ends[1]),
    ]


def _rise(triangle, apex, middle, axes):
    """Slope, as of `_divide`, that is 0 on the first edge of a triangle and 1 at its apex."""
    corners = (np.asarray(triangle.exterior.coords)[:3] - middle) @ axes.T
    return tuple(np.linalg.solve(np.column_stack([np.ones(3), corners]), [0.0, 0.0, 1.0]))


def _plane(slope, eaves, height, middle, axes):
    """Height of a field: a function of places (k, 2), (k,) float64 [m]."""

    def measure(places):
        local = (np.asarray(places)[:, :2] - middle) @ axes.T
        share = slope[0] + slope[1] * local[:, 0] + slope[2] * local[:, 1]
        return eaves + height * np.clip(share, 0.0, 1.0)

    return measure


def _rings(shape, height, way=1):
    """Rings of a polygon at a height that is a function of the place, open, either way round."""
    rings = []
    for ring in (shape.exterior, *shape.interiors):
        corners = np.asarray(ring.coords)[:-1, :2]
        rings.append(np.column_stack([corners, height(corners)])[::way])
    return rings


def _wall(start, end, borders, fields, solid):
    """The wall below one edge of an outline: list of (class, rings), none where it has no area."""
    low, eaves, height, middle, axes = solid
    # Places along the edge where the roof passes from one field to another.
    met = shapely.get_coordinates(shapely.intersection(shapely.LineString([start, end]), borders))
    edge = end - start
    along = (met - start) @ edge / (edge @ edge)
    along = np.unique(
        np.round(np.concatenate([[0.0], along[(along > 1e-6) & (along < 1 - 1e-6)], [1.0]]), 9)
    )
    places = start + along[:, None] * edge
    tops = np.full(len(places), -np.inf)
    # Where fields meet they have one height: the field around the place tells it.
    for cell, slope in fields:
        near = shapely.distance(shapely.points(places), cell) < 1e-6
        tops[near] = np.maximum(
            tops[near], _plane(slope, eaves, height, middle, axes)(places[near])
        )
    upper = np.column_stack([places, tops])[::-1]
    # What stands no higher than its foot is no corner of its own.
    upper = upper[upper[:, 2] > low + 1e-9]
    lower = np.column_stack([[start, end], [low, low]])
    ring = np.concatenate([lower, upper])
    return [("WallSurface", [ring])] if len(ring) > 2 and len(upper) else []
