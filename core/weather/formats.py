"""Formats of weather files, told by their marks: one table, from which reading, errors, the manual
and Blender's file dialogue come.

A mark is what only files of that format begin with. The first format of the table whose mark is
there counts, so that special ones stand before general ones; a format without a reader is named,
with what to give instead. Loads nothing heavy, since Blender asks for suffixes when it starts.
"""

import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from ..read.open_input import open_input
from ..read.parse_json import speaks_of_cityjson
from ..settings.errors import InputError

BY_PLACE = "let the program ask for it (--weather nasa-power:YEARS, pvgis:YEARS)"
AS_CSV = "write a csv of times, ghi, dhi, dni, temp_air and wind_speed (docs/reference/weather.md)"


@dataclass(frozen=True)
class Format:
    """One format of weather files."""

    key: str
    title: str  # as the manual and messages name it
    mark: Callable  # head of a file, _Head -> bool
    reader: str = ""  # file and function in this room; "": it is named, but not read
    takes: tuple = ()  # what the reader wants beside the path: own, place, lies; see `read_as`
    suffixes: tuple = ()  # of Blender's file dialogue
    # begins, ends or centred: where its interval lies at a time stamp; "": as `stamp` says
    lies: str = ""
    stamp: str = ""  # the same in words
    irradiance: str = ""  # columns of irradiance
    place: str = ""  # where the place comes from
    instead: str = ""  # what to give where it is not read


@dataclass(frozen=True)
class _Head:
    """The beginning of a file."""

    start: bytes
    text: str
    lines: list  # of str, never empty
    member: str = ""  # suffix of the first file in a zip

    def line(self, number):
        """A line by number, "" beyond the last."""
        return self.lines[number] if number < len(self.lines) else ""

    def header(self, *names):
        """Whether a line begins with the first of these column names and has the others."""
        return any(
            line.startswith(names[0]) and all(name in line for name in names) for line in self.lines
        )


def _is_json(*names):
    return lambda head: (
        head.text.lstrip()[:1] in ("{", "[") and all(f'"{name}"' in head.text for name in names)
    )


def _is_solcast(head):
    words = head.lines[0].lower().replace("_", "")
    return "," in words and ("periodend" in words or "periodstart" in words)


def _is_other_netcdf(head):
    return head.start.startswith((b"CDF", b"\x89HDF"))


FORMATS = (
    Format(
        "grib",
        "GRIB",
        lambda head: head.start.startswith(b"GRIB"),
        instead="download it as NetCDF, of ERA5 hourly data on single levels",
    ),
    Format(
        "cds-points",
        "CDS point series of ERA5 (csv, or its zip)",
        lambda head: head.header("valid_time", "latitude") or head.member == ".csv",
        "read_services.read_point_series",
        (),
        (".csv", ".zip"),
        "ends",
        "end of the interval, UTC",
        "ssrd, fdir",
        "in the file",
    ),
    Format(
        "era5",
        "ERA5 and ERA5-Land (NetCDF; zip, folder, several files)",
        lambda head: _is_other_netcdf(head) or head.member == ".nc",
        "",
        (),
        (".nc", ".zip"),
        "ends",
        "end of the interval, UTC; sums since 0 UTC are told by their course",
        "ssrd, fdir, or mean rates",
        "nearest grid point (`--weather-point bilinear`: of four), sun of the city",
    ),
    Format(
        "epw",
        "EPW, hourly or with several records an hour",
        lambda head: head.lines[0].startswith("LOCATION,"),
        "read_epw.read_epw",
        (),
        (".epw",),
        "",
        "hour 1 is 0:00 to 1:00 of local standard time; with `Irradiance Time Offset` the "
        "satellite's moment",
        "GHI, DHI, DNI",
        "station",
    ),
    Format(
        "tmy3",
        "TMY3 csv",
        lambda head: "Date (MM/DD/YYYY)" in head.line(1),
        "read_station_files.read_tmy3",
        (),
        (".csv",),
        "ends",
        "end of the interval, local standard time",
        "two or three of GHI, DHI, DNI",
        "station",
    ),
    Format(
        "pvgis-csv",
        "PVGIS typical year or hourly series, csv",
        lambda head: head.lines[0].lower().startswith("latitude (decimal degrees)"),
        "read_pvgis.read_pvgis",
        (),
        (".csv",),
        "centred",
        "satellite's moment, UTC",
        "G(h), Gd(h), Gb(n); hourly series: Gb(i), Gd(i) of slope 0",
        "in the file",
    ),
    Format(
        "pvgis-json",
        "PVGIS typical year or hourly series, json",
        _is_json("inputs", "location"),
        "read_pvgis.read_pvgis",
        (),
        (".json",),
        "centred",
        "satellite's moment, UTC",
        "as in its csv",
        "in the file",
    ),
    Format(
        "psm",
        "NSRDB PSM csv",
        lambda head: (
            head.line(2).replace('"', "").lower().startswith("year,month,day,")
            and "Local Time Zone" in head.lines[0]
        ),
        "read_station_files.read_psm",
        (),
        (".csv",),
        "centred",
        "satellite's moment, the file's time zone",
        "GHI, DHI, DNI",
        "in the file",
    ),
    Format(
        "sam",
        "SAM csv of another source than NSRDB",
        lambda head: (
            re.match(r'"?year"?,"?(month|day|hour)', head.line(2), re.IGNORECASE)
            or head.header("Latitude", "Longitude", "Time Zone")
        ),
        instead=("its stamps have several meanings: give the csv of NSRDB it was made of, or ")
        + AS_CSV,
    ),
    Format(
        "dwd",
        "DWD station table",
        lambda head: any(line.startswith("#") and "G_Bh" in line for line in head.lines),
        "read_dwd.read_dwd",
        ("place",),
        (".txt",),
        "ends",
        "hour 1 ends at 1:00 UTC+1",
        "direct and diffuse, horizontal",
        "head of the file",
    ),
    Format(
        "try",
        "DWD test reference year of 2017 (2015, 2045)",
        lambda head: any(line.startswith("Rechtswert") for line in head.lines),
        "read_dwd.read_try",
        ("place",),
        (".dat",),
        "",
        "hour 1 is 0:30 to 1:30 of UTC+1, or 0:00 to 1:00: as the sun fits",
        "B, D, horizontal",
        "Rechtswert, Hochwert (EPSG:3034)",
    ),
    Format(
        "try-2010",
        "DWD test reference year of 2010",
        lambda head: (
            any(line.split()[:5] == ["RG", "IS", "MM", "DD", "HH"] for line in head.lines)
            or (head.lines[0].startswith("TRY") and "Lage" in head.text)
        ),
        "read_dwd.read_try_2010",
        ("place",),
        (".dat",),
        "",
        "hour 1 is 0:00 to 1:00 of UTC+1, or 0:30 to 1:30: as the sun fits",
        "B, D, horizontal",
        "Lage, or `--weather-place`",
    ),
    Format(
        "open-meteo-json",
        "Open-Meteo json",
        _is_json("utc_offset_seconds", "elevation"),
        "read_services.read_open_meteo",
        ("lies",),
        (".json",),
        "ends",
        "end of the interval, by its `utc_offset_seconds`",
        "shortwave_radiation, diffuse_radiation, direct_normal_irradiance",
        "in the file",
    ),
    Format(
        "open-meteo-csv",
        "Open-Meteo csv",
        lambda head: head.header("latitude", "utc_offset_seconds"),
        "read_services.read_open_meteo",
        ("lies",),
        (".csv",),
        "ends",
        "end of the interval, by its `utc_offset_seconds`",
        "as in its json",
        "in the file",
    ),
    Format(
        "nasa-power-json",
        "NASA POWER json, hourly",
        _is_json("properties", "geometry"),
        "read_services.read_nasa_power",
        ("lies",),
        (".json",),
        "begins",
        "start of the interval, UTC or whole hours of local solar time",
        "as in its csv",
        "in the file",
    ),
    Format(
        "nasa-power",
        "NASA POWER csv, hourly",
        lambda head: head.lines[0].startswith("-BEGIN HEADER-") and "NASA/POWER" in head.text,
        "read_services.read_nasa_power",
        ("lies",),
        (".csv",),
        "begins",
        "start of the interval, UTC or whole hours of local solar time",
        "ALLSKY_SFC_SW_DWN, _DIFF, _DNI",
        "in the file",
    ),
    Format(
        "solcast",
        "Solcast csv",
        _is_solcast,
        "read_services.read_solcast",
        ("own", "lies"),
        (".csv",),
        "ends",
        "period_end ends the interval, period_start begins it",
        "ghi, dhi, dni",
        "the city, or `--weather-place`",
    ),
    Format(
        "cams",
        "CAMS radiation csv",
        lambda head: (
            head.lines[0].startswith("#")
            and "Observation period" in head.text
            and "CAMS" in head.text
        ),
        "read_services.read_cams",
        (),
        (".csv",),
        "begins",
        "both ends of the interval, UTC",
        "GHI, DHI, BNI",
        "in the file",
    ),
    Format(
        "solargis",
        "Solargis csv",
        lambda head: (
            (head.text.startswith("#") and "solargis" in head.text.lower())
            or head.header("Date;Time;", "GHI", "DIF")
        ),
        instead="its stamps have several meanings: " + AS_CSV,
    ),
    Format(
        "ninja",
        "renewables.ninja csv",
        lambda head: "renewables.ninja" in head.lines[0].lower(),
        instead="its irradiance is in kW/m² on the plane that was asked for: " + BY_PLACE,
    ),
    Format(
        "tmy2",
        "TMY2",
        lambda head: re.match(
            (
                r"\s*\d{5} .{22} \S\S\s+-?\d+ [NS]\s*\d+ +\d+ "
                r"[EW]"
            ),
            head.lines[0],
        ),
        instead="give the EPW or TMY3 of the place, or " + BY_PLACE,
    ),
    Format(
        "csv",
        "csv",
        lambda head: any(sign in head.text for sign in ",;\t") and not _is_binary(head),
        "read_csv.read_weather_csv",
        ("own",),
        (".csv",),
        "begins",
        "start of the interval, with its UTC offset; of a typical year the months may be of "
        "different years",
        "two or three of `ghi`, `dhi`, `dni` [W/m²]; `temp_air` [°C], `wind_speed` [m/s], "
        "optionally "
        "`pressure` [Pa]; `# latitude: …` before them",
        "the city, or `--weather-place`",
    ),
)


def _is_binary(head):
    return "\x00" in head.text or head.text.lstrip().startswith(("<", "{", "["))


def _cure_of_formats():
    """What weather may be given, for errors."""
    titles = ", ".join(
        form.title.split(" (")[0] for form in FORMATS if form.reader or form.key == "era5"
    )
    return f"give {titles} with tz-aware times; or climate, clear-sky, pvgis"


def recognise_weather(path):
    """Format of a weather file, recognised by its beginning.

    Parameters
    ----------
    path : pathlib.Path
        The file or folder.

    Returns
    -------
    Format

    Raises
    ------
    InputError
        The file is missing, empty, a city, of a format that is not read, or of none that is known.
    """
    path = Path(path)
    if path.is_dir():
        return _by_key("era5")
    head = _read_head(path)
    if city := _name_city(path, head.text):
        raise InputError(
            path,
            f"is a city ({city}), not weather",
            f"give it before the options, as CITY; {_cure_of_formats()}",
        )
    form_of_file = next((form for form in FORMATS if form.mark(head)), None)
    if form_of_file is None:
        is_json = head.text.lstrip().startswith("{")
        kind = (
            "JSON of a known kind of weather, or is cut" if is_json else "in a known weather format"
        )
        raise InputError(path, f"is not {kind}", _cure_of_formats())
    if form_of_file.instead:
        raise InputError(path, f"is {form_of_file.title}, which is not read", form_of_file.instead)
    return form_of_file


def read_as(form, path, **known):
    """Read a file with the reader of its format.

    Parameters
    ----------
    form : Format
    path : pathlib.Path
    **known
        own, place: as in `read_weather.read_files`; the reader gets those that its format `takes`.

    Returns
    -------
    Record
    """
    room, function = form.reader.split(".")
    reader = getattr(import_module(f".{room}", __package__), function)
    return reader(path, **{name: {**known, "lies": form.lies}[name] for name in form.takes})


def suffixes_of_weather():
    """Suffixes of weather files, each once: list of str."""
    return sorted({suffix for form in FORMATS for suffix in form.suffixes})


def table_of_formats():
    """The manual's table of what is read, and the list of what is only named: str, str."""
    rows = ["| format | irradiance | meaning of a time stamp | place |", "|---|---|---|---|"]
    rows += [
        f"| {f.title} | {f.irradiance} | {f.stamp} | {f.place} |" for f in FORMATS if not f.instead
    ]
    named = [f"- **{f.title}**: {f.instead}." for f in FORMATS if f.instead]
    return "\n".join(rows), "\n".join(named)


def _by_key(key):
    return next(form for form in FORMATS if form.key == key)


def _read_head(path):
    """The first bytes of a file as _Head; of a zip, which kind of file it holds."""
    if path.is_file() and zipfile.is_zipfile(path):  # a pipe would wait for ever
        with (
            InputError.parsing(path, "cannot be unpacked", "download it again; it may be cut"),
            zipfile.ZipFile(path) as archive,
        ):
            names = [
                Path(name).suffix.lower() for name in archive.namelist() if not name.endswith("/")
            ]
        return _Head(b"PK", "", [""], ".csv" if names and set(names) == {".csv"} else ".nc")
    with open_input(path) as stream:
        start = stream.read(8192)
    if not start.strip():
        raise InputError(path, "the file is empty", _cure_of_formats())
    text = start.decode("utf-8-sig", errors="replace")
    return _Head(start, text, text.splitlines() or [""])


def _name_city(path, text):
    """What a file of buildings is, by its beginning: "CityGML", "CityJSON", "OBJ"; None for
    others.
    """
    if text.lstrip().startswith("<"):
        return "CityGML" if "CityModel" in text else None
    if text.lstrip()[:1] in ("{", "["):
        return "CityJSON" if speaks_of_cityjson(path) else None
    return "OBJ" if re.search(r"^v( +[-+.\deE]+){3}", text, re.MULTILINE) else None
