"""The built-in climate against stations: signed errors of GHI, DNI, temperature and full load hours
of four walls.

    python benchmarks/climate.py WEATHER

WEATHER is a folder with the stations' files: *.epw and *.epw.gz of any subfolder, tmy3*.csv, PVGIS'
json, potsdam_dwd/*.txt.gz (hourly values of Deutscher Wetterdienst, averaged over its years) and
nsrdb_15min/*.csv.gz. Two tables: the built-in climate as it is, and the same with the station's own
months of GHI, which leaves what the synthesis does. The walls are unshaded, before ground of albedo
0.25 under an isotropic sky, with the Sandia model on an open rack.
"""

import argparse
import gzip
import io
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from citypv.core.energy.pv_system import pick_module
from citypv.core.sun.solar_position import solar_position
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.climate import cleanest_sky, climate, draw_irradiance, look_up_altitude
from citypv.core.weather.read_epw import read_epw
from citypv.core.weather.read_pvgis import read_pvgis
from citypv.core.weather.read_station_files import read_tmy3
from citypv.core.weather.weather import Record

HOUR = pd.Timedelta(hours=1)
WALLS = {"N": 0.0, "E": 90.0, "S": 180.0, "W": 270.0}
TITLES = ["GHI %", "DNI %", "T K", *(f"{wall} %" for wall in WALLS)]
MODULE = "SunPower_SPR_300_WHT__2007__E__"
DISAGREEMENT = 2.0  # [Wm⁻²], mean of |GHI - DHI - DNI·cos θ|, beyond which a station is marked


def main():
    """Print both tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weather", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for title, own in (("Built-in climate", False), ("With the station's months of GHI", True)):
        titles = [*TITLES, "DNI % of DISC on its own hours"] if own else TITLES
        print(
            f"\n{title}\n\n| station | GHI | "
            + " | ".join(titles)
            + " |\n|---|--:|"
            + "--:|" * len(titles)
        )
        errors, sound = [], []
        for name, years in read_stations(options.weather):
            errors.append(compare(years, own, options.seed))
            sound.append(max(disagreement(year) for year in years) <= DISAGREEMENT)
            ghi = np.mean([figures(year)[0] for year in years])
            split = f" {np.mean([split_error(year) for year in years]):+.1f} |" if own else ""
            print(
                row(name + ("" if sound[-1] else " *"), f"{ghi:,.0f}", errors[-1]) + split,
                flush=True,
            )
        for words, chosen in (("all", np.array(errors)), ("without *", np.array(errors)[sound])):
            print(row(f"mean, {words}", "", chosen.mean(axis=0)))
            print(row(f"root mean square, {words}", "", np.sqrt((chosen**2).mean(axis=0)), sign=""))


def split_error(year):
    """Error of DNI [%] where DISC splits the file's own GHI, hour by hour."""
    data = year.data.resample("h", origin=year.data.index[0]).mean()
    zenith = solar_position(data.index, HOUR, year.latitude, year.longitude)["apparent_zenith"]
    dni = pvlib.irradiance.disc(data["ghi"], zenith, data.index, pressure=data["pressure"])["dni"]
    return 100 * (dni.fillna(0.0).sum() / data["dni"].sum() - 1)


def disagreement(year):
    """How far a file's own GHI, DHI and DNI are apart [Wm⁻²]."""
    data = year.data
    horizontal = data["dni"] * np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0.0)
    return (data["ghi"] - data["dhi"] - horizontal).abs().mean()


def row(name, ghi, values, sign="+"):
    """One line of a table."""
    return f"| {name} | {ghi} | " + " | ".join(f"{value:{sign}.1f}" for value in values) + " |"


def read_stations(folder):
    """Name and years of Weather of each station, without the checks of the program's door: faults
    are the point.
    """
    for path in sorted(folder.glob("**/*.epw*")):
        if "pvgis" not in path.name:
            yield path.name.split(".epw")[0], [add_sun(read_epw(path), HOUR)]
    for path in sorted(folder.glob("pvgis*.json")):
        yield "PVGIS 45° N, 8° E", [add_sun(read_pvgis(path, "json"), HOUR)]
    for path in sorted(folder.glob("tmy3*.csv*")):
        yield path.name.split(".csv")[0], [add_sun(read_tmy3(path), HOUR)]
    potsdam = sorted(folder.glob("potsdam_dwd/*_201[3-8]_*.txt.gz"))
    if potsdam:
        yield "Potsdam 2013–2018", [read_potsdam(path) for path in potsdam]
    for path in sorted(folder.glob("nsrdb_15min/*.csv.gz")):
        yield "NSRDB " + " ".join(path.name.split("_")[1:3]) + " 2019", [read_nsrdb(path)]


def read_potsdam(path):
    """One year of Potsdam: direct and diffuse horizontal irradiance, stamps end the hour
    in UTC+1.
    """
    with gzip.open(path, "rt", errors="replace") as file:
        lines = file.read().splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("double")) + 1
    table = np.array([line.split() for line in lines[start:] if line.strip()], float)
    year = int(path.name.split("_")[2])
    times = pd.date_range(
        f"{year}-01-01", f"{year + 1}-01-01", freq="h", inclusive="left", tz="Etc/GMT-1"
    )
    hours = np.arange(1, len(times) + 1)  # the year's last hour may be missing
    pressure, temp_air, direct, diffuse, wind = (
        np.interp(hours, table[:, 0], table[:, k]) for k in (1, 2, 4, 5, 7)
    )
    data = {
        "ghi": direct + diffuse,
        "dhi": diffuse,
        "temp_air": temp_air,
        "wind_speed": wind,
        "pressure": 100 * pressure,
    }
    return add_sun(
        Record(
            pd.DataFrame(data, index=times.tz_convert("UTC")), 52.38, 13.06, 81.0, str(path), ""
        ),
        HOUR,
    )


def read_nsrdb(path):
    """One year of NSRDB in steps of 15 minutes, whose stamps are their middle."""
    with gzip.open(path, "rt") as file:
        lines = file.read().splitlines()
    place = dict(zip(lines[0].split(","), lines[1].split(","), strict=False))
    table = pd.read_csv(io.StringIO("\n".join(lines[2:])))
    times = pd.DatetimeIndex(
        pd.to_datetime(table[["Year", "Month", "Day", "Hour", "Minute"]]), tz="UTC"
    )
    names = {
        "GHI": "ghi",
        "DHI": "dhi",
        "DNI": "dni",
        "Temperature": "temp_air",
        "Wind Speed": "wind_speed",
    }
    data = (
        table[list(names)]
        .rename(columns=names)
        .astype(float)
        .assign(pressure=100.0 * table["Pressure"].to_numpy())
    )
    data.index = times - pd.Timedelta(minutes=7.5)
    latitude, longitude, altitude = (
        float(place[key]) for key in ("Latitude", "Longitude", "Elevation")
    )
    return add_sun(
        Record(data, latitude, longitude, altitude, str(path), ""), pd.Timedelta(minutes=15)
    )


def compare(years, own, seed):
    """Errors of the climate at a station: GHI, DNI [%], GHI-weighted temperature [K], walls [%]:
    (7,).
    """
    station = np.mean([figures(year) for year in years], axis=0)
    climate = figures(synthesise(years, own, seed))
    error = 100 * (climate / station - 1)
    error[2] = climate[2] - station[2]
    return error


def synthesise(years, own, seed):
    """Weather of the built-in climate at a station, with its own months where asked for."""
    place = years[0].latitude, years[0].longitude
    data = climate(*place, 2021, seed).data
    times = data.index
    if own:
        monthly = np.mean([monthly_ghi(year) for year in years], axis=0)[None]
        sky = cleanest_sky(
            [place],
            times,
            np.array([[look_up_altitude(*place)]]),
            monthly.sum(axis=1, keepdims=True),
        )
        drawn = draw_irradiance([place], times, sky, monthly, seed)
        data[["ghi", "dhi", "dni"]] = np.concatenate(drawn).T
    sun = solar_position(times, HOUR, *place)
    return years[0].__class__(data.join(sun), HOUR, *place, years[0].altitude, "climate")


def monthly_ghi(year):
    """Sum of each month [Wh/m²], of a year of 365 days: (12,)."""
    hours = year.interval / HOUR
    days = np.bincount(year.data.index.month)[1:] * hours / 24
    return (
        np.bincount(year.data.index.month, year.data["ghi"] * hours)[1:]
        / days
        * np.array([31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])
    )


def figures(year):
    """GHI, DNI [kWh/m²], GHI-weighted temperature [°C], full load hours of four walls [h], of 365
    days: (7,).
    """
    data, hours = year.data, year.interval / HOUR
    whole = 8760 / (len(data) * hours)
    sums = (data["ghi"].sum() * hours / 1000 * whole, data["dni"].sum() * hours / 1000 * whole)
    return np.array(
        [
            *sums,
            np.average(data["temp_air"], weights=data["ghi"]),
            *full_load_hours(data) * hours * whole,
        ]
    )


def full_load_hours(data):
    """Sum of P/P_nominal over all intervals, of the four walls: (4,)."""
    module = pick_module(MODULE).parameters
    zenith, azimuth = data["apparent_zenith"], data["solar_azimuth"]
    airmass = pvlib.atmosphere.get_absolute_airmass(
        pvlib.atmosphere.get_relative_airmass(zenith), data["pressure"]
    )
    spectral = pvlib.spectrum.spectral_factor_sapm(np.minimum(airmass, 10.0), module).fillna(0.0)
    rack = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["sapm"]["open_rack_glass_polymer"]
    hours = []
    for facing in WALLS.values():
        aoi = pvlib.irradiance.aoi(90, facing, zenith, azimuth)
        direct = data["dni"] * np.maximum(np.cos(np.radians(aoi)), 0.0)
        diffuse = 0.5 * data["dhi"] + 0.25 * 0.5 * data["ghi"]
        effective = spectral * (direct * pvlib.iam.sapm(aoi, module, upper=1) + diffuse)
        cell = pvlib.temperature.sapm_cell(
            direct + diffuse, data["temp_air"], data["wind_speed"], **rack
        )
        hours.append(
            pvlib.pvsystem.sapm(effective, cell, module)["p_mp"].sum()
            / (module["Impo"] * module["Vmpo"])
        )
    return np.array(hours)


if __name__ == "__main__":
    main()
