"""The built-in climate of the world: long-term means of every place from 60° S to the North Pole,
land and sea.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pvlib

from ..settings.errors import InputError

FILE = Path(__file__).with_name("climate_grid.npz")  # made by tools/make_climate_grid.py
# The fine grid, of air temperature and wind on land: cell size and centre of the first cell [°],
# rows and columns.
CELL, SOUTH, WEST, SHAPE = 0.25, -59.875, -179.875, (576, 1440)
STEPS = {"temp_air": 0.1, "wind_speed": 0.1}
LEAST_LATITUDE = -60.0  # [°], of the climate; farther south no source tells the temperature
EARTH_RADIUS = 6371.0  # [km]
LAPSE = 0.0065  # [K/m] of air temperature with height, ISO 2533


@dataclass
class _Normals:
    """Long-term means of one place."""

    ghi: float  # [kWh/m² per day], mean of the year
    temp_air: float  # [°C], mean of the year
    wind_speed: float  # [ms⁻¹], root of the mean square at 10 m
    clearness: np.ndarray  # (12,) clearness index of each month relative to the year's
    land_influence: float  # 0 to 1, share of land that the air has passed over


def look_up_normals(latitude, longitude):
    """Long-term means of a place.

    Parameters
    ----------
    latitude, longitude : float
        Place [°]; any longitude.

    Returns
    -------
    Normals

    Raises
    ------
    InputError
        The place lies south of 60° S.

    Notes
    -----
    Annual GHI is interpolated on 0.5°: Global Solar Atlas 2 on land and within 100 km of it, else
    NASA SSE. The monthly clearness is interpolated on 3° (the mean of SSE's and MERRA-2's). Air
    temperature and wind are taken from the nearest land cell of 0.25° within 100 km (PVCZ, from
    GLDAS NOAH); at sea from the nearest coasts, to which distances in latitude count three times,
    at the altitude of the place.
    """
    if latitude < LEAST_LATITUDE:
        raise InputError(
            "--weather climate",
            f"it does not know {latitude:.2f}°, {longitude:.2f}°: it ends at 60° S",
            "give weather files, or clear-sky as an upper bound",
        )
    # On land the nearest cell tells; at sea a coarse grid at sea level does, cooled to the height
    # of the place.
    grid = _read_grid()
    cell = _find_cell(grid["land"], latitude, longitude)
    if cell is None:
        temp_air, wind_speed = _interpolate_grid(grid["sea"], latitude, longitude)
        temp_air -= LAPSE * float(pvlib.location.lookup_altitude(latitude, longitude))
    else:
        temp_air, wind_speed = (grid[name][grid["number"][cell]] for name in STEPS)
    return _Normals(
        ghi=float(_interpolate_grid(grid["ghi"], latitude, longitude)),
        temp_air=float(temp_air),
        wind_speed=float(wind_speed),
        clearness=_interpolate_grid(grid["clearness"], latitude, longitude),
        land_influence=measure_land_influence(grid["land"], latitude, longitude),
    )


@cache
def _read_grid():
    """Unpack the file: land mask (rows, columns), number of each land cell, values of the land
    cells, global grids.
    """
    with np.load(FILE) as file:
        packed = {name: file[name] for name in file.files}
    # One bit a cell for land and sea; numbers count the land cells in rows.
    land = np.unpackbits(packed["land"], count=SHAPE[0] * SHAPE[1]).reshape(SHAPE).astype(bool)
    grid = {"land": land, "number": (np.cumsum(land) - 1).reshape(SHAPE)}
    # Values of the file are whole steps, and differences from the cell before where these are
    # smaller.
    for name, step in STEPS.items():
        grid[name] = np.cumsum(_join_bytes(packed[name]), dtype=np.int32) * step
    ghi = _join_bytes(packed["ghi"]).reshape(360, 720)
    grid["ghi"] = np.cumsum(ghi, axis=1, dtype=np.int32) * 0.01
    grid["clearness"] = _join_bytes(packed["clearness"]).reshape(60, 120, 12) * 0.002
    grid["sea"] = _join_bytes(packed["sea"]).reshape(60, 120, 2) * 0.1
    return grid


def _join_bytes(planes):
    """Numbers from their low and high bytes: (2, n) uint8 to (n,) int16."""
    return np.ascontiguousarray(planes.T).view("<i2").ravel()


def is_land(latitude, longitude):
    """Whether a place lies on land or within 100 km of it."""
    return _find_cell(_read_grid()["land"], latitude, longitude) is not None


def _find_cell(land, latitude, longitude, *, cells_around=4):
    """Row and column of the nearest land cell, None if there is none within reach."""
    # A window of cells around the place, as wide in kilometres to the east as to the north; near
    # the poles that is many columns, and it closes around the globe.
    nearest_row = round((latitude - SOUTH) / CELL)
    rows = np.arange(
        max(nearest_row - cells_around, 0), min(nearest_row + cells_around + 1, SHAPE[0])
    )
    across = int(
        min((cells_around + 1) / max(np.cos(np.radians(latitude)), 0.02), SHAPE[1] // 2 - 1)
    )
    columns = (round((longitude - WEST) / CELL) + np.arange(-across, across + 1)) % SHAPE[1]
    if not len(rows):
        return None
    window = land[np.ix_(rows, columns)]
    north = np.radians(SOUTH + CELL * rows)[:, None]
    east = np.radians(WEST + CELL * columns - longitude)
    here = np.radians(latitude)
    # Haversine formula: accurate for small distances.
    chord = np.sin((north - here) / 2) ** 2 + np.cos(here) * np.cos(north) * np.sin(east / 2) ** 2
    distance = np.where(
        window, 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(chord, 1.0))), np.inf
    )
    row, column = np.unravel_index(distance.argmin(), distance.shape)
    # The grid lacks many coastal cells: a cell on land within 100 km will do.
    return (int(rows[row]), int(columns[column])) if distance[row, column] <= 100.0 else None


def _interpolate_grid(values, latitude, longitude):
    """Bilinear interpolation between the four cells around a place, of a grid of the whole globe.

    Parameters
    ----------
    values : numpy.ndarray, (rows, columns, …)
        From the South Pole and from 180° W; the values of a cell stand for its middle.
    latitude, longitude : float
        Place [°].
    """
    (south_west, south_east, north_west, north_east), upper, right = _cells_around(
        values, latitude, longitude
    )
    south = (1 - right) * south_west + right * south_east
    return (1 - upper) * south + upper * ((1 - right) * north_west + right * north_east)


def spread_of_ghi(latitude, longitude):
    """Annual GHI of the four cells around a place: the largest less the smallest, as a share of
    their mean.
    """
    cells = np.array(_cells_around(_read_grid()["ghi"], latitude, longitude)[0], float)
    return float(np.ptp(cells) / cells.mean())


def _cells_around(values, latitude, longitude):
    """The four cells around a place (south-west, south-east, north-west, north-east) and its place
    among them.

    The place is the share of the way from south to north and from west to east.
    """
    # Coordinates in cells, counted from the middle of the first; rows end at the poles, columns go
    # round the globe.
    rows, columns = values.shape[:2]
    row = np.clip((latitude + 90) * rows / 180 - 0.5, 0, rows - 1.000001)
    column = ((longitude + 180) * columns / 360 - 0.5) % columns
    low, left = int(row), int(column)
    beside = (left + 1) % columns
    cells = [values[low, left], values[low, beside], values[low + 1, left], values[low + 1, beside]]
    return cells, row - low, column - left


def measure_land_influence(land, latitude, longitude, *, band_cells=12):
    """Share of land along the parallel upwind of a place, weighted with its distance: 0 to 1."""
    # band  Share of land among the rows around the parallel, for each column.
    row = round((latitude - SOUTH) / CELL)
    column = round((longitude - WEST) / CELL)
    band = (
        land[max(row - band_cells, 0) : row + band_cells + 1].mean(axis=0)
        if row < SHAPE[0] + band_cells
        else np.zeros(SHAPE[1])
    )
    # Columns upwind, from the place outwards, up to half round the Earth.
    steps = np.arange(SHAPE[1] // 2)
    # Air comes from the west poleward of 30° and from the east equatorward (westerlies and trade
    # winds), and forgets what it passed over with an exponential memory of 2,000 km.
    upwind = column - steps if abs(latitude) >= 30.0 else column + steps
    # width  of a column along the parallel [km]; land counts less with its distance.
    width = np.radians(CELL) * EARTH_RADIUS * max(np.cos(np.radians(latitude)), 0.02)
    weight = np.exp(-steps * width / 2000.0)
    return float((weight * band[upwind % SHAPE[1]]).sum() / weight.sum())
