"""Make core/weather/climate_grid.npz, the world's climate that ships with the program, from its
four sources.

    .venv/bin/python tools/make_climate_grid.py solar-grid.json 22yr_swv_dwn.gz
    pvcz_land_025deg_annual.csv.gz \
        gsee_merra2_monthly_mean_daily_irradiance_3deg.npz

1. Annual GHI of land on 0.5°, 57° S to 65° N: Global Solar Atlas 2 (CC BY 4.0; Solargis for the
   World Bank, ESMAP).
2. Monthly and annual GHI of the globe on 1°, 1983 to 2005: NASA SSE 6.0 (a work of the US
   government).
3. Annual means of air temperature and wind of land on 0.25°: PVCZ 0.3.0 (MIT, T. Karin 2019; from
   NASA's GLDAS).
4. Monthly GHI of land on 3°, 2011 to 2015: gsee-climate-data 1.0.0 (BSD-3; from NASA's MERRA-2).

The level of a year is that of 1 within 100 km of its cells, else that of 2. The course of the year
is the mean of 2 and 4, in each month's clearness index relative to the year's.
"""

import argparse
import gzip
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
from scipy.spatial import cKDTree

TARGET = Path(__file__).resolve().parent.parent / "core" / "weather" / "climate_grid.npz"
# of the fine grid: centre of its first cell [°]
CELL, SOUTH, WEST, SHAPE = (
    0.25,
    -59.875,
    -179.875,
    (576, 1440),
)
STEPS = {"temp_air": 0.1, "wind_speed": 0.1}  # kept steps: [°C], [ms⁻¹]
COLUMNS = {"temp_air": "T_air_mean_C", "wind_speed": "wind_speed_rms"}
GHI_STEP, SHARE_STEP, SEA_STEP = 0.01, 0.002, 0.1  # [kWh/m² per day], [–], [°C] and [ms⁻¹]
DARK = 1.0  # [Wm⁻²] outside the atmosphere; darker months tell nothing of the clearness
DAYS = np.array([31, 28.25, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])
EARTH_RADIUS, REACH = 6371.0, 100.0  # [km]
LAPSE = 0.0065  # [K/m], ISO 2533
# number of coastal cells that tell the air at sea; latitudes count as three times as far
COASTS, STRETCH = (
    8,
    3.0,
)


def main():
    """Read the sources, write the file, say its size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("atlas", type=Path, help="solar-grid.json of the Global Solar Atlas")
    parser.add_argument("sse", type=Path, help="22yr_swv_dwn.gz of NASA SSE")
    parser.add_argument("annual", type=Path, help="pvcz_land_025deg_annual.csv.gz")
    parser.add_argument(
        "monthly", type=Path, help="gsee_merra2_monthly_mean_daily_irradiance_3deg.npz"
    )
    parser.add_argument("--out", type=Path, default=TARGET)
    options = parser.parse_args()
    sse = read_sse(options.sse)
    table = pd.read_csv(options.annual)
    level = annual_level(read_atlas(options.atlas), sse)
    arrays = {
        "ghi": split_bytes(np.diff(steps_of(level, GHI_STEP), axis=1, prepend=0)),
        "clearness": split_bytes(
            steps_of(monthly_course(sse, np.load(options.monthly)), SHARE_STEP)
        ),
        "sea": split_bytes(steps_of(air_at_sea(table), SEA_STEP)),
    }
    np.savez_compressed(options.out, **arrays, **pack_land(table))
    print(f"{options.out}: {options.out.stat().st_size / 1e3:.0f} kB")


def read_atlas(path):
    """Annual GHI [kWh/m² per day] of the Atlas from the South Pole and 180° W, NaN at sea: (360,
    720).
    """
    source = json.loads(path.read_text())
    column, row, level = np.array(source["cells"]).T
    grid = np.full((360, 720), np.nan)
    grid[359 - row, column] = source["min"] + level / 1000 * (source["max"] - source["min"])
    return grid


def read_sse(path):
    """Monthly and, last, annual GHI [kWh/m² per day] of SSE from the South Pole and 180° W: (180,
    360, 13).
    """
    lines = gzip.decompress(path.read_bytes()).decode("ascii").splitlines()
    table = np.loadtxt(
        lines[next(n for n, line in enumerate(lines) if line.startswith("Lat Lon")) + 1 :]
    )
    grid = np.full((180, 360, 13), np.nan)
    grid[(table[:, 0] + 90).astype(int), (table[:, 1] + 180).astype(int)] = table[:, 2:]
    return grid


def annual_level(atlas, sse):
    """Annual GHI [kWh/m² per day] of the globe: the Atlas's nearest cell within reach, else SSE's:
    (360, 720).
    """
    known = np.isfinite(atlas)
    middle = unit_vectors(*cell_middles(0.5))
    distance, nearest = cKDTree(middle[known]).query(middle)
    near = 2 * EARTH_RADIUS * np.arcsin(np.minimum(distance / 2, 1)) <= REACH
    return np.where(near, atlas[known][nearest], resample_halves(sse[..., 12]))


def resample_halves(values):
    """Values of 1° interpolated between the middles of cells to those of 0.5°: (180, 360) to (360,
    720).
    """
    rows = np.clip(np.arange(360) / 2 - 0.25, 0, 179)
    columns = np.arange(720) / 2 - 0.25
    low, left = np.floor(rows).astype(int), np.floor(columns).astype(int)
    upper, right = (rows - low)[:, None], columns - left
    above, beside = np.minimum(low + 1, 179), (left + 1) % 360
    below = (1 - right) * values[np.ix_(low, left % 360)] + right * values[np.ix_(low, beside)]
    return (1 - upper) * below + upper * (
        (1 - right) * values[np.ix_(above, left % 360)] + right * values[np.ix_(above, beside)]
    )


def monthly_course(sse, merra):
    """Clearness index of each month relative to the year's, the mean of both sources where both
    know: (60, 120, 12).
    """
    course = relative_clearness(
        sse[..., :12].reshape(60, 3, 120, 3, 12).mean(axis=(1, 3)), np.arange(-88.5, 90, 3)
    )
    corners = np.full((61, 120, 12), np.nan)  # of the cells of 3°, where MERRA-2's values stand
    row, column = ((merra["lat"] + 90) / 3).astype(int), ((merra["lon"] + 180) / 3).astype(int)
    corners[np.ix_(row, column)] = relative_clearness(merra["mean"].astype(float), merra["lat"])
    around = np.stack([corners[low : low + 60] for low in (0, 1)])
    around = np.concatenate([around, np.roll(around, -1, axis=2)])
    known = np.isfinite(around)
    other = np.where(known, around, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0), (course + other) / 2, course)


def relative_clearness(mean, latitude):
    """Clearness index of months relative to the year's, 1 in the dark: (rows, columns, 12), of
    means in any unit.
    """
    outside = np.array([extraterrestrial(north) for north in latitude])[:, None, :]  # [Wm⁻²]
    lit = outside > DARK
    annual = (np.where(lit, mean, 0) * DAYS).sum(2) / (np.where(lit, outside, 0) * DAYS).sum(2)
    relative = np.where(lit, mean / np.maximum(outside, DARK), np.nan) / annual[..., None]
    unknown = ~np.isfinite(mean).all(axis=2)
    return np.where(
        unknown[..., None],
        np.nan,
        np.where(np.isfinite(relative), np.clip(relative, 0.1, 3.0), 1.0),
    )


def extraterrestrial(latitude):
    """Monthly mean irradiance on a horizontal plane outside the atmosphere [Wm⁻²]: (12,).

    Of the hours of 2021 in UTC at 0° E, with refraction, as core/weather/climate.py multiplies the
    clearness.
    """
    middle = pd.date_range("2021-01-01T00:30", periods=8760, freq="h", tz="UTC")
    zenith = pvlib.solarposition.get_solarposition(middle, latitude, 0.0)["apparent_zenith"]
    outside = pvlib.irradiance.get_extra_radiation(middle) * np.maximum(
        np.cos(np.radians(zenith)), 0.0
    )
    return outside.groupby(middle.month).mean().to_numpy()


def air_at_sea(table):
    """Air temperature at sea level [°C] and wind speed [ms⁻¹] on 3°, from the nearest coasts: (60,
    120, 2).

    The mean of the eight nearest coastal cells of land, weighted with the inverse square of their
    distance.
    """
    mask, row, column = land_mask(table)
    around = sum(
        np.roll(np.roll(mask, north, 0), east, 1) for north in (-1, 0, 1) for east in (-1, 0, 1)
    )
    coast = table[around[row, column] < 9]
    altitude = [
        pvlib.location.lookup_altitude(*place)
        for place in zip(coast["lat"], coast["lon"], strict=True)
    ]
    values = np.stack(
        [coast[COLUMNS["temp_air"]] + LAPSE * np.array(altitude), coast[COLUMNS["wind_speed"]]],
        axis=-1,
    )
    north, east = np.radians(coast["lat"].to_numpy()), np.radians(coast["lon"].to_numpy())
    found = np.empty((60, 120, 2))
    for place in np.ndindex(60, 120):
        here = np.radians(-88.5 + 3 * place[0]), np.radians(-178.5 + 3 * place[1])
        across = ((east - here[1] + np.pi) % (2 * np.pi) - np.pi) * np.cos(here[0])
        distance = np.hypot(STRETCH * (north - here[0]), across)
        nearest = np.argpartition(distance, COASTS)[:COASTS]
        found[place] = np.average(
            values[nearest], axis=0, weights=1 / np.maximum(distance[nearest], 1e-3) ** 2
        )
    return found


def pack_land(table):
    """Land mask and annual means of the fine grid, as differences from cell to cell."""
    mask, row, column = land_mask(table)
    order = np.lexsort((column, row))
    arrays = {"land": np.packbits(mask)}
    for name, source in COLUMNS.items():
        arrays[name] = split_bytes(
            np.diff(steps_of(table[source].to_numpy()[order], STEPS[name]), prepend=0)
        )
    return arrays


def land_mask(table):
    """Cells of the fine grid on land, (rows, columns) bool, and row and column of each line of the
    table.
    """
    row = ((table["lat"] - SOUTH) / CELL).round().astype(int).to_numpy()
    column = ((table["lon"] - WEST) / CELL).round().astype(int).to_numpy()
    mask = np.zeros(SHAPE, bool)
    mask[row, column] = True
    return mask, row, column


def cell_middles(cell):
    """Latitude and longitude [°] of the middles of all cells of a grid of the globe: two (rows,
    columns).
    """
    return np.meshgrid(
        np.arange(-90 + cell / 2, 90, cell), np.arange(-180 + cell / 2, 180, cell), indexing="ij"
    )


def unit_vectors(latitude, longitude):
    """Places on a sphere of radius 1: (…, 3)."""
    north, east = np.radians(latitude), np.radians(longitude)
    return np.stack(
        [np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)], axis=-1
    )


def steps_of(values, step):
    """Values in whole steps."""
    return np.round(np.asarray(values) / step).astype(np.int32)


def split_bytes(steps):
    """Low and high bytes of numbers below 2¹⁵, which compress better apart: (2, n) uint8."""
    return np.ascontiguousarray(steps, dtype="<i2").reshape(-1, 1).view(np.uint8).T.copy()


if __name__ == "__main__":
    main()
