"""EnergyPlus weather (EPW): typical and real years of stations, hourly or with several records an
hour.
"""

import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from ..read.open_input import read_text
from ..settings.errors import InputError, first_true
from ..sun.solar_position import solar_position
from .check_sun_times import haurwitz
from .read_station_files import take_columns
from .weather import DAMAGED, IRRADIANCES, Record, coerce_year

# Our variable, and column of the file.
EPW = {
    "ghi": "Global Horizontal Radiation",
    "dhi": "Diffuse Horizontal Radiation",
    "dni": "Direct Normal Radiation",
    "temp_air": "Dry Bulb Temperature",
    "wind_speed": "Wind Speed",
    "pressure": "Atmospheric Station Pressure",
}
# Missing values are at or above these numbers.
EPW_MISSING = {
    "ghi": 9999,
    "dhi": 9999,
    "dni": 9999,
    "temp_air": 99.9,
    "wind_speed": 999,
    "pressure": 999999,
}
HEADER_LINES = 8


def read_epw(path):
    """Read an EPW file of a station: Record of GHI, DHI and DNI [Wm⁻²], air temperature [°C], wind
    speed [ms⁻¹] and pressure [Pa].

    Hour 1 covers 0:00 to 1:00 of local standard time, and pvlib's index is the start of that hour.
    A typical year is put into one calendar year. Temperature, wind and pressure hold for the
    record's own hour. Several records an hour are equal parts of it, in their order.

    In files of PVGIS the irradiance comes from satellite images. PVGIS gives their time in the
    header of its csv, in hours after the stamp, and one hour less in COMMENTS of its EPW (0.1761
    and -0.8239 for 45° N, 8° E). The row of hour h in EPW has the image stamped h, so the image was
    taken one hour plus the offset after h.
    """
    path = Path(path)
    lines = read_text(path).splitlines()
    # EnergyPlus does without the last columns (albedo, rain), which are not used here; pvlib wants
    # them in one row.
    if len(lines) > HEADER_LINES:
        # A row has 35 columns, with 34 commas between them.
        lines[HEADER_LINES] += "," * (34 - lines[HEADER_LINES].count(","))
    # pvlib reads the table; its names become ours, and hours become starts of intervals.
    with InputError.parsing(path, "cannot be read as epw", DAMAGED):
        table, place = pvlib.iotools.read_epw(io.StringIO("\n".join(lines)))
    # as pvlib calls them
    table = table.rename(columns=EPW | {"atmospheric_pressure": EPW["pressure"]})
    if table.empty:
        raise InputError(path, "has no hours", DAMAGED)
    starts, parts = _split_hours(path, table)
    data = take_columns(path, table, EPW).set_axis(starts, axis=0)
    # Temperatures in kelvin or Fahrenheit are told by their size, and refused.
    if 150.0 < data["temp_air"].median() < 350.0:
        kelvin = data["temp_air"].median()
        problem = f"the median of {EPW['temp_air']} is {kelvin:.0f}: kelvin, as it seems"
        raise InputError(path, problem, f"give °C, which are K − 273.15 ({kelvin - 273.15:.0f} °C)")
    # Above 140 °F a temperature is another mark of a missing value.
    hot = data["temp_air"].between(EPW_MISSING["temp_air"], 140.0, inclusive="neither")
    if hot.any():
        problem = (
            f"{EPW['temp_air']} is {data['temp_air'][hot].iloc[0]:g}, which no place has in °C"
        )
        raise InputError(path, problem, "give °C, which are (°F − 32) / 1.8")
    # Marks for missing values become gaps.
    for name, mark in EPW_MISSING.items():
        data[name] = data[name].mask(data[name] >= mark)
    # Pressure can be computed from the altitude of the station; the other variables have no
    # substitute.
    if data["pressure"].isna().any():
        data["pressure"] = data["pressure"].fillna(pvlib.atmosphere.alt2pres(place["altitude"]))
    # A typical year becomes one calendar year; values of parts of an hour become W/m² where clear
    # days show that they are Wh/m².
    (data, typical), notes = coerce_year(data), []
    if parts > 1:
        factor = _factor_of_unit(path, data, parts, place)
        data[list(IRRADIANCES)] *= factor
        unit = "W/m²" if factor == 1 else "Wh/m² per interval"
        notes.append(f"{parts} records an hour; its clear days fit the sun in {unit}")
    # Images of PVGIS were taken at another time than the hour says: the intervals are moved there.
    offset_text = re.search(
        r"irradiance time offset \(h\)\s*:\s*([-+]?\d*\.?\d+)",
        "\n".join(lines[:HEADER_LINES]),
        re.IGNORECASE,
    )
    if offset_text:
        offset = float(offset_text[1])
        # [h] from the end of the hour to the image, which is the middle of the interval
        after = offset + 1.0
        data.index += pd.Timedelta(seconds=round((after + 0.5) * 3600.0))
        words = f"irradiance of images {after:+.4f} h from the end of the hour"
        notes.append(f"{words} (Irradiance Time Offset {offset:g} h)")
    label = f"EPW {path.name} ({place['city'].strip()}{', typical year' if typical else ''})"
    place = place["latitude"], place["longitude"], place["altitude"]
    return Record(data, *place, str(path), label, notes, EPW)


def _split_hours(path, table):
    """Start of each record in local standard time, and how many an hour has.

    Parameters
    ----------
    path : pathlib.Path
    table : pandas.DataFrame
        Of pvlib: its index is the start of the hour of each record.

    Returns
    -------
    pandas.DatetimeIndex, int
    """
    minute = table["minute"].astype(int)
    hours = minute.groupby(table.index, sort=False)
    counts = hours.transform("size").to_numpy()
    parts = int(pd.Series(counts).mode().iloc[0])
    if parts == 1 or table.set_index("minute", append=True).index.has_duplicates:
        return table.index, 1  # hourly; what is repeated is refused later
    if (first := first_true(counts != parts)) is not None:
        raise InputError(
            path,
            f"the hour {table.index[first]} has {counts[first]} records, others have {parts}",
            "give the same number of records for every hour",
        )
    number = hours.rank(method="first").to_numpy() - 1
    return pd.DatetimeIndex(table.index + pd.to_timedelta(number * 60 / parts, unit="min")), parts


def _factor_of_unit(path, data, parts, place):
    """Factor of irradiance to W/m²: 1, or the records an hour where they are Wh/m², as the format
    defines it.

    The clearest days against a clear sky tell: files of both kinds are about, and they differ by a
    factor.

    Parameters
    ----------
    path : pathlib.Path
    data : pandas.DataFrame
        By the start of each interval, UTC.
    parts : int
        Records an hour.
    place : dict
        Of pvlib.

    Returns
    -------
    int
    """
    sun = solar_position(
        data.index, pd.Timedelta(hours=1) / parts, place["latitude"], place["longitude"]
    )
    clear = haurwitz(np.maximum(np.cos(np.radians(sun["apparent_zenith"].to_numpy())), 0.0))
    # Whole days, the brightest fiftieth of them; days of a low sun say little.
    days = (
        pd.DataFrame({"ghi": data["ghi"].to_numpy(), "clear": clear})
        .groupby(np.arange(len(data)) // (24 * parts))
        .sum()
    )
    days = days[days["clear"] > 0.3 * days["clear"].max()]
    clearest = float((days["ghi"] / days["clear"]).quantile(0.98))
    if not clearest > 0:
        return 1
    factor = min((1, parts), key=lambda number: abs(np.log(clearest * number)))
    if abs(np.log(clearest * factor)) > 0.45 * np.log(parts):
        raise InputError(
            path,
            f"its clearest days have {clearest:.2f} of a clear sky, neither W/m² nor Wh/m² per "
            "interval",
            "give irradiance in W/m²",
        )
    return factor
