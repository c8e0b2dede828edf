"""Classify surfaces for photovoltaics: kind by tilt, orientation by azimuth, eligibility, and which
are footprints.
"""

import numpy as np

from ..settings.errors import UNIT, check_array
from ..settings.tolerances import GEOMETRY
from .city import number_names
from .polygons import polygon_bounds

SMALLEST_ELIGIBLE_AREA = 6.25  # [m²]
TOLERANCE = 1e-6  # [°] on every bound
ORIENTATIONS = (
    "north",
    "northeast",
    "east",
    "southeast",
    "south",
    "southwest",
    "west",
    "northwest",
)
PAPER = "paper"  # its sectors: 30° either side of north, east, south, west
INCLINED = ("facade", "roof", "steep")  # kinds that face somewhere
BEARING = (*INCLINED, "flat")  # kinds that may carry modules


def measure_tilt(normal):
    """Tilt and azimuth of surfaces.

    Parameters
    ----------
    normal : array, (n, 3) float64
        Unit length, x true east, y true north, z up.

    Returns
    -------
    surface_tilt : array, (n,) float64 [°]
        0 faces the zenith, 90 is a wall, 180 faces the ground.
    surface_azimuth : array, (n,) float64 [°]
        Clockwise from true north; 0 if the surface is level.
    """
    normal = check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)
    across = np.hypot(normal[:, 0], normal[:, 1])
    surface_tilt = np.degrees(np.arctan2(across, normal[:, 2]))
    surface_azimuth = np.degrees(np.arctan2(normal[:, 0], normal[:, 1])) % 360.0
    surface_azimuth[across < 1e-6] = 0.0
    surface_azimuth[surface_azimuth >= 360.0] = 0.0  # the remainder of -1e-15 rounds up
    return surface_tilt, surface_azimuth


def classify(area, surface_tilt, surface_azimuth, thematic, sectors="8", *, sector_width=45.0):
    """Kind, orientation and eligibility of surfaces.

    Facades are steeper than 89° and not steeper than 91°, roofs between 15° and 60°, steep roofs
    between both, flat roofs below. All of them are eligible from 6.25 m². With the paper's sectors
    facades and roofs alone are, and within 30° of a cardinal direction (Bredemeier et al., CityPV).
    Other surfaces get a kind too: they shade and reflect.

    Parameters
    ----------
    area : array, (n,) float64 [m²]
    surface_tilt, surface_azimuth : array, (n,) float64 [°]
    thematic : sequence of str, (n,)
        Class in the file: WallSurface, …, TINRelief for terrain, or "".
    sectors : {'8', 'paper'}
        Eight of 45°, so that each azimuth has one (a bound belongs to the sector before it), or the
        paper's.

    Returns
    -------
    kind : array, (n,) str
        facade, roof, flat, steep, downward or ground.
    orientation : array, (n,) str
        One of `ORIENTATIONS`, or none.
    eligible : array, (n,) bool
        Closure surfaces never are.

    Raises
    ------
    InputError
        An array has another length, or a number out of its range.
    """
    count = len(thematic)
    area = check_array("area", area, (count,), most=np.inf)
    tilt = check_array("surface_tilt", surface_tilt, (count,), least=0, most=180)
    surface_azimuth = check_array("surface_azimuth", surface_azimuth, (count,), least=0, most=360)
    thematic = np.asarray(thematic, dtype=str)
    # Kind by the file's class or by tilt: ground (terrain, or a GroundSurface that does not face
    # down), beyond upright, upright, steep, inclined, level.
    kind = np.select(
        [
            (thematic == "TINRelief") | ((thematic == "GroundSurface") & (tilt <= 91 + TOLERANCE)),
            tilt > 91 + TOLERANCE,
            tilt > 89 + TOLERANCE,
            tilt > 60 + TOLERANCE,
            tilt >= 15 - TOLERANCE,
        ],
        ["ground", "downward", "facade", "steep", "roof"],
        default="flat",
    )
    # Orientation: the nearest sector's middle; a bound belongs to the sector before it. Kinds that
    # are level, face down or are ground get none.
    step = 2 * sector_width if sectors == PAPER else sector_width
    sector = np.ceil((surface_azimuth - TOLERANCE) / step - 0.5)
    orientation = np.array(ORIENTATIONS)[
        (sector * step / sector_width).astype(int) % len(ORIENTATIONS)
    ]
    facing, eligible = np.isin(kind, INCLINED), np.isin(kind, BEARING)
    if sectors == PAPER:
        # The paper counts facades and roofs alone, near the middle of a sector.
        facing &= np.abs(surface_azimuth - sector * step) <= 30.0 + TOLERANCE
        eligible = np.isin(kind, ["facade", "roof"]) & facing
    orientation[~facing] = "none"
    eligible &= (area >= SMALLEST_ELIGIBLE_AREA) & (thematic != "ClosureSurface")
    return kind, orientation, eligible


def find_footprints(surfaces, city, points):
    """Surfaces under buildings: GroundSurfaces, and for buildings without any, downward ones at the
    lowest height.

    Parameters
    ----------
    surfaces : Surfaces
    city : City
    points : array, (m, 3) float64 [m]
        Points of the city, in any frame with z up.

    Returns
    -------
    footprint : array, (n,) bool
    """
    named = np.array(surfaces.thematic) == "GroundSurface"
    building = number_names(surfaces.building_id)
    has_ground = np.bincount(building, weights=named) > 0
    low, high = polygon_bounds(points[:, 2], city.ring_start, city.polygon_start)
    lowest = np.full(building.max(initial=-1) + 1, np.inf)
    np.minimum.at(lowest, building, low)
    # A downward surface up to a step above its building's lowest point lies on the ground.
    at_bottom = (surfaces.kind == "downward") & (high <= lowest[building] + GEOMETRY.step)
    return named | (at_bottom & ~has_ground[building])
