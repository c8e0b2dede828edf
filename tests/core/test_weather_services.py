"""Formats of services, told by their marks: the same year as each of them writes it gives the same
intervals.

The year is ERA5's of Berlin. The layouts are those of the services' documentation.
"""

import json

import numpy as np
import pandas as pd
import pytest
from thorough import mark_cases
from weathers import BERLIN, ERA5, HOUR, refuse, save_era5, write_lines

from citypv.core.weather.formats import read_as, recognise_weather
from citypv.core.weather.read_era5 import read_era5
from citypv.core.weather.read_weather import read_weather

PLACE = (*BERLIN, 34.0)
MAIN = ["ghi", "dhi", "dni"]


@pytest.fixture(scope="module")
def year():
    """Weather of Berlin, by the start of each hour."""
    return read_weather(ERA5, *BERLIN)


def read_record(path):
    """What the reader of a file's format makes of it, unchecked."""
    return read_as(recognise_weather(path), path, own=PLACE, place=None)


def assert_as(path, year, columns=(*MAIN, "temp_air", "wind_speed"), atol=0.06):
    """The file says the same of the same intervals as the year; at the same place."""
    record = read_record(path)
    assert (record.data.index == year.data.index).all()
    for name in columns:
        np.testing.assert_allclose(record.data[name], year.data[name], atol=atol, err_msg=name)
    assert (record.latitude, record.longitude) == pytest.approx(BERLIN, abs=0.01)
    return record


def open_meteo(year, zone=0, wind="km/h", temperature="°C"):
    """Names, units and columns of an answer of Open-Meteo, with times in a zone [h]; radiation ends
    at the stamp.
    """
    data, stamps = year.data, year.data.index + HOUR + pd.Timedelta(hours=zone)
    factor = {"km/h": 3.6, "m/s": 1, "mp/h": 1 / 0.44704, "kn": 1 / 0.514444}[wind]
    columns = {
        "time": list(stamps.strftime("%Y-%m-%dT%H:%M")),
        "temperature_2m": list(
            data["temp_air"] * (1.8 if temperature == "°F" else 1) + 32 * (temperature == "°F")
        ),
        "wind_speed_10m": list(data["wind_speed"] * factor),
        "shortwave_radiation": list(data["ghi"]),
        "direct_normal_irradiance": list(data["dni"]),
        "diffuse_radiation": list(data["dhi"]),
    }
    units = dict.fromkeys(columns, "W/m²") | {
        "time": "iso8601",
        "temperature_2m": temperature,
        "wind_speed_10m": wind,
    }
    head = {
        "latitude": BERLIN[0],
        "longitude": BERLIN[1],
        "elevation": 34.0,
        "utc_offset_seconds": 3600 * zone,
    }
    return head | {"timezone": "GMT", "timezone_abbreviation": "GMT"}, units, columns


def write_open_meteo(path, head, units, columns):
    """The same as its csv."""
    lines = [",".join(head), ",".join(map(str, head.values())), ""]
    lines += [",".join("time" if name == "time" else f"{name} ({units[name]})" for name in columns)]
    return write_lines(
        path, lines + [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    )


@pytest.mark.parametrize(
    ("zone", "wind", "temperature"),
    mark_cases([(0, "km/h", "°C"), (1, "m/s", "°F"), (-5, "mp/h", "°C")], kept=1),
)
def test_open_meteo_as_csv_and_json(tmp_path, year, zone, wind, temperature):
    head, units, columns = open_meteo(year, zone, wind, temperature)
    record = assert_as(write_open_meteo(tmp_path / "a.csv", head, units, columns), year)
    assert record.altitude == 34.0
    tree = {**head, "hourly_units": units, "hourly": columns}
    (tmp_path / "a.json").write_text(json.dumps(tree))
    assert_as(tmp_path / "a.json", year)


def test_open_meteo_in_seconds_since_1970_and_units_it_does_not_tell(tmp_path, year):
    head, _, columns = open_meteo(year, zone=2)
    columns["time"] = [int(stamp.timestamp()) for stamp in year.data.index + HOUR]  # always UTC
    head["utc_offset_seconds"] = 0
    (tmp_path / "a.json").write_text(json.dumps({**head, "hourly": columns}))
    assert_as(tmp_path / "a.json", year)
    path = write_open_meteo(tmp_path / "a.csv", head, dict.fromkeys(columns, ""), columns)
    path.write_text(path.read_text().replace(" ()", ""))
    assert_as(path, year)


def test_open_meteo_that_cannot_be_used(tmp_path, year):
    head, units, columns = open_meteo(year)
    path = tmp_path / "a.json"

    def write(**changes):
        path.write_text(json.dumps({**head, "hourly_units": units, "hourly": columns, **changes}))
        return path

    refuse(
        write(hourly_units=units | {"wind_speed_10m": "furlong"}),
        "wind_speed_10m is in 'furlong'",
        "m/s",
    )
    refuse(write(hourly=columns | {"time": columns["time"][:-1]}), "different lengths")
    refuse(
        write(hourly={"time": columns["time"], "rain": columns["time"]}),
        "no column of weather",
        "shortwave",
    )
    refuse(
        write(hourly=columns | {"time": ["noon", *columns["time"][1:]]}),
        "'noon' (row 1) is not a time",
    )
    path.write_text(write().read_text()[:-400])
    refuse(path, "is not JSON", "cut")
    path.write_text(json.dumps([{**head, "hourly": columns}] * 2))
    refuse(path, "2 places")


def power_lines(year, zone="UTC", energy="Wh/m^2"):
    """Lines of NASA POWER's csv; its stamps begin the hour."""
    lines = ["-BEGIN HEADER-", "NASA/POWER Source Native Resolution Hourly Data "]
    lines += [f"Dates (month/day/year): 01/01/2017 through 12/31/2017 in {zone}"]
    lines += [f"Location: latitude  {BERLIN[0]}   longitude {BERLIN[1]} "]
    lines += ["elevation from MERRA-2: Average for 0.5 x 0.625 degree lat/lon region = 34.0 meters"]
    lines += [
        "The value for missing source data that cannot be computed is -999 ",
        "parameter(s): ",
    ]
    names = ["ALLSKY_SFC_SW_DWN", "ALLSKY_SFC_SW_DIFF", "ALLSKY_SFC_SW_DNI"]
    lines += [f"{name}     CERES SYN1deg All Sky ({energy}) " for name in names]
    lines += [
        "T2M      MERRA-2 Temperature at 2 Meters (C) ",
        "WS10M     MERRA-2 Wind Speed at 10 Meters (m/s) ",
    ]
    lines += [
        "PS     MERRA-2 Surface Pressure (kPa) ",
        "-END HEADER-",
        ",".join(["YEAR,MO,DY,HR", *names, "T2M,WS10M,PS"]),
    ]
    factor = 3600 / 1e6 if energy == "MJ/hr" else 1
    local = year.data.index + pd.Timedelta(hours=round(BERLIN[1] / 15) if zone == "LST" else 0)
    for time, row in zip(local, year.data.itertuples(), strict=True):
        values = [
            factor * row.ghi,
            factor * row.dhi,
            factor * row.dni,
            row.temp_air,
            row.wind_speed,
            100.1,
        ]
        lines.append(",".join(map(str, [time.year, time.month, time.day, time.hour, *values])))
    return lines


@pytest.mark.parametrize(("zone", "energy"), [("UTC", "Wh/m^2"), ("LST", "MJ/hr")])
def test_nasa_power_as_csv(tmp_path, year, zone, energy):
    lines = power_lines(year, zone, energy)
    record = assert_as(write_lines(tmp_path / "POWER.csv", lines), year)
    assert record.data["pressure"].iloc[0] == pytest.approx(100_100)
    fields = lines[-5000].split(",")
    fields[4] = "-999"
    lines[-5000] = ",".join(fields)
    gap = read_record(write_lines(tmp_path / "gap.csv", lines))
    assert gap.data["ghi"].isna().sum() == 1
    refuse(write_lines(tmp_path / "gap.csv", lines), "ALLSKY_SFC_SW_DWN is missing")


def test_solcast_names_old_and_new(tmp_path, year):
    stamps = (year.data.index + HOUR).strftime("%Y-%m-%dT%H:%M:%SZ")
    table = year.data[["temp_air", "dhi", "dni", "ghi", "wind_speed"]].assign(
        period_end=stamps, period="PT60M"
    )
    new = ["air_temp", "dhi", "dni", "ghi", "wind_speed_10m", "period_end", "period"]
    table.set_axis(new, axis=1).to_csv(tmp_path / "new.csv", index=False)
    assert_as(tmp_path / "new.csv", year)
    old = ["AirTemp", "Dhi", "Dni", "Ghi", "WindSpeed10m", "PeriodEnd", "Period"]
    begins = year.data.index.strftime("%Y-%m-%dT%H:%M:%SZ")
    table.set_axis(old, axis=1).assign(PeriodStart=begins).to_csv(tmp_path / "old.csv", index=False)
    assert_as(tmp_path / "old.csv", year)
    assert read_record(tmp_path / "old.csv").altitude == PLACE[2]
    table.set_axis(new, axis=1).assign(period_end=stamps.str[:-1]).to_csv(
        tmp_path / "bare.csv", index=False
    )
    refuse(tmp_path / "bare.csv", "no time zone", "UTC")


def cams_lines(year, reference="Universal time (UT)"):
    """Lines of the CAMS radiation service; [Wh/m²] of quarters of an hour, each as bright as its
    hour.
    """
    lines = [
        "# Coding: utf-8",
        "# File format version: 2",
        "# Title: CAMS Radiation Service v4.5 all-sky irradiation",
    ]
    lines += [
        f"# Latitude (positive North, ISO 19115): {BERLIN[0]}",
        f"# Longitude (positive East, ISO 19115): {BERLIN[1]}",
    ]
    lines += ["# Altitude (m): 34.00", f"# Time reference: {reference}"]
    lines += ["# Summarization (integration) period: 0 year 0 month 0 day 0 h 15 min 0 s", "#"]
    lines += ["# Observation period;TOA;Clear sky GHI;GHI;BHI;DHI;BNI;Reliability"]
    for start, row in zip(year.data.index, year.data.itertuples(), strict=True):
        for quarter in range(4):
            ends = [start + pd.Timedelta(minutes=15 * (quarter + k)) for k in (0, 1)]
            period = "/".join(f"{end:%Y-%m-%dT%H:%M:%S}.0" for end in ends)
            lines.append(
                f"{period};0;0;{row.ghi / 4};{(row.ghi - row.dhi) / 4};{row.dhi / 4};{row.dni / 4};1.0"
            )
    return lines


@pytest.mark.slow
def test_cams_has_neither_temperature_nor_wind(tmp_path, year):
    record = read_record(write_lines(tmp_path / "cams.csv", cams_lines(year)))
    assert set(record.data) == set(MAIN)
    assert record.data.index[1] - record.data.index[0] == HOUR / 4
    hourly = record.data.to_numpy().reshape(-1, 4, 3).mean(axis=1)
    np.testing.assert_allclose(hourly, year.data[MAIN], atol=0.06)
    path = write_lines(tmp_path / "tst.csv", cams_lines(year, "True solar time (TST)")[:300])
    refuse(path, "true solar time", "universal time")


def point_table(year):
    """A point series of the Climate Data Store: sums of the hour that ends at the stamp."""
    data, stamps = year.data, (year.data.index + HOUR).strftime("%Y-%m-%d %H:%M:%S")
    columns = {
        "valid_time": stamps,
        "ssrd": 3600 * data["ghi"],
        "fdir": 3600 * (data["ghi"] - data["dhi"]),
    }
    columns |= {
        "t2m": data["temp_air"] + 273.15,
        "u10": 0.6 * data["wind_speed"],
        "v10": -0.8 * data["wind_speed"],
    }
    return pd.DataFrame(columns | {"latitude": BERLIN[0], "longitude": BERLIN[1]})


def test_point_series_as_csv_and_zip(tmp_path, year):
    table, zipped = point_table(year), tmp_path / "points.zip"
    table.to_csv(tmp_path / "points.csv", index=False)
    assert_as(tmp_path / "points.csv", year, ("ghi", "dhi", "temp_air", "wind_speed"))
    table.to_csv(zipped, index=False, compression={"method": "zip", "archive_name": "points.csv"})
    assert_as(zipped, year, ("ghi", "dhi", "temp_air", "wind_speed"))
    table.drop(columns="fdir").to_csv(tmp_path / "land.csv", index=False)
    assert set(read_record(tmp_path / "land.csv").data) == {"ghi", "temp_air", "wind_speed"}


def test_sums_since_midnight_of_era5_land(tmp_path, year):
    def add_up(dataset):
        days = (dataset["time"] - np.timedelta64(1, "h")).dt.floor("D")
        summed = dataset["ssrd"].groupby(days.rename("day")).cumsum()
        return dataset.drop_vars("fdir").assign(ssrd=summed.assign_attrs(dataset["ssrd"].attrs))

    path = save_era5(tmp_path / "land.nc", add_up)
    record = read_era5(path, *PLACE, "nearest")
    assert "ERA5-Land" in record.label and record.notes == [
        "radiation of each hour from sums since 0 UTC"
    ]
    np.testing.assert_allclose(record.data["ghi"].clip(lower=0), year.data["ghi"], atol=0.3)
    assert not any("sums" in note for note in read_era5(ERA5, *PLACE, "nearest").notes)
