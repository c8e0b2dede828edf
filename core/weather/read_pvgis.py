"""Files of PVGIS (European Commission, Joint Research Centre): typical meteorological years and hourly series."""

import io
import json
import re
from pathlib import Path

import pandas as pd
import pvlib

from ..files.open_input import open_text
from ..settings.errors import InputError
from .record import Record
from .typical_year import coerce_year

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
HALF_HOUR = pd.Timedelta(minutes=30)
LEVEL = 0.01  # [°] slope up to which a plane counts as horizontal
TYPICAL_HOURS = 8760
NUMBER = r"\s*(?:[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?|nan|NaN)\s*"
AGAIN = "download the file again; it may be cut"
CURE = "download from PVGIS the typical meteorological year (TMY), or hourly data with slope 0 and radiation components"


def read_pvgis(path, file_format):
    """Read a typical meteorological year or an hourly series of PVGIS.

    Irradiance is that of one satellite image per hour: the interval is centred on its time, which in typical years is
    "Irradiance Time Offset" hours after the stamp (UTC), and in hourly series the stamp itself.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.
    file_format : {"csv", "json"}
        How it is written.

    Returns
    -------
    Record
    """
    path = Path(path)
    with open_text(path) as file:
        text = file.read()
    if file_format == "csv":
        hourly, typical = "\ntime," in text, "time(UTC)" in text
    else:
        outputs = parse_json(path, text).get("outputs", {})
        hourly, typical = "hourly" in outputs, "tmy_hourly" in outputs
    if not (hourly or typical):
        raise InputError(path, "neither a typical year nor an hourly series of PVGIS", CURE)
    return (read_typical if typical else read_hourly)(path, text, file_format)


def parse_json(path, text):
    """Tree of a json file."""
    try:
        tree = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(path, f"line {error.lineno} is not JSON ({error.msg})", CURE) from error
    return tree if isinstance(tree, dict) else {}


def read_typical(path, text, file_format):
    """Record of a typical year: path, text and format as in `read_pvgis`."""
    if file_format == "csv":
        check_rows(path, text)
    source = io.StringIO(text) if file_format == "json" else io.BytesIO(text.encode())
    table, _ = pvlib.iotools.read_pvgis_tmy(source, pvgis_format=file_format)
    latitude, longitude, altitude, offset = read_place(text, file_format)
    data = lay_intervals(table, offset)
    return Record(data, latitude, longitude, altitude, str(path), f"PVGIS {path.name} (typical year)")


def check_rows(path, text):
    """Refuse a typical year in csv with rows that are missing, cut or not of numbers.

    Parameters
    ----------
    path : pathlib.Path
        The file, for messages.
    text : str
        The whole file.
    """
    lines = text.splitlines()
    names = next(line for line in lines if line.startswith("time(UTC)")).split(",")
    rows = [line for line in lines if re.match(r"\d{8}:", line)]
    for number, row in enumerate(rows, 1):
        fields = row.split(",")
        if len(fields) != len(names) or not all(re.fullmatch(NUMBER, field) for field in fields[1:]):
            raise InputError(path, f"row {number} ({row[:40]}) is not {len(names)} fields of numbers", AGAIN)
    if len(rows) != TYPICAL_HOURS:
        raise InputError(path, f"{len(rows)} hours instead of {TYPICAL_HOURS}", AGAIN)


def lay_intervals(table, offset):
    """Weather of one calendar year, by the start of each interval, from PVGIS' table and its time offset [h]."""
    data = table[[name for name in NAMES if name in table]].astype(float)
    times = pd.DatetimeIndex(data.index)
    data.index = times.tz_localize("UTC") if times.tz is None else times.tz_convert("UTC")
    data, _ = coerce_year(data)
    data.index = data.index + pd.Timedelta(seconds=round(offset * 3600.0)) - HALF_HOUR
    return data


def read_place(text, file_format):
    """Latitude [°], longitude [°], altitude [m] and time offset [h] of a typical year.

    Parameters
    ----------
    text : str
        The whole file.
    file_format : {"csv", "json"}
        How it is written.

    Returns
    -------
    tuple of float
        The offset is 0 in files of PVGIS before version 5.3, which have none.
    """
    if file_format == "json":
        place = json.loads(text)["inputs"]["location"]
        return tuple(
            float(place.get(key, 0.0)) for key in ("latitude", "longitude", "elevation", "irradiance_time_offset")
        )
    fields = dict(line.split(":", 1) for line in text.splitlines()[:12] if ":" in line and not line[0].isdigit())
    names = ("Latitude (decimal degrees)", "Longitude (decimal degrees)", "Elevation (m)", "Irradiance Time Offset (h)")
    return tuple(float(fields.get(name, 0.0)) for name in names)


def read_hourly(path, text, file_format):
    """Record of an hourly series on the horizontal plane: path, text and format as in `read_pvgis`."""
    table, meta = pvlib.iotools.read_pvgis_hourly(io.StringIO(text), pvgis_format=file_format)
    if file_format == "json":
        place = meta["inputs"]["location"]
        slope = meta["inputs"].get("mounting_system", {}).get("fixed", {}).get("slope", {}).get("value")
    else:
        place = meta["inputs"]
        slope = re.search(r"^slope:\s*(-?[\d.]+)", text, re.IGNORECASE | re.MULTILINE)
        slope = slope and float(slope[1])
    if slope is None or abs(float(slope)) > LEVEL:
        raise InputError(path, f"the plane has a slope of {slope}° instead of 0", CURE)
    if not {"poa_direct", "poa_sky_diffuse"} <= set(table):
        raise InputError(path, "direct and diffuse radiation, Gb(i) and Gd(i), are missing", CURE)
    data = pd.DataFrame({"ghi": table["poa_direct"] + table["poa_sky_diffuse"], "dhi": table["poa_sky_diffuse"]})
    data[["temp_air", "wind_speed"]] = table[["temp_air", "wind_speed"]]
    data.index = pd.DatetimeIndex(table.index).tz_convert("UTC") - HALF_HOUR
    latitude, longitude, altitude = (float(place[name]) for name in ("latitude", "longitude", "elevation"))
    return Record(data.astype(float), latitude, longitude, altitude, str(path), f"PVGIS {path.name} (hourly series)")
