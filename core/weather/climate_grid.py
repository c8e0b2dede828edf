"""The built-in climate of the world: long-term means of every place on land."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

FILE = Path(__file__).with_name("climate_grid.npz")  # made by tools/make_climate_grid.py
CELL, SOUTH, WEST = 0.25, -59.875, -179.875  # fine grid: cell size and centre of the first cell [°]
SHAPE = (576, 1440)  # rows and columns
STEPS = {"ghi": 0.005, "temp_air": 0.1, "wind_speed": 0.1}
SHARE_STEP = 0.002
EARTH_RADIUS = 6371.0  # [km]
REACH = 100.0  # [km] to the nearest cell on land; the grid lacks many coastal cells
WINDOW = 4  # cells searched to the north and to the south of a place

# The share of land that air has passed over: along the parallel, from the west poleward of 30° and from the east
# equatorward (westerlies and trade winds), with an exponential memory of 2,000 km, in a band of ±3°.
TRADE_WINDS = 30.0  # [°]
MEMORY = 2000.0  # [km]
BAND = 12  # cells


@dataclass
class Normals:
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
    Normals or None
        None if there is no land in the grid within 100 km.

    Notes
    -----
    Annual means are those of the nearest land cell of 0.25° (PVCZ, from GLDAS NOAH); the monthly clearness is
    interpolated on 3° (gsee, from MERRA-2).
    """
    grid = read_grid()
    cell = find_cell(grid["land"], latitude, longitude)
    if cell is None:
        return None
    index = grid["number"][cell]
    annual = {name: float(grid[name][index]) for name in STEPS}
    # Bilinear between the four cells of the coarse grid around the place.
    south, height, west, width = grid["clearness_axes"]
    rows, columns, _ = grid["clearness"].shape
    row = np.clip((latitude - south) / height, 0, rows - 1.000001)
    column = ((longitude - west) / width) % columns
    up, right = row - int(row), column - int(column)
    around = grid["clearness"][np.ix_([int(row), int(row) + 1], [int(column), (int(column) + 1) % columns])]
    clearness = np.einsum("i,j,ijm->m", [1 - up, up], [1 - right, right], around)
    return Normals(**annual, clearness=clearness, land_influence=measure_land_influence(grid["land"], cell, latitude))


@cache
def read_grid():
    """Unpack the file: land mask (rows, columns), number of each land cell, values of the land cells, clearness."""
    with np.load(FILE) as file:
        packed = {name: file[name] for name in file.files}
    land = np.unpackbits(packed["land"], count=SHAPE[0] * SHAPE[1]).reshape(SHAPE).astype(bool)
    grid = {"land": land, "number": (np.cumsum(land) - 1).reshape(SHAPE)}
    for name, step in STEPS.items():
        grid[name] = np.cumsum(join_bytes(packed[name]), dtype=np.int32) * step
    first, second, west, east, *shape = packed["clearness_grid"]
    grid["clearness"] = join_bytes(packed["clearness"]).reshape([int(count) for count in shape]) * SHARE_STEP
    grid["clearness_axes"] = (first, second - first, west, east - west)
    return grid


def join_bytes(planes):
    """Numbers from their low and high bytes: (2, n) uint8 to (n,) int16."""
    return np.ascontiguousarray(planes.T).view("<i2").ravel()


def find_cell(land, latitude, longitude):
    """Row and column of the nearest land cell, None if there is none within reach."""
    nearest_row = round((latitude - SOUTH) / CELL)
    rows = np.arange(max(nearest_row - WINDOW, 0), min(nearest_row + WINDOW + 1, SHAPE[0]))
    across = int(min((WINDOW + 1) / max(np.cos(np.radians(latitude)), 0.02), SHAPE[1] // 2 - 1))
    columns = (round((longitude - WEST) / CELL) + np.arange(-across, across + 1)) % SHAPE[1]
    if not len(rows):
        return None
    window = land[np.ix_(rows, columns)]
    north = np.radians(SOUTH + CELL * rows)[:, None]
    east = np.radians(WEST + CELL * columns - longitude)
    here = np.radians(latitude)
    # Haversine formula: accurate for small distances.
    chord = np.sin((north - here) / 2) ** 2 + np.cos(here) * np.cos(north) * np.sin(east / 2) ** 2
    distance = np.where(window, 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(chord, 1.0))), np.inf)
    row, column = np.unravel_index(distance.argmin(), distance.shape)
    return (int(rows[row]), int(columns[column])) if distance[row, column] <= REACH else None


def measure_land_influence(land, cell, latitude):
    """Share of land along the parallel upwind of a cell, weighted with its distance: 0 to 1."""
    row, column = cell
    band = land[max(row - BAND, 0) : row + BAND + 1].mean(axis=0)
    steps = np.arange(SHAPE[1] // 2)
    upwind = column - steps if abs(latitude) >= TRADE_WINDS else column + steps
    width = np.radians(CELL) * EARTH_RADIUS * max(np.cos(np.radians(latitude)), 0.02)
    weight = np.exp(-steps * width / MEMORY)
    return float((weight * band[upwind % SHAPE[1]]).sum() / weight.sum())
