"""Weather of PVGIS (European Commission, Joint Research Centre): typical years and hourly series.

Irradiance comes from one satellite image per hour: the interval is centred on its time, which in
typical years is "Irradiance Time Offset" hours after the stamp (UTC), and in hourly series the
stamp itself.
"""

import io
import json
import re
from pathlib import Path

import pandas as pd
import pvlib

from ..read.open_input import read_text
from ..settings.errors import InputError
from .weather import DAMAGED, Record, coerce_year, read_numbers

COLUMNS = {
    "ghi": "G(h)",
    "dhi": "Gd(h)",
    "dni": "Gb(n)",
    "temp_air": "T2m",
    "wind_speed": "WS10m",
    "pressure": "SP",
}
HALF_HOUR = pd.Timedelta(minutes=30)
TYPICAL_HOURS = 8760
GIVE_PVGIS = (
    "download from PVGIS the typical meteorological year (TMY), or hourly data with slope 0 and "
    "radiation components"
)


def read_pvgis(path):
    """Read a typical meteorological year or an hourly series of PVGIS.

    Parameters
    ----------
    path : path-like
        The file, csv or json; may be gz-compressed.

    Returns
    -------
    Record
    """
    path = Path(path)
    text = read_text(path)
    file_format = "json" if text.lstrip().startswith("{") else "csv"
    if file_format == "csv":
        hourly, typical = "\ntime," in text, "time(UTC)" in text
    else:
        try:
            tree = json.loads(text)
        except json.JSONDecodeError as error:
            raise InputError(
                path, f"line {error.lineno} is not JSON ({error.msg})", GIVE_PVGIS
            ) from error
        outputs = tree.get("outputs", {}) if isinstance(tree, dict) else {}
        hourly, typical = "hourly" in outputs, "tmy_hourly" in outputs
    if not (hourly or typical):
        raise InputError(path, "neither a typical year nor an hourly series of PVGIS", GIVE_PVGIS)
    return (_read_typical if typical else _read_hourly)(path, text, file_format)


def _read_typical(path, text, file_format):
    """Record of a typical year: path, text and format as in `read_pvgis`; files before version 5.3
    have no offset.
    """
    # As csv: head with the place, then rows that begin with a date; a file with more or fewer than
    # the hours of a year is refused.
    if file_format == "csv":
        lines = text.splitlines()
        rows = [line for line in lines if re.match(r"\d{8}:", line)]
        if len(rows) != TYPICAL_HOURS:
            raise InputError(
                path,
                f"{len(rows)} hours instead of {TYPICAL_HOURS}",
                "download the file again; it may be cut",
            )
        fields = dict(
            line.split(":", 1) for line in lines[:12] if ":" in line and not line[0].isdigit()
        )
        place_names = (
            "Latitude (decimal degrees)",
            "Longitude (decimal degrees)",
            "Elevation (m)",
            "Irradiance Time Offset (h)",
        )
        # What the head does not tell is 0.
        place = [fields.get(name, 0.0) for name in place_names]
        header = next(line for line in lines if line.startswith("time(UTC)"))
        with InputError.parsing(path, "cannot be read as pvgis-csv", DAMAGED):
            cells = pd.read_csv(io.StringIO("\n".join([header, *rows])), dtype=str)
    # As JSON: the hours, and the place from its inputs; hours without a time are refused.
    else:
        tree = json.loads(text)
        with InputError.parsing(path, "cannot be read as pvgis-json", DAMAGED):
            cells = pd.DataFrame(tree["outputs"]["tmy_hourly"])
        if "time(UTC)" not in cells:
            raise InputError(path, "its hours have no time(UTC)", GIVE_PVGIS)
        place = place_of_inputs(path, tree.get("inputs"))
    # Columns by our names; stamps and the offset of images give the intervals.
    latitude, longitude, altitude, offset = map(float, place)
    table = pd.DataFrame(
        {ours: read_numbers(path, cells[name]) for ours, name in COLUMNS.items() if name in cells}
    )
    times = pd.to_datetime(cells["time(UTC)"], format="%Y%m%d:%H%M", utc=True)
    data = lay_intervals(table.set_axis(pd.DatetimeIndex(times), axis=0), offset)
    label = f"PVGIS {path.name} (typical year)"
    return Record(data, latitude, longitude, altitude, str(path), label, columns=COLUMNS)


def place_of_inputs(source, inputs):
    """Latitude, longitude [°], elevation [m] and time offset [h] that the inputs of PVGIS' JSON
    name.

    Elevation and offset are 0 where they are not told.

    Raises
    ------
    InputError
        They name no place.
    """
    location = inputs.get("location") if isinstance(inputs, dict) else None
    if not isinstance(location, dict) or not {"latitude", "longitude"} <= set(location):
        raise InputError(
            source, "its inputs have no location with latitude and longitude", GIVE_PVGIS
        )
    values = [
        location.get(name, 0.0)
        for name in ("latitude", "longitude", "elevation", "irradiance_time_offset")
    ]
    for value in values:
        if not isinstance(value, int | float):
            raise InputError(source, f"its location has {value!r} instead of a number", GIVE_PVGIS)
    return values


def lay_intervals(table, offset):
    """Weather of one calendar year, by the start of each interval, from PVGIS' table and its time
    offset [h].
    """
    data = table[[name for name in COLUMNS if name in table]].astype(float)
    data, _ = coerce_year(data)
    data.index = data.index + pd.Timedelta(seconds=round(offset * 3600.0)) - HALF_HOUR
    return data


def _read_hourly(path, text, file_format):
    """Record of an hourly series on the horizontal plane: path, text and format as in
    `read_pvgis`.
    """
    with InputError.parsing(path, f"cannot be read as pvgis-{file_format}", DAMAGED):
        table, meta = pvlib.iotools.read_pvgis_hourly(io.StringIO(text), pvgis_format=file_format)
    # Place, and slope of the plane: from the JSON's inputs or the csv's head.
    if file_format == "json":
        latitude, longitude, altitude, _ = place_of_inputs(path, meta["inputs"])
        slope = meta["inputs"]
        for name in ("mounting_system", "fixed", "slope", "value"):
            slope = slope.get(name) if isinstance(slope, dict) else None
    else:
        latitude, longitude, altitude = (
            float(meta["inputs"][name]) for name in ("latitude", "longitude", "elevation")
        )
        slope = re.search(r"^slope:\s*(-?[\d.]+)", text, re.IGNORECASE | re.MULTILINE)
        slope = slope and float(slope[1])
    # A plane counts as horizontal up to a slope of 0.01°. Other planes are refused, and tables
    # without direct and diffuse radiation, temperature and wind.
    if not isinstance(slope, int | float) or abs(slope) > 0.01:
        raise InputError(path, f"the plane has a slope of {slope}° instead of 0", GIVE_PVGIS)
    if not {"poa_direct", "poa_sky_diffuse"} <= set(table):
        raise InputError(
            path, "direct and diffuse radiation, Gb(i) and Gd(i), are missing", GIVE_PVGIS
        )
    if not {"temp_air", "wind_speed"} <= set(table):
        raise InputError(path, "temperature and wind, T2m and WS10m, are missing", GIVE_PVGIS)
    # On the level plane GHI is beam plus diffuse, and DHI the diffuse part.
    data, columns = convert_hourly(table)
    label = f"PVGIS {path.name} (hourly series)"
    return Record(
        data.astype(float), latitude, longitude, altitude, str(path), label, columns=columns
    )


def convert_hourly(table):
    """Our variables by the start of each interval, and their names, of an hourly series as pvlib
    reads it.
    """
    data = pd.DataFrame(
        {"ghi": table["poa_direct"] + table["poa_sky_diffuse"], "dhi": table["poa_sky_diffuse"]}
    )
    data[["temp_air", "wind_speed"]] = table[["temp_air", "wind_speed"]]
    data.index = pd.DatetimeIndex(table.index).tz_convert("UTC") - HALF_HOUR
    return data, COLUMNS | {"ghi": "Gb(i) + Gd(i)", "dhi": "Gd(i)"}
