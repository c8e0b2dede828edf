"""Typical meteorological years of PVGIS (European Commission, Joint Research Centre)."""

import io
import json
from pathlib import Path

import pandas as pd
import pvlib

from ..errors import InputError
from .open_text import open_text
from .record import Record
from .typical_year import coerce_year

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
CURE = "download the typical meteorological year (TMY) of PVGIS as csv or json"


def read_pvgis(path, file_format):
    """Read a PVGIS typical meteorological year.

    Its irradiance is that of one satellite image per hour, taken "Irradiance Time Offset" hours after the stamp (UTC):
    the interval is laid around that moment, so that its middle is the image's time.

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
    table, meta = parse_pvgis(path, text, file_format)
    latitude, longitude, altitude, offset = read_place(meta, text, file_format)
    data = lay_intervals(table, offset)
    return Record(data, latitude, longitude, altitude, str(path), f"PVGIS {path.name} (typical year)")


def lay_intervals(table, offset):
    """Weather of one calendar year, by the start of each interval, from PVGIS' table and its time offset [h]."""
    data = table[[name for name in NAMES if name in table]].astype(float)
    times = pd.DatetimeIndex(data.index)
    data.index = times.tz_localize("UTC") if times.tz is None else times.tz_convert("UTC")
    data, _ = coerce_year(data)
    data.index = data.index + pd.Timedelta(seconds=round(offset * 3600.0)) - pd.Timedelta(minutes=30)
    return data


def parse_pvgis(path, text, file_format):
    """Table and header of a PVGIS file, by pvlib; other PVGIS products are refused."""
    if file_format == "json":
        try:
            tree = json.loads(text)
        except json.JSONDecodeError as error:
            raise InputError(path, f"line {error.lineno} is no json ({error.msg})", CURE) from error
        if "tmy_hourly" not in tree.get("outputs", {}):
            raise InputError(path, "no PVGIS typical year (outputs.tmy_hourly) in this json", CURE)
        return pvlib.iotools.read_pvgis_tmy(io.StringIO(text), pvgis_format="json")
    if "time(UTC)" not in text:
        raise InputError(path, "no PVGIS typical year (column time(UTC)) in this csv", CURE)
    return pvlib.iotools.read_pvgis_tmy(io.BytesIO(text.encode()), pvgis_format="csv")


def read_place(meta, text, file_format):
    """Latitude [°], longitude [°], altitude [m] and time offset [h] of a PVGIS file.

    Parameters
    ----------
    meta : dict
        What pvlib read from the header.
    text : str
        The whole file.
    file_format : {"csv", "json"}
        How it is written.

    Returns
    -------
    tuple of float
        Files of PVGIS before version 5.3 name no offset: there it is 0.
    """
    if file_format == "json":
        place = json.loads(text)["inputs"]["location"]
        return tuple(
            float(place.get(key, 0.0)) for key in ("latitude", "longitude", "elevation", "irradiance_time_offset")
        )
    fields = dict(line.split(":", 1) for line in text.splitlines()[:12] if ":" in line and not line[0].isdigit())
    names = ("Latitude (decimal degrees)", "Longitude (decimal degrees)", "Elevation (m)", "Irradiance Time Offset (h)")
    return tuple(float(fields.get(name, 0.0)) for name in names)
