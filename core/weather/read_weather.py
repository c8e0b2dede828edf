"""Read weather from any source: recognise the format, read, check, and add the sun."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..settings.errors import InputError
from ..sun.solar_position import POSITION
from .add_sun import add_sun
from .ask_services import ask_weather
from .check_sun_times import TimesError
from .check_weather import check_values, check_weather, check_years, describe_checks
from .climate import clear_sky, climate
from .compare_climate import label_of_shares
from .complete_record import drop_empty_columns, fill_from_climate
from .formats import read_as, recognise_weather
from .read_era5 import read_era5
from .sources import is_source, parse_asked
from .weather import DAMAGED, join_records


@dataclass
class Reading:
    """Settings for reading weather."""

    point: str = "nearest"  # or bilinear: how a value is taken from gridded weather
    year: int = 2021  # of the clear sky and the built-in climate
    seed: int = 0  # of the days of the built-in climate
    time_shift: float = 0.0  # [min] added to the times of files
    # latitude and longitude [°] of the weather, instead of the site's and its files'
    place: tuple | None = None
    without: str = "none"  # column that is not to be used: ghi, dhi or dni
    horizon_cut: str = "measured"  # or neglect: see add_sun
    keep: tuple = ()  # folders of answers of services: see ask_weather


def read_weather(source, latitude, longitude, altitude=0.0, **settings):
    """Weather of one place, one or many years, with the sun at mid-interval.

    Parameters
    ----------
    source : str or path-like, or list of them
        "climate", the built-in climate of the place; "clear-sky"; a service with years, such as
        "nasa-power:2015-2023", or "pvgis", its typical year (sources.py); or files of the table in
        formats.py, recognised by their content; text files may be gz-compressed. Several files of
        ERA5 are read as one, others are put end to end.
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
    if (asked := parse_asked(sources[0])) and len(sources) == 1:
        records = [ask_weather(asked, latitude, longitude, altitude, reading.keep)]
    else:
        records = read_files(
            [Path(one) for one in sources], (latitude, longitude, altitude), reading
        )
    record = join_records(records)
    try:
        return check_record(record.change(reading.time_shift, reading.without), reading.horizon_cut)
    except TimesError as error:
        raise _try_cure(record, reading, error) from error


def _try_cure(record, reading, error):
    """The error with a cure that was tried: the options with which the whole record passes all
    checks, if there are.

    Parameters
    ----------
    record : Record
        As read, before `reading` changed it.
    reading : Reading
    error : TimesError

    Returns
    -------
    InputError
    """
    time_shift = reading.time_shift + error.time_shift
    # what daylight tells is known to some minutes
    time_shift = time_shift if abs(time_shift) >= 10 else 0.0
    without = reading.without if error.without == "none" else error.without
    options = f" --weather-without {without}" * (
        without != "none"
    ) + f" --time-shift {time_shift:g}" * bool(time_shift)
    try:
        if not options or abs(time_shift) > 720 or reading.without not in ("none", without):
            raise InputError(record.source, error.problem, error.cure)
        check_record(record.change(time_shift, without), reading.horizon_cut)
    except InputError:
        cure = f"{error.cure}; no shift and no column left out mends it"
        return InputError(error.source, error.problem, cure)
    return InputError(error.source, error.problem, f"{error.cure}, or give{options}")


def check_record(record, horizon_cut="measured"):
    """Weather of the Record of some files, with all checks: `horizon_cut` as in `add_sun`.

    Raises
    ------
    InputError
        What the file says cannot be.
    """
    record = drop_empty_columns(record)
    interval = check_weather(record)
    record = fill_from_climate(record, interval)
    weather = add_sun(record, interval, horizon_cut)
    checks = check_years(record, interval, weather.data[POSITION])
    check_values(record.data, record.columns, record.source)
    notes = weather.notes + describe_checks(record, interval, checks)
    if not {"dhi", "dni"} & set(record.data):
        notes.append(
            "DHI and DNI follow from GHI alone (Erbs-Driesse): see the errors in the reference"
        )
    shares = {
        year: times.share_of_climate for year, times in checks.items() if times.share_of_climate
    }
    label = ", ".join(filter(None, (weather.label, label_of_shares(shares))))
    checked = {year: asdict(times) for year, times in checks.items()}
    return replace(weather, label=label, notes=notes, checks=checked)


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
    sources = [str(file) for file in (source if isinstance(source, list | tuple) else [source])]
    if len(sources) == 1 and is_source(sources[0]):
        parse_asked(sources[0])
    else:
        for file in sources:
            recognise_weather(Path(file))


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
    grids = [path for path in paths if kinds[path].key == "era5"]
    records = [read_era5(grids, *own, reading.point)] if grids else []
    place = None if reading.place is None else (*reading.place, own[2])
    for path in paths:
        if kinds[path].key != "era5":
            record = read_file(path, kinds[path], own, place)
            records.append(
                record if place is None else replace(record, latitude=place[0], longitude=place[1])
            )
    return records


def read_file(path, form, own, place):
    """Read one file with the reader of its format.

    Parameters
    ----------
    path : pathlib.Path
    form : Format
        Of `recognise_weather`.
    own : tuple of float
        As in `read_files`.
    place : tuple of float or None
        As above, if the user overrides the place of the files.

    Returns
    -------
    Record
    """
    try:
        return read_as(form, path, own=own, place=place)
    except InputError:
        raise
    except (ValueError, OSError, EOFError) as error:
        # A file of a known format with bytes, words or numbers of another kind is damaged.
        raise InputError.blame(path, f"cannot be read as {form.title}", error, DAMAGED) from error
