"""Weather of PVGIS (European Commission, Joint Research Centre): typical years and hourly series, read or downloaded.

Irradiance is that of one satellite image per hour: the interval is centred on its time, which in typical years is
"Irradiance Time Offset" hours after the stamp (UTC), and in hourly series the stamp itself.
"""

import io
import json
import re
from pathlib import Path

import pandas as pd
import pvlib

from ..read.open_input import read_text
from ..settings.errors import InputError
from .weather import Record, coerce_year, read_numbers

COLUMNS = {"ghi": "G(h)", "dhi": "Gd(h)", "dni": "Gb(n)", "temp_air": "T2m", "wind_speed": "WS10m", "pressure": "SP"}
PLACE = ("Latitude (decimal degrees)", "Longitude (decimal degrees)", "Elevation (m)", "Irradiance Time Offset (h)")
HALF_HOUR = pd.Timedelta(minutes=30)
LEVEL = 0.01  # [°] slope up to which a plane counts as horizontal
TYPICAL_HOURS = 8760
CURE = "download from PVGIS the typical meteorological year (TMY), or hourly data with slope 0 and radiation components"
TIMEOUT = (5.0, 60.0)  # [s] to reach the server, and for its answer
NOT_REACHED = ("ConnectionError", "ConnectTimeout", "ProxyError", "SSLError")
NO_NETWORK = "give a file, or --weather climate, which needs no network"


def read_pvgis(path, file_format):
    """Read a typical meteorological year or an hourly series of PVGIS.

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
    text = read_text(path)
    if file_format == "csv":
        hourly, typical = "\ntime," in text, "time(UTC)" in text
    else:
        try:
            tree = json.loads(text)
        except json.JSONDecodeError as error:
            raise InputError(path, f"line {error.lineno} is not JSON ({error.msg})", CURE) from error
        outputs = tree.get("outputs", {}) if isinstance(tree, dict) else {}
        hourly, typical = "hourly" in outputs, "tmy_hourly" in outputs
    if not (hourly or typical):
        raise InputError(path, "neither a typical year nor an hourly series of PVGIS", CURE)
    return (read_typical if typical else read_hourly)(path, text, file_format)


def read_typical(path, text, file_format):
    """Record of a typical year: path, text and format as in `read_pvgis`; files before version 5.3 have no offset."""
    if file_format == "csv":
        lines = text.splitlines()
        rows = [line for line in lines if re.match(r"\d{8}:", line)]
        if len(rows) != TYPICAL_HOURS:
            problem = f"{len(rows)} hours instead of {TYPICAL_HOURS}"
            raise InputError(path, problem, "download the file again; it may be cut")
        fields = dict(line.split(":", 1) for line in lines[:12] if ":" in line and not line[0].isdigit())
        place = [fields.get(name, 0.0) for name in PLACE]
        header = next(line for line in lines if line.startswith("time(UTC)"))
        cells = pd.read_csv(io.StringIO("\n".join([header, *rows])), dtype=str)
    else:
        tree = json.loads(text)
        location, cells = tree["inputs"]["location"], pd.DataFrame(tree["outputs"]["tmy_hourly"])
        names = ("latitude", "longitude", "elevation", "irradiance_time_offset")
        place = [location.get(name, 0.0) for name in names]
    latitude, longitude, altitude, offset = map(float, place)
    table = pd.DataFrame({ours: read_numbers(path, cells[name]) for ours, name in COLUMNS.items() if name in cells})
    times = pd.to_datetime(cells["time(UTC)"], format="%Y%m%d:%H%M", utc=True)
    data = lay_intervals(table.set_axis(pd.DatetimeIndex(times), axis=0), offset)
    label = f"PVGIS {path.name} (typical year)"
    return Record(data, latitude, longitude, altitude, str(path), label, columns=COLUMNS)


def lay_intervals(table, offset):
    """Weather of one calendar year, by the start of each interval, from PVGIS' table and its time offset [h]."""
    data = table[[name for name in COLUMNS if name in table]].astype(float)
    data, _ = coerce_year(data)
    data.index = data.index + pd.Timedelta(seconds=round(offset * 3600.0)) - HALF_HOUR
    return data


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
    label, columns = f"PVGIS {path.name} (hourly series)", COLUMNS | {"ghi": "Gb(i) + Gd(i)", "dhi": "Gd(i)"}
    return Record(data.astype(float), latitude, longitude, altitude, str(path), label, columns=columns)


def download_pvgis(latitude, longitude, url=None):
    """Download a typical year, with the same intervals as from a file.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    url : str, optional
        URL of the server; by default that of pvlib.

    Returns
    -------
    Record
        Includes the horizon of distant terrain, from PVGIS.

    Raises
    ------
    InputError
        If there is no network, or PVGIS has no data for this place; with its message in one line.
    """
    longitude = (longitude + 180.0) % 360.0 - 180.0
    address = url or pvlib.iotools.pvgis.URL
    try:
        table, meta = pvlib.iotools.get_pvgis_tmy(
            latitude, longitude, timeout=TIMEOUT, coerce_year=None, map_variables=True, url=address
        )
        place = meta["inputs"]["location"]
        data = lay_intervals(table, float(place.get("irradiance_time_offset", 0.0)))
        altitude = float(place.get("elevation", 0.0))
    except OSError as error:  # what requests raises, from a missing network to PVGIS' own refusal
        words = f"{address} refused ({' '.join(str(error).split())[:160]})"
        if error.__class__.__name__ in NOT_REACHED:
            words = f"cannot reach {address} ({error.__class__.__name__})"
        raise InputError("--weather pvgis", words, NO_NETWORK) from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        problem = f"{address} sent no typical year ({type(error).__name__})"
        raise InputError("--weather pvgis", problem, NO_NETWORK) from error
    label = f"PVGIS {place['latitude']:g}°, {place['longitude']:g}° (typical year, downloaded)"
    return Record(data, place["latitude"], place["longitude"], altitude, "pvgis", label, columns=COLUMNS)
