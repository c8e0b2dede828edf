"""Hourly weather as services send it: Open-Meteo, NASA POWER, Solcast, CAMS and point series of the
Climate Data Store.

Each reader takes the path of a file, which may be gz-compressed, and returns a Record with what the
file has: some have neither temperature nor wind, or global irradiance only.
"""

import csv
import io
import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from ..read.open_input import open_zip, read_text
from ..settings.errors import InputError, first_true
from .weather import DAMAGED, Record, read_numbers

# Our variable -> names that a service gives it, the first one that is there counts.
OPEN_METEO = {
    "ghi": ("shortwave_radiation",),
    "dhi": ("diffuse_radiation",),
    "dni": ("direct_normal_irradiance",),
    "temp_air": ("temperature_2m",),
    "wind_speed": ("wind_speed_10m", "windspeed_10m"),
    "pressure": ("surface_pressure",),
}
POWER = {
    "ghi": ("ALLSKY_SFC_SW_DWN",),
    "dhi": ("ALLSKY_SFC_SW_DIFF",),
    "dni": ("ALLSKY_SFC_SW_DNI",),
    "temp_air": ("T2M",),
    "wind_speed": ("WS10M", "WS2M"),
    "pressure": ("PS",),
}
SOLCAST = {name: (name,) for name in ("ghi", "dhi", "dni")}
SOLCAST |= {
    "temp_air": ("airtemp",),
    "wind_speed": ("windspeed10m",),
    "pressure": ("surfacepressure",),
}

# Unit as services write it -> factor and offset to ours.
UNITS = {
    "irradiance": {"W/m²": (1, 0), "W/m^2": (1, 0), "Wh/m^2": (1, 0), "MJ/hr": (1e6 / 3600, 0)},
    "temp_air": {"°C": (1, 0), "C": (1, 0), "°F": (1 / 1.8, -32 / 1.8), "K": (1, -273.15)},
    "wind_speed": {
        "m/s": (1, 0),
        "km/h": (1 / 3.6, 0),
        "mp/h": (0.44704, 0),
        "mph": (0.44704, 0),
        "kn": (0.514444, 0),
    },
    "pressure": {"Pa": (1, 0), "hPa": (100, 0), "kPa": (1000, 0)},
}
AGAIN = "download it again"


def read_open_meteo(path, lies):
    """Read csv or json of Open-Meteo, hourly or by quarters of an hour.

    Radiation is the mean of the interval that ends at the stamp; temperature and wind hold for the
    stamp. Times are in a zone of a fixed offset that the file gives, also where that place has
    summer time.
    """
    path = Path(path)
    data, columns, head = parse_open_meteo(path, read_text(path), lies)
    place = (head[name] for name in ("latitude", "longitude", "elevation"))
    return Record(data, *place, str(path), f"Open-Meteo {path.name}", columns=columns)


def parse_open_meteo(path, text, lies="ends"):
    """Our variables by the start of each interval, what the answer calls them, and its head, of a
    text.
    """
    is_json = text.lstrip()[:1] in ("{", "[")
    head, table, units = (_parse_open_meteo_json if is_json else _parse_open_meteo_csv)(path, text)
    for name in ("latitude", "longitude", "elevation", "utc_offset_seconds"):
        with InputError.parsing(path, f"its {name} is no number", AGAIN):
            head[name] = float(head[name])
    if "time" not in table:
        raise InputError(path, "has no times", AGAIN)
    data, columns = _take_columns(path, table, OPEN_METEO, units)
    data.index = _parse_times(path, table["time"], pd.Timedelta(seconds=head["utc_offset_seconds"]))
    return _lay_intervals(data, lies), columns, head


def parse_power(path, table, units):
    """Our variables and their names of a table of NASA POWER, by the start of each hour, UTC."""
    data, columns = _take_columns(path, table, POWER, {"pressure": "kPa"} | units, missing=-900.0)
    return data.set_axis(pd.DatetimeIndex(table.index), axis=0), columns


def read_nasa_power(path, lies):
    """Read hourly csv or json of NASA POWER: UTC, or local solar time, which is whole hours by the
    longitude.
    """
    path = Path(path)
    text = read_text(path)
    parse = _parse_power_json if text.lstrip().startswith("{") else _parse_power_csv
    (latitude, longitude, altitude), zone, table, units = parse(path, text)
    data, columns = _take_columns(path, table, POWER, units, missing=-900.0)
    hours = pd.DataFrame(
        {"year": table["YEAR"], "month": table["MO"], "day": table["DY"], "hour": table["HR"]}
    )
    with InputError.parsing(path, "its YEAR, MO, DY and HR are no times", DAMAGED):
        times = pd.DatetimeIndex(pd.to_datetime(hours.astype(int))).tz_localize("UTC")
    data.index = times - pd.Timedelta(hours=0 if zone == "UTC" else round(longitude / 15))
    notes = ["wind is that of 2 m"] if columns.get("wind_speed") == "WS2M" else []
    label = f"NASA POWER {path.name}"
    return Record(
        _lay_intervals(data, lies), latitude, longitude, altitude, str(path), label, notes, columns
    )


def read_solcast(path, own, lies):
    """Read a time series of Solcast, csv: its names are written with or without underscores and
    capitals.

    Parameters
    ----------
    path : path-like
    own : tuple of float
        Latitude and longitude [°] and altitude [m] of the place, which is not in the file.
    lies : str
        Where the interval lies at `period_end`.
    """
    path = Path(path)
    with InputError.parsing(path, "cannot be read as Solcast csv", DAMAGED):
        table = pd.read_csv(io.StringIO(read_text(path)), dtype=str, skipinitialspace=True)
    table.columns = [str(name).strip().lower().replace("_", "") for name in table]
    data, columns = _take_columns(path, table, SOLCAST, {"pressure": "hPa"})
    starts = "periodstart" in table
    if not starts and "periodend" not in table:
        raise InputError(path, "has neither period_end nor period_start", AGAIN)
    data.index = _parse_times(path, table["periodstart" if starts else "periodend"])
    data = _lay_intervals(data, "begins" if starts else lies)
    return Record(data, *own, str(path), f"Solcast {path.name}", columns=columns)


def read_cams(path):
    """Read a time series of the CAMS radiation service: no temperature, no wind."""
    path = Path(path)
    text = read_text(path).replace('"', "")
    if re.search(r"^# Time reference.*TST|True solar", text, re.IGNORECASE | re.MULTILINE):
        raise InputError(path, "its times are true solar time", "ask for universal time (UT)")
    with InputError.parsing(path, "cannot be read as CAMS radiation csv", DAMAGED):
        table, place = pvlib.iotools.read_cams(io.StringIO(text))
        place = place["latitude"], place["longitude"], max(place["altitude"], -500.0)
    columns = {"ghi": "GHI", "dhi": "DHI", "dni": "BNI"}
    data = table[[name for name in columns if name in table]].astype(float)
    if data.empty or not len(data.columns):
        raise InputError(
            path,
            "is McClear, a sky without clouds",
            "ask CAMS for all-sky radiation (cams_radiation)",
        )
    return Record(data, *place, str(path), f"CAMS {path.name}", columns=columns)


def read_point_series(path):
    """Read a point of ERA5 as the Climate Data Store sends it: csv, or a zip of csv files of the
    same times.

    Radiation [J/m²] is summed over the hour that ends at the stamp; in the Record it is a mean by
    the start of the hour [Wm⁻²]. The file tells no altitude: it is 0.
    """
    # One table, or several of the same times in a zip, which must not unpack to far more than it
    # is.
    path = Path(path)
    with InputError.parsing(path, "cannot be read as point series", DAMAGED):
        if zipfile.is_zipfile(path):
            with open_zip(path) as archive:
                names = sorted(name for name in archive.namelist() if name.lower().endswith(".csv"))
                tables = [pd.read_csv(archive.open(name)) for name in names]
        else:
            tables = [pd.read_csv(io.StringIO(read_text(path)))]
    # Each with time and place.
    for table in tables:
        if not {"valid_time", "latitude", "longitude"} <= set(table):
            raise InputError(
                path,
                "no columns valid_time, latitude and longitude",
                "download a point series of ERA5",
            )
        if table.empty:
            raise InputError(path, "has no hours", AGAIN)
    # Joined by time, columns of one name once; several places are refused.
    first, *others = (table.set_index("valid_time") for table in tables)
    table = (
        first.join([other.drop(columns=[n for n in other if n in first]) for other in others])
        if others
        else first
    )
    place = table[["latitude", "longitude"]].to_numpy(float)
    if np.ptp(place, axis=0).max() > 1e-6:
        raise InputError(path, "has several places", "download one point")
    index = _parse_times(path, table.index.to_series().astype(str), pd.Timedelta(0))
    data, columns = convert_points(table, index)
    label = f"ERA5 {path.name} (point {place[0, 0]:g}°, {place[0, 1]:g}°)"
    return Record(data, *place[0], 0.0, str(path), label, columns=columns)


def convert_points(table, stamps):
    """Our variables, by the start of each hour, and their names, from ERA5's [J/m², K, m/s, Pa] and
    its stamps.
    """
    data = pd.DataFrame(index=range(len(table)))
    names = {
        "ghi": "ssrd",
        "dhi": "ssrd - fdir",
        "temp_air": "t2m",
        "wind_speed": "u10, v10",
        "pressure": "sp",
    }
    values = {
        name: table[name].to_numpy(float) for name in table if name not in ("latitude", "longitude")
    }
    if "ssrd" in values:
        data["ghi"] = values["ssrd"] / 3600.0
        if "fdir" in values:
            data["dhi"] = np.maximum(values["ssrd"] - values["fdir"], 0.0) / 3600.0
    if "t2m" in values:
        data["temp_air"] = values["t2m"] - 273.15
    if {"u10", "v10"} <= set(values):
        data["wind_speed"] = np.hypot(values["u10"], values["v10"])
    if "sp" in values:
        data["pressure"] = values["sp"]
    return _lay_intervals(data.set_axis(stamps, axis=0), "ends"), {
        name: names[name] for name in data
    }


def _lay_intervals(data, lies):
    """Name rows by the start of their interval, which `begins`, `ends` or is `centred` at its
    stamp.
    """
    if len(data) < 2 or lies == "begins":
        return data
    interval = (data.index[1:] - data.index[:-1]).to_series().mode().iloc[0]
    return data.set_axis(data.index - {"ends": interval, "centred": interval / 2}[lies], axis=0)


def _take_columns(path, table, names, units, missing=-np.inf):
    """Our variables in our units, and what the file calls them; numbers at or below `missing` are
    missing values.
    """
    data, columns = {}, {}
    for ours, theirs in names.items():
        if (name := next((name for name in theirs if name in table), None)) is None:
            continue
        kind = ours if ours in UNITS else "irradiance"
        unit = units.get(name, units.get(kind)) or next(iter(UNITS[kind]))
        if unit not in UNITS[kind]:
            raise InputError(path, f"{name} is in {unit!r}", f"ask for {', '.join(UNITS[kind])}")
        factor, offset = UNITS[kind][unit]
        values = read_numbers(path, table[name])
        data[ours], columns[ours] = (
            np.where(values <= missing, np.nan, values) * factor + offset,
            name,
        )
    if not data:
        raise InputError(
            path,
            "has no column of weather",
            f"ask for {', '.join(name[0] for name in names.values())}",
        )
    return pd.DataFrame(data), columns


def _parse_times(path, column, zone=None):
    """Times of a column in UTC: of ISO 8601 or seconds since 1970, in a zone of this offset where
    they name none.
    """
    text = column.astype(str).str.strip()
    if text.str.fullmatch(r"\d{6,}").all():
        return pd.DatetimeIndex(pd.to_datetime(text.astype("int64"), unit="s", utc=True))
    times = pd.to_datetime(text, utc=True, errors="coerce", format="ISO8601")
    if (row := first_true(times.isna().to_numpy())) is not None:
        raise InputError(path, f"{text.iloc[row]!r} (row {row + 1}) is not a time", AGAIN)
    if zone is None and not text.str.contains(r"(?:Z|[+-]\d\d:?\d\d)$").all():
        raise InputError(path, "its times have no time zone", "ask for times in UTC")
    return pd.DatetimeIndex(times) - (zone or pd.Timedelta(0))


def _parse_open_meteo_json(path, text):
    """Head, table of texts and units of an answer in json."""
    try:
        tree = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(
            path, f"line {error.lineno} is not JSON ({error.msg})", f"{AGAIN}; it may be cut"
        ) from error
    if isinstance(tree, list):
        raise InputError(path, f"has {len(tree)} places", "ask for one place")
    if tree.get("error"):
        raise InputError(path, f"is a refusal ({tree.get('reason', 'without a reason')})", AGAIN)
    step = next(
        (name for name in ("hourly", "minutely_15") if isinstance(tree.get(name), dict)), None
    )
    if step is None or not all(isinstance(values, list) for values in tree[step].values()):
        raise InputError(
            path,
            "no hourly values",
            "ask for hourly=" + ",".join(n[0] for n in OPEN_METEO.values()),
        )
    lengths = {name: len(values) for name, values in tree[step].items()}
    if len(set(lengths.values())) > 1:
        raise InputError(path, f"its columns have different lengths ({lengths})", AGAIN)
    # Units that are not told are the service's own: km/h.
    units = {"wind_speed": "km/h", "pressure": "hPa"} | tree.get(f"{step}_units", {})
    return tree, pd.DataFrame(tree[step]), units


def _parse_open_meteo_csv(path, text):
    """Parse csv of Open-Meteo: names and values of the place, an empty line, the table; units in
    brackets behind its names.

    Returns values of the place by name, the hourly table as text, NaN where a value is missing, and
    units by name: km/h of wind and hPa of pressure where none are given. A file without hourly
    table or with several places is refused.
    """
    # The hourly table begins at the row whose first word is time.
    rows = list(csv.reader(io.StringIO(text)))
    start = next(
        (number for number, row in enumerate(rows) if row and row[0].strip() == "time"), None
    )
    if start is None or len(rows[start:]) < 2:
        raise InputError(path, "no hourly table", AGAIN)
    # One place, in the rows before.
    places = [row for row in rows[1:start] if any(field.strip() for field in row)]
    if len(places) != 1:
        raise InputError(path, f"has {len(places)} places", "ask for one place")
    head = dict(zip(rows[0], places[0], strict=False))
    # A table of days may follow the hourly one, behind an empty line.
    end = next(
        (number for number, row in enumerate(rows) if number > start and not any(row)), len(rows)
    )
    # Names of columns, and units in brackets behind them.
    parts = [re.fullmatch(r"(.*?)(?:\s+\((.*)\))?", name.strip()) for name in rows[start]]
    names, units = [part[1] for part in parts], {part[1]: part[2] for part in parts if part[2]}
    table = (
        pd.DataFrame(rows[start + 1 : end])
        .reindex(columns=range(len(names)))
        .set_axis(names, axis=1)
    )
    return (
        head,
        table.replace({"": np.nan, "NaN": np.nan}),
        {"wind_speed": "km/h", "pressure": "hPa"} | units,
    )


def _parse_power_csv(path, text):
    """Place, time zone (UTC or LST), table and units of NASA POWER's csv."""
    head, _, body = text.partition("-END HEADER-")
    place = re.search(r"latitude\s+(-?[\d.]+)\s+longitude\s+(-?[\d.]+)", head, re.IGNORECASE)
    altitude = re.search(r"=\s*(-?[\d.]+)\s*meters", head)
    zone = re.search(r"through .* in (UTC|LST)", head)
    if not (place and zone):
        raise InputError(path, "its header has no place or no time zone", AGAIN)
    with InputError.parsing(path, "cannot be read as NASA POWER csv", DAMAGED):
        table = pd.read_csv(io.StringIO(body.lstrip()), dtype=str, skipinitialspace=True)
    if not {"YEAR", "MO", "DY", "HR"} <= set(table):
        raise InputError(path, "has no columns YEAR, MO, DY, HR", "ask for hourly data")
    units = dict(re.findall(r"^(\w+)\s+.*\(([^()]+)\)\s*$", head, re.MULTILINE))
    where = float(place[1]), float(place[2]), float(altitude[1]) if altitude else 0.0
    return where, zone[1], table, {"pressure": "kPa"} | units


def _parse_power_json(path, text):
    """Parse json of NASA POWER."""
    try:
        tree = json.loads(text)
        longitude, latitude, altitude = tree["geometry"]["coordinates"]
        table = pd.DataFrame(tree["properties"]["parameter"])
        stamps = table.index.astype(str)
        zone = tree["header"].get("time_standard", "LST")
        units = {
            name: about["units"]
            for name, about in tree.get("parameters", {}).items()
            if "units" in about
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            path, f"is no answer of NASA POWER ({type(error).__name__})", f"{AGAIN}; it may be cut"
        ) from error
    if not stamps.str.fullmatch(r"\d{10}").all():
        raise InputError(path, f"its time {stamps[0]!r} is not one of hours", "ask for hourly data")
    table = table.reset_index(drop=True)
    for name, part in {"YEAR": (0, 4), "MO": (4, 6), "DY": (6, 8), "HR": (8, 10)}.items():
        table[name] = [int(stamp[slice(*part)]) for stamp in stamps]
    return (latitude, longitude, altitude), zone, table, {"pressure": "kPa"} | units
