"""Tolerances of geometry: what counts as one place, as level with, and as facing each other.

All that reads, joins, cuts and traces a city takes these from here. `tests/hard/test_tolerances.py`
shows for each what becomes another when it is halved, or on which files nothing does.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """One field for each meaning; the comment above it has the source."""

    # What lies closer is in one place. Coordinates of city models are written in centimetres or
    # millimetres: CityGML 3.0 asks for a position within 0.2 m at level 3, val3dity snaps at 1 mm.
    accuracy: float = 0.01  # [m]
    # Corners of one building that are closer are one corner. Files have three decimals.
    corner: float = 1e-3  # [m]
    # Corners that come from the same number by another way are closer: float64 has 1e-9 m at 10,000
    # km, transformations of a system are inverted to within 0.1 mm.
    computed: float = 1e-4  # [m]
    # Corners of polygons that are closer become one vertex: less than any file writes.
    vertex: float = 1e-5  # [m]
    # Areas below a square millimetre have no reliable normal.
    area: float = 1e-6  # [m²]
    # Triangles of less area, relative to their longest edge squared, are degenerate: what float64
    # leaves of a square metre 10,000 km from the origin.
    sliver: float = 1e-9
    # Lengths, areas and shares that differ by less, relative to their size, count as equal, so that
    # rounding chooses nothing.
    tie: float = 1e-6
    # Rays start so many spacings of float32 off their face, by the size of its coordinates: at two
    # the first rays get lost.
    spacings: float = 8.0
    # Seams between sheets, humps of roofs and flat shapes up to this are inaccuracy: laser surveys
    # of cities err by so much in height.
    uneven: float = 0.1  # [m]
    # A face so close in front of another is its cladding, and an edge so far within an outline only
    # seems so: outlines from a survey and of roofs differ by the depth of eaves.
    cladding: float = 0.3  # [m]
    # What stands up to so far above the ground stands on it: a curb, a plinth, the bottom of a wall
    # on a slope. Less than the lowest thing that anyone may pass under.
    step: float = 0.5  # [m]
    # What stands higher has a storey below: a passage, a bridge, a podium. The clear height of
    # rooms is 2.4 to 2.5 m in building codes.
    storey: float = 2.5  # [m]
    # Faces whose unit normal has no larger vertical part are walls: within 1° of upright.
    upright: float = 0.01745
    # Faces face the same or opposite ways with at least this cosine between their normals: 26°,
    # loose since normals of slivers are mostly rounding.
    facing: float = 0.9


GEOMETRY = Tolerances()
