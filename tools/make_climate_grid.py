"""Make core/weather/climate_grid.npz, the world's climate that ships with the program, from its two sources.

    .venv/bin/python tools/make_climate_grid.py pvcz_land_025deg_annual.csv.gz \
        gsee_merra2_monthly_mean_daily_irradiance_3deg.npz

The sources, both of land: annual means on 0.25° of PVCZ 0.3.0 (MIT licence, T. Karin 2019; from NASA's GLDAS NOAH), and
monthly mean irradiance on 3° of gsee-climate-data 1.0.0 (BSD-3; from NASA's MERRA-2, 2011 to 2015). Of the second only
the course of the year is kept: the clearness index of each month relative to that of the year.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

TARGET = Path(__file__).resolve().parent.parent / "core" / "weather" / "climate_grid.npz"
CELL, SOUTH, WEST, SHAPE = 0.25, -59.875, -179.875, (576, 1440)  # of the fine grid: centre of its first cell [°]
STEPS = {"ghi": 0.005, "temp_air": 0.1, "wind_speed": 0.1}  # kept steps: [kWh/m² per day], [°C], [ms⁻¹]
COLUMNS = {"ghi": "GHI_mean_kWh_m2_day", "temp_air": "T_air_mean_C", "wind_speed": "wind_speed_rms"}
SHARE_STEP = 0.002
DARK = 1.0  # [Wm⁻²] outside the atmosphere; darker months tell nothing of the clearness


def main():
    """Read both sources, write the file, say its size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("annual", type=Path, help="pvcz_land_025deg_annual.csv.gz")
    parser.add_argument("monthly", type=Path, help="gsee_merra2_monthly_mean_daily_irradiance_3deg.npz")
    parser.add_argument("--out", type=Path, default=TARGET)
    options = parser.parse_args()
    arrays = pack_annual(pd.read_csv(options.annual)) | pack_monthly(np.load(options.monthly))
    np.savez_compressed(options.out, **arrays)
    print(f"{options.out}: {options.out.stat().st_size / 1e3:.0f} kB")


def pack_annual(table):
    """Land mask and annual means of the fine grid, as differences from cell to cell in two planes of bytes."""
    row = ((table["lat"] - SOUTH) / CELL).round().astype(int).to_numpy()
    column = ((table["lon"] - WEST) / CELL).round().astype(int).to_numpy()
    order = np.lexsort((column, row))
    mask = np.zeros(SHAPE, bool)
    mask[row, column] = True
    arrays = {"land": np.packbits(mask)}
    for name, source in COLUMNS.items():
        steps = np.round(table[source].to_numpy()[order] / STEPS[name]).astype(np.int32)
        difference = np.diff(steps, prepend=0).astype("<i2")
        arrays[name] = difference.view(np.uint8).reshape(-1, 2).T.copy()
    return arrays


def pack_monthly(source):
    """Clearness index of each month relative to the year's on the coarse grid; sea has that of the nearest land."""
    mean, latitude, longitude = source["mean"].astype(float), source["lat"], source["lon"]
    outside = np.array([extraterrestrial(north) for north in latitude])[:, None, :]  # (rows, 1, 12) [Wm⁻²]
    days = np.array([31, 28.25, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])
    known = np.isfinite(mean).all(axis=2)
    clearness = np.where(outside > DARK, mean / np.maximum(outside, DARK), np.nan)
    annual = (np.where(outside > DARK, mean, 0) * days).sum(2) / (np.where(outside > DARK, outside, 0) * days).sum(2)
    relative = np.where(np.isfinite(clearness), np.clip(clearness / annual[..., None], 0.1, 3.0), 1.0)[known]
    filled = relative[nearest_land(latitude, longitude, known)]
    steps = np.round(filled / SHARE_STEP).astype("<i2")
    axes = np.array([*latitude[:2], *longitude[:2], *steps.shape])
    return {"clearness": steps.view(np.uint8).reshape(-1, 2).T.copy(), "clearness_grid": axes}


def nearest_land(latitude, longitude, known):
    """Index among the known cells of the one nearest to each cell: (rows, columns)."""
    north, east = (np.radians(axis) for axis in np.meshgrid(latitude, longitude, indexing="ij"))
    place = np.stack([np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)], axis=-1)
    return np.array([[(place[known] @ cell).argmax() for cell in row] for row in place])


def extraterrestrial(latitude):
    """Monthly mean irradiance on a horizontal plane outside the atmosphere [Wm⁻²]: (12,).

    Of the hours of 2021 in UTC at 0° E, with refraction, as core/weather/climate.py multiplies the clearness.
    """
    middle = pd.date_range("2021-01-01T00:30", periods=8760, freq="h", tz="UTC")
    zenith = pvlib.solarposition.get_solarposition(middle, latitude, 0.0)["apparent_zenith"]
    outside = pvlib.irradiance.get_extra_radiation(middle) * np.maximum(np.cos(np.radians(zenith)), 0.0)
    return outside.groupby(middle.month).mean().to_numpy()


if __name__ == "__main__":
    main()
