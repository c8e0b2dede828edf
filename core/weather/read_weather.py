"""One door for all weather: recognise the source, read it, check it, add the sun."""

import gzip
import zipfile
from pathlib import Path

from ..errors import InputError
from .add_sun import add_sun
from .check_weather import check_weather
from .clear_sky import clear_sky
from .climate import climate
from .download_pvgis import download_pvgis
from .read_epw import read_epw
from .read_era5 import read_era5
from .read_pvgis import read_pvgis
from .read_tmy3 import read_tmy3
from .read_weather_csv import read_weather_csv

CURE = "give ERA5 as NetCDF, EPW, TMY3, a PVGIS typical year, a csv with tz-aware times, climate, pvgis or clear-sky"


def read_weather(source, latitude, longitude, altitude=0.0, *, point="nearest", year=2021, seed=0):
    """Weather of one place, one or many years, with the sun at mid-interval.

    Parameters
    ----------
    source : str or path-like
        "climate", the built-in climate of the place; "pvgis", its typical year from PVGIS' server; "clear-sky"; or a
        file: ERA5 (NetCDF, or the zip or folder the Climate Data Store's NetCDF files come in), EPW,
        TMY3 csv, PVGIS typical year (csv or json), or a plain csv; text files may be gz-compressed. The format is
        recognised by the content.
    latitude, longitude : float
        The place asked for [°]. Files of one station keep the place of the station.
    altitude : float, optional
        Of the place [m]; used where the source names none, for the pressure and the clear sky.
    point : {"nearest", "bilinear"}, optional
        How a value is taken from gridded weather.
    year : int, optional
        Calendar year of the clear sky and the built-in climate.
    seed : int, optional
        Of the days of the built-in climate.

    Returns
    -------
    Weather

    Raises
    ------
    InputError
        The source cannot be used: names file, place and cure.
    """
    if str(source) == "clear-sky":
        record = clear_sky(latitude, longitude, altitude, year)
    elif str(source) == "climate":
        record = climate(latitude, longitude, year, seed)
    elif str(source) == "pvgis":
        record = download_pvgis(latitude, longitude)
    else:
        record = read_record(Path(source), latitude, longitude, altitude, point)
    return add_sun(record, check_weather(record))


def read_record(path, latitude, longitude, altitude, point):
    """Read one file with the reader of its format.

    Parameters
    ----------
    path : pathlib.Path
        The file or folder.
    latitude, longitude, altitude, point
        As in `read_weather`.

    Returns
    -------
    Record
    """
    kind = recognise_weather(path)
    try:
        if kind == "era5":
            return read_era5(path, latitude, longitude, altitude, point)
        if kind == "epw":
            return read_epw(path)
        if kind == "tmy3":
            return read_tmy3(path)
        if kind.startswith("pvgis"):
            return read_pvgis(path, kind.removeprefix("pvgis-"))
        return read_weather_csv(path, latitude, longitude, altitude)
    except InputError:
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OSError, EOFError) as error:
        # A file of a known kind that breaks its reader is damaged: say which, and the reader's own words in one line.
        words = " ".join(str(error).split())[:200]
        raise InputError(
            path, f"cannot be read as {kind} ({words})", "download the file again; it may be cut"
        ) from error


def recognise_weather(path):
    """Format of a weather file, judged by how it begins.

    Parameters
    ----------
    path : pathlib.Path
        The file or folder.

    Returns
    -------
    str
        "era5", "epw", "tmy3", "pvgis-csv", "pvgis-json" or "csv".
    """
    if path.is_dir():
        return "era5"
    head = read_head(path)
    if not head.strip():
        raise InputError(path, "the file is empty", CURE)
    if head.startswith((b"CDF", b"\x89HDF")) or zipfile.is_zipfile(path):
        return "era5"
    text = head.decode("utf-8-sig", errors="replace")
    lines = text.splitlines()
    marks = {
        "epw": lines[0].startswith("LOCATION,"),
        "pvgis-csv": lines[0].lower().startswith("latitude (decimal degrees)"),
        "pvgis-json": lines[0].lstrip().startswith("{"),
        "tmy3": len(lines) > 1 and "Date (MM/DD/YYYY)" in lines[1],
        "csv": "," in text and "\x00" not in text,
    }
    for kind, found in marks.items():
        if found:
            return kind
    raise InputError(path, "is in no known weather format", CURE)


def read_head(path):
    """The first bytes of a file, unpacked where it is gz-compressed."""
    try:
        with path.open("rb") as file:
            head = file.read(4096)
        if head.startswith(b"\x1f\x8b"):
            with gzip.open(path, "rb") as file:
                head = file.read(4096)
    except (OSError, EOFError) as error:
        words = getattr(error, "strerror", None) or str(error)
        raise InputError(path, f"cannot be read ({words})", "give the path of a readable weather file") from error
    return head
