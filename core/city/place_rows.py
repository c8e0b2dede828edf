"""Rows of modules on one flat roof, seen from above in the roof's own plane, where nothing rises
above it.

      y (up the slope of a row)
      │   ┌───────────────┐
rim   │   │▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒│ row 2         A row is as long as its whole depth lies in the free area; what
      │   │               │               stands on the roof cuts it into pieces.
      │   │▒▒▒▒▒┐  ┌▒▒▒▒▒▒│ row 1   ┐
      │   └─────┴──┴──────┘         ┘ depth · cos tilt
      └──────────────────────── x (along the rows)
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely

from ..settings.errors import InputError
from ..settings.tolerances import GEOMETRY

THICKNESS = 0.03  # [m] of a module with its frame
GAP = 0.02  # [m] least distance between modules


@dataclass
class _RoofFrame:
    """Axes of a flat roof, and how rows stand on it."""

    origin: np.ndarray  # (3,) [m]
    axes: np.ndarray  # (3, 3): along the rows, up their slope, out of the roof
    pitch: float  # [m] from row to row


def frame_roof(racks, normal, origin, latitude):
    """Axes of a roof for rows that face the wanted azimuth, and their pitch.

    Parameters
    ----------
    racks : Racks
    normal, origin : array, (3,) float
        Of the roof; the scene's axes.
    latitude : float or None [°]

    Returns
    -------
    RoofFrame

    Raises
    ------
    InputError
        The spacing leaves no room for a row, or depends on a latitude that nobody knows.
    """
    south = latitude is not None and latitude < 0
    azimuth = (
        racks.azimuth
        if racks.azimuth is not None
        else 90.0
        if racks.east_west
        else 0.0
        if south
        else 180.0
    )
    # The upward axis of the roof leads away from where the rows face, in its plane; across it they
    # run.
    facing = np.array([math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth)), 0.0])
    upward = facing @ normal * normal - facing
    upward /= np.linalg.norm(upward)
    axes = np.array([np.cross(upward, normal), upward, normal])
    return _RoofFrame(np.asarray(origin, float), axes, _choose_pitch(racks, axes, latitude))


def _choose_pitch(racks, axes, latitude):
    """Distance from row to row [m]: as given, else with an aisle between pairs that face east and
    west, else so that none shades another at noon of the winter solstice.

    Raises
    ------
    InputError
        The given distance leaves no room for the rows, or the latitude is needed and unknown.
    """
    least = _width_of_row(racks) + GAP + THICKNESS * math.sin(math.radians(racks.tilt))
    # A given spacing, or the one of a given share of ground that modules cover, must leave room for
    # a row and a gap.
    if racks.spacing is not None or racks.gcr is not None:
        modules = racks.depth * (2 if racks.east_west else 1)
        pitch = racks.spacing if racks.spacing is not None else modules / racks.gcr
        if pitch < least - 1e-9:
            raise InputError(
                "--racks",
                f"{f'spacing={pitch:g}' if racks.gcr is None else f'gcr={racks.gcr:g}'} leaves no "
                "room",
                f"rows of this depth and tilt need a spacing of at least {least:.3f} m (gcr "
                f"{modules / least:.3f})",
            )
        return pitch
    if racks.east_west:
        # An aisle of half a metre between pairs of rows.
        return _width_of_row(racks) + 0.5
    # All other rows need the latitude.
    if latitude is None:
        raise InputError(
            "--racks",
            "the spacing follows from the latitude, which is unknown",
            "give --latitude D",
        )
    # The shadow across the rows, behind them, per height: none if it falls before them.
    # The sun of the winter solstice, by the obliquity of the ecliptic, 23.44°.
    zenith = math.radians(abs(latitude) + 23.44)
    _, up_slope, out = axes @ [0.0, -math.copysign(math.sin(zenith), latitude), math.cos(zenith)]
    # A sun lower than 10° above the row's horizon is taken as 10°: the shadow of a row is at most
    # 5.7 times its height.
    shadow = max(0.0, -up_slope) / max(out, -up_slope * math.tan(math.radians(10.0)), 1e-9)
    # Rows never come closer than a row and a gap need, however short the shadow.
    return max(
        least, _width_of_row(racks) + racks.depth * math.sin(math.radians(racks.tilt)) * shadow
    )


def _width_of_row(racks):
    """Width of a row, or of a pair of rows, seen from above [m]."""
    width = racks.depth * math.cos(math.radians(racks.tilt))
    # The undersides of a pair lean towards each other.
    return (
        2 * (width + THICKNESS * math.sin(math.radians(racks.tilt))) + GAP
        if racks.east_west
        else width
    )


def place_rows(racks, frame, free):
    """Rows on the free area of a roof: each stretch that is free over a row's whole width gets one.

    Parameters
    ----------
    racks : Racks
    frame : RoofFrame
    free : shapely geometry
        Area where rows may stand, in the first two axes of the frame [m].

    Returns
    -------
    array, (k, 4, 3) float64 [m]
        Corners of the fronts, counter-clockwise seen from the front, the lower edge first. Of a
        pair the row that faces the wanted azimuth comes before the other. None, k = 0, where the
        free area has no room for a row.
    """
    # How many rows fit at this pitch, front to front.
    width = _width_of_row(racks)
    bounds = free.bounds
    count = (
        math.floor((bounds[3] - bounds[1] - width) / frame.pitch + 1e-9) + 1
        if not free.is_empty
        else 0
    )
    if count < 1:
        return np.empty((0, 4, 3))
    # What is left over lies half before the first row and half behind the last.
    first = 0.5 * (bounds[1] + bounds[3] - width - (count - 1) * frame.pitch)
    # A row leans back from its lower edge: depth · cos tilt in plan, depth · sin tilt up.
    #
    #      top  ╱│
    #         ╱  │ depth · sin tilt
    # bottom ╱───┘
    #     depth · cos tilt
    tilt, bottom = math.radians(racks.tilt), racks.height
    across, top = racks.depth * math.cos(tilt), bottom + racks.depth * math.sin(tilt)
    rows = []
    for low in first + frame.pitch * np.arange(count):
        for left, right in _free_stretches(free, low, low + width):
            ridge = low + across
            rows.append(
                [(left, low, bottom), (right, low, bottom), (right, ridge, top), (left, ridge, top)]
            )
            # Of a pair the second leans the other way, back to back with the first.
            if racks.east_west:
                end, ridge = low + width, low + width - across
                rows.append(
                    [
                        (right, end, bottom),
                        (left, end, bottom),
                        (left, ridge, top),
                        (right, ridge, top),
                    ]
                )
    # From the frame of the roof to the scene.
    local = np.array(rows).reshape(-1, 4, 3)
    return frame.origin + local @ frame.axes


def _free_stretches(free, low, high):
    """Stretches along a strip that are free in its whole width: list of (left, right) [m]."""
    left, _, right, _ = free.bounds
    strip = shapely.box(left, low, right, high)
    taken = shapely.get_parts(shapely.difference(strip, free))
    ends = shapely.bounds(taken[shapely.area(taken) > 1e-9])
    stretches, start = [], left
    for begin, end in sorted(zip(ends[:, 0].tolist(), ends[:, 2].tolist(), strict=True)):
        stretches.append((start, begin))
        start = max(start, end)
    stretches.append((start, right))
    # A row is at least as long as a module, about 1.5 m.
    return [(begin, end) for begin, end in stretches if end - begin >= 1.5]


def free_area(rings, frame, rim, obstacles):
    """Free area of a roof in its own plane.

    Parameters
    ----------
    rings : list of array, (k, 3) float64 [m]
        The outline first.
    frame : RoofFrame
    rim : float [m]
    obstacles : tuple
        As of `_outline_risen`.

    Returns
    -------
    shapely geometry
        In the first two axes of the frame [m].
    """
    flat = [((ring - frame.origin) @ frame.axes.T)[:, :2] for ring in rings]
    roof = shapely.make_valid(shapely.Polygon(flat[0], flat[1:]))
    free = shapely.buffer(roof, -rim, join_style="mitre")
    low, high = rings[0].min(axis=0)[:2] - rim, rings[0].max(axis=0)[:2] + rim
    risen = _outline_risen(obstacles, frame, low, high)
    return (
        shapely.difference(free, shapely.union_all(shapely.buffer(risen, rim)))
        if len(risen)
        else free
    )


def _outline_risen(obstacles, frame, low, high):
    """Outlines of what rises above a roof's plane, in its frame.

    Each triangle is cut off above what is `uneven`; the rest is seen straight from above.

    Parameters
    ----------
    obstacles : tuple
        Corners of triangles, (t, 3, 3) float64 [m], and a shapely.STRtree of these in plan.
    frame : RoofFrame
    low, high : array, (2,) float [m]
        Corners of the place that counts, seen from above.

    Returns
    -------
    array of shapely geometries
        Walls are lines.
    """
    corners, tree = obstacles
    corners = corners[tree.query(shapely.box(*low, *high))]  # (n, 3, 3)
    normal, least_rise = frame.axes[2], GEOMETRY.uneven
    height = (corners - frame.origin) @ normal / normal[2]  # (n, 3) [m] straight above the plane
    rises = height.max(axis=1, initial=-np.inf) > least_rise
    corners, height = corners[rises], height[rises]
    following = np.roll(corners, -1, axis=1), np.roll(height, -1, axis=1)
    # Corners above the cut, and where edges pass through it; other places repeat one that is above.
    highest = np.take_along_axis(corners, height.argmax(axis=1)[:, None, None], axis=1)
    above = np.where(height[..., None] > least_rise, corners, highest)
    passes = (height > least_rise) != (following[1] > least_rise)
    share = np.divide(
        least_rise - height, following[1] - height, out=np.zeros_like(height), where=passes
    )
    cuts = np.where(
        passes[..., None], corners + share[..., None] * (following[0] - corners), highest
    )
    places = np.concatenate([above, cuts], axis=1) - frame.origin  # (n, 6, 3)
    places[..., 2] -= places @ normal / normal[2]
    flat = places @ frame.axes[:2].T
    return shapely.convex_hull(shapely.multipoints(flat)) if len(flat) else np.empty(0, object)
