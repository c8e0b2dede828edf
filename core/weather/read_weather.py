"""Read weather from any source: recognise the format, read, check, and add the sun."""

import re
import zipfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..read.open_input import open_input
from ..read.parse_json import speaks_of_cityjson
from ..settings.errors import InputError, blame_file
from ..sun.solar_position import POSITION
from .add_sun import add_sun
from .check_weather import check_values, check_weather, check_years, describe_checks
from .climate import clear_sky, climate
from .read_dwd import read_dwd, read_try
from .read_era5 import read_era5
from .read_pvgis import download_pvgis, read_pvgis
from .read_station_files import read_epw, read_psm, read_tmy3, read_weather_csv
from .weather import DAMAGED, change_record, join_records

CURE = "give ERA5 as NetCDF, EPW, TMY3, PVGIS, NSRDB PSM, DWD, a csv with tz-aware times, climate, pvgis or clear-sky"


@dataclass
class Reading:
    """Settings for reading weather."""

    point: str = "nearest"  # or bilinear: how a value is taken from gridded weather
    year: int = 2021  # of the clear sky and the built-in climate
    seed: int = 0  # of the days of the built-in climate
    time_shift: float = 0.0  # [min] added to the times of files
    place: tuple | None = None  # latitude and longitude [°] of the weather, instead of the site's and its files'
    without: str = "none"  # column that is not to be used: ghi, dhi or dni
    horizon_cut: str = "measured"  # or neglect: see add_sun


def read_weather(source, latitude, longitude, altitude=0.0, **settings):
    """Weather of one place, one or many years, with the sun at mid-interval.

    Parameters
    ----------
    source : str or path-like, or list of them
        "climate", the built-in climate of the place; "pvgis", its typical year from PVGIS' server; "clear-sky"; or
        files: ERA5 (NetCDF, or the zip or folder the Climate Data Store's NetCDF files come in; several
        are read as one), EPW, TMY3 csv, PVGIS (csv or json), NSRDB PSM csv, DWD, or a plain csv; text files may be
        gz-compressed. The format is recognised by the content. Several files are put end to end.
    latitude, longitude : float
        Requested place [°]. Files of one station keep the place of the station.
    altitude : float, optional
        Of the place [m]; used for pressure and the clear sky if the source has none.
    **settings
        Fields of `Reading`.

    Returns
    -------
    Weather

    Raises
    ------
    InputError
        If the source is invalid, with file, place and cure.
    """
    reading = Reading(**settings)
    if reading.place is not None:
        latitude, longitude = reading.place
    sources = [str(one) for one in (source if isinstance(source, list | tuple) else [source])]
    if sources in (["clear-sky"], ["climate"]):
        if sources == ["climate"]:
            record = climate(latitude, longitude, reading.year, reading.seed)
        else:
            record = clear_sky(latitude, longitude, altitude, reading.year)
        return add_sun(record, check_weather(record), reading.horizon_cut)
    if sources == ["pvgis"]:
        records = [download_pvgis(latitude, longitude)]
    else:
        records = read_files([Path(one) for one in sources], (latitude, longitude, altitude), reading)
    return check_record(change_record(join_records(records), reading.time_shift, reading.without), reading.horizon_cut)


def check_record(record, horizon_cut="measured"):
    """Weather of the Record of some files, with all checks: `horizon_cut` as in `add_sun`.

    Raises
    ------
    InputError
        What the file says cannot be.
    """
    interval = check_weather(record)
    weather = add_sun(record, interval, horizon_cut)
    checks = check_years(record, interval, weather.data[POSITION])
    check_values(record.data, record.columns, record.source)
    notes = weather.notes + describe_checks(record, interval, checks)
    return replace(weather, notes=notes, checks={year: asdict(times) for year, times in checks.items()})


def check_sources(source):
    """Refuse weather files that are missing, empty or of no known format, by their beginnings.

    Parameters
    ----------
    source : str or path-like, or list of them
        As in `read_weather`.

    Raises
    ------
    InputError
    """
    sources = [str(one) for one in (source if isinstance(source, list | tuple) else [source])]
    if sources not in (["clear-sky"], ["climate"], ["pvgis"]):
        for one in sources:
            recognise_weather(Path(one))


def read_files(paths, own, reading):
    """Records of files: one for all of ERA5, one for each other file.

    Parameters
    ----------
    paths : list of pathlib.Path
    own : tuple of float
        Latitude and longitude [°] and altitude [m] for files without a place.
    reading : Reading

    Returns
    -------
    list of Record
    """
    kinds = {path: recognise_weather(path) for path in paths}
    grids = [path for path in paths if kinds[path] == "era5"]
    records = [read_era5(grids, *own, reading.point)] if grids else []
    place = None if reading.place is None else (*reading.place, own[2])
    for path in paths:
        if kinds[path] != "era5":
            record = read_file(path, kinds[path], own, place)
            records.append(record if place is None else replace(record, latitude=place[0], longitude=place[1]))
    return records


def read_file(path, kind, own, place):
    """Read one file with the reader of its format.

    Parameters
    ----------
    path : pathlib.Path
    kind : str
        Of `recognise_weather`.
    own : tuple of float
        As in `read_files`.
    place : tuple of float or None
        The same, if the user overrides the place of the files.

    Returns
    -------
    Record
    """
    readers = {
        "epw": lambda: read_epw(path),
        "tmy3": lambda: read_tmy3(path),
        "psm": lambda: read_psm(path),
        "dwd": lambda: read_dwd(path, place),
        "try": lambda: read_try(path, place),
        "pvgis-csv": lambda: read_pvgis(path, "csv"),
        "pvgis-json": lambda: read_pvgis(path, "json"),
        "csv": lambda: read_weather_csv(path, *own),
    }
    try:
        return readers[kind]()
    except InputError:
        raise
    except (ValueError, OSError, EOFError) as error:
        # A file of a known format with bytes, words or numbers of another kind is damaged.
        raise blame_file(path, f"cannot be read as {kind}", error, DAMAGED) from error


def recognise_weather(path):
    """Format of a weather file, recognised by its beginning.

    Parameters
    ----------
    path : pathlib.Path
        The file or folder.

    Returns
    -------
    str
        "era5", "epw", "tmy3", "psm", "dwd", "try", "pvgis-csv", "pvgis-json" or "csv".
    """
    if path.is_dir() or zipfile.is_zipfile(path):
        return "era5"
    with open_input(path) as stream:
        head = stream.read(4096)
    if head.startswith((b"CDF", b"\x89HDF")):
        return "era5"
    if not head.strip():
        raise InputError(path, "the file is empty", CURE)
    text = head.decode("utf-8-sig", errors="replace")
    city = name_city(path, text)
    if city:
        raise InputError(path, f"is a city ({city}), not weather", "give it before the options, as CITY; " + CURE)
    lines = text.splitlines()
    marks = {
        "epw": lines[0].startswith("LOCATION,"),
        "pvgis-csv": lines[0].lower().startswith("latitude (decimal degrees)"),
        "pvgis-json": lines[0].lstrip().startswith("{"),
        "tmy3": len(lines) > 1 and "Date (MM/DD/YYYY)" in lines[1],
        "psm": len(lines) > 2 and lines[2].replace('"', "").lower().startswith("year,month,day,"),
        "dwd": any(line.startswith("#") and "G_Bh" in line for line in lines),
        "try": any(line.startswith("Rechtswert") for line in lines),
        "csv": any(sign in text for sign in ",;\t") and "\x00" not in text and not text.startswith("<"),
    }
    if not any(marks.values()):
        raise InputError(path, "is not in a known weather format", CURE)
    return next(kind for kind, found in marks.items() if found)


def name_city(path, text):
    """What a file of buildings is, by its beginning: "CityGML", "CityJSON", "OBJ"; None for others."""
    if text.lstrip().startswith("<"):
        return "CityGML" if "CityModel" in text else None
    if text.lstrip()[:1] in ("{", "["):
        return "CityJSON" if speaks_of_cityjson(path) else None
    return "OBJ" if re.search(r"^v( +[-+.\deE]+){3}", text, re.MULTILINE) else None
