"""Places of a world, points of a grid or stations, and the sources of their weather."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..settings.errors import InputError
from ..sun.solar_position import geocentric_sun, sun_of_place
from . import climate
from .add_sun import add_sun
from .check_weather import check_weather, check_years
from .climate import INTERVAL, LABEL
from .climate_grid import LEAST_LATITUDE, is_land
from .read_era5 import NEEDED, convert_era5, read_block
from .weather import Record

NOTHING, CLIMATE, CLEAR, FILES = 0, 1, 2, 3  # what the weather of a place is
MEANINGS = {NOTHING: "none", CLIMATE: "built_in_climate", CLEAR: "clear_sky", FILES: "files"}


@dataclass
class Places:
    """The p places of a world, row by row if they are a grid."""

    latitude: np.ndarray  # (p,) [°]
    longitude: np.ndarray  # (p,) [°], from -180 to below 180
    rows: np.ndarray | None = None  # (a,) latitudes of the grid, ascending; None for stations
    columns: np.ndarray | None = None  # (b,) its longitudes, ascending
    names: list | None = None  # (p,) str of stations

    def __len__(self):
        return len(self.latitude)


def grid_places(rows, columns):
    """All points of a grid.

    Parameters
    ----------
    rows, columns : numpy.ndarray
        Latitudes and longitudes [°], ascending.

    Returns
    -------
    Places
    """
    return Places(np.repeat(rows, len(columns)), np.tile(columns, len(rows)), rows, columns)


def regular_axes(step, latitudes=None, longitudes=None):
    """Latitudes and longitudes at multiples of a step.

    Parameters
    ----------
    step : float
        [°]
    latitudes, longitudes : tuple of float, optional
        First and last [°]; by default 60° S to 90° N, and all around. Longitudes from east to west
        cross the date line.

    Returns
    -------
    rows, columns : numpy.ndarray
        Ascending; -180° stands for 180° too.
    """
    check_region(latitudes, longitudes)
    # Without limits, the paper's band.
    south, north = latitudes or (-60.0, 90.0)
    west, east = longitudes or (-180.0, 180.0)
    rows, columns = (
        first + step * np.arange(int(np.floor((last - first) / step + 1e-9)) + 1)
        for first, last in ((south, north), (west, east + 360.0 * (east < west)))
    )
    return rows, np.unique(np.where(columns >= 180.0, columns - 360.0, columns))


def check_region(latitudes=None, longitudes=None):
    """Refuse a region that is empty or not on Earth; parameters as of `regular_axes`."""
    ordered = longitudes and sorted(longitudes)  # 170 to -170° is across the date line
    for option, limits, most in (
        ("--latitudes", latitudes, 90.0),
        ("--longitudes", ordered, 180.0),
    ):
        if limits and not (-most <= limits[0] <= limits[1] <= most):
            raise InputError(
                option,
                f"{limits[0]:g} to {limits[1]:g} is no range",
                f"give two ascending numbers from -{most:g} to {most:g}",
            )


def thin_axis(axis, step, limits):
    """Positions of the points of an axis within limits and about a step apart.

    Parameters
    ----------
    axis : numpy.ndarray
        Ascending [°].
    step : float or None
        [°]; None takes all.
    limits : tuple of float or None

    Returns
    -------
    numpy.ndarray of int
    """
    first, last = limits or (-np.inf, np.inf)
    above, below = axis >= first - 1e-6, axis <= last + 1e-6
    # From 170 to -170° is across the date line.
    inside = np.flatnonzero(above & below if first <= last else above | below)
    if step is None or len(axis) < 2:
        return inside
    stride = max(1, round(step / np.diff(axis).min()))
    gap = np.diff(axis[inside])
    # A region across the date line is in two parts: count from its western edge.
    start = gap.argmax() + 1 if len(gap) and gap.max() > 1.5 * np.median(gap) else 0
    return np.sort(np.roll(inside, -start)[::stride])


@dataclass
class _Source:
    """Weather of places: `read(chunk)` gives their Weather and what it is."""

    places: Places
    label: str
    chunks: list  # of sequences of int, places that are read together
    read: object  # callable(chunk) -> list of (Weather or None, code)
    notes: list  # of str


def model_source(places, name, request, off_land="blank"):
    """Built-in climate or clear sky.

    Parameters
    ----------
    places : Places
    name : {"climate", "clear-sky"}
    request : Request
        Its year, weather_seed and horizon_cut.
    off_land : {"blank", "climate", "clear-sky"}
        Further than 100 km from land.

    Returns
    -------
    Source
        Its `read` gives each place of a portion Weather and a code, or None and NOTHING.
    """
    # The sun as seen from the Earth's middle is computed once, and turned to each place.
    sun = geocentric_sun(climate.hours_of_year(request.year), INTERVAL)

    # The climate from LEAST_LATITUDE northwards, on land or where `off_land` asks for it; elsewhere
    # the clear sky if `name` or `off_land` says so, else nothing.
    def read(chunk):
        """Weather of each place of a portion, with CLIMATE, CLEAR or NOTHING: list of tuples.

        `chunk` are numbers of places; the weather is None where there is nothing.
        """
        at = [(places.latitude[one], places.longitude[one]) for one in chunk]
        suns = [sun_of_place(sun, *place) for place in at]
        asked = enumerate(at if name == "climate" else [])
        # The climate counts from 60° S northwards, on land or where it is wanted off land, too.
        known = [
            k
            for k, one in asked
            if one[0] >= LEAST_LATITUDE and (off_land == "climate" or is_land(*one))
        ]
        # Climates of a portion are made together, as they share their random numbers.
        records, clear = {}, "clear-sky" in (name, off_land)
        if known:
            zenith = np.stack([suns[k]["apparent_zenith"].to_numpy() for k in known])
            axes = map(list, zip(*(at[k] for k in known), strict=True))
            records = dict(
                zip(
                    known,
                    climate.make_climates(*axes, request.year, request.weather_seed, zenith),
                    strict=True,
                )
            )
        # Each place with its weather and what this is.
        weathers = []
        for k, (place, own) in enumerate(zip(at, suns, strict=True)):
            # Elsewhere it is the clear sky where this is wanted, else nothing.
            code = CLIMATE if k in records else CLEAR if clear else NOTHING
            if code == CLEAR:
                records[k] = climate.clear_sky(
                    *place, climate.look_up_altitude(*place), request.year, sun=own
                )
            weather = (
                add_sun(records[k], INTERVAL, request.horizon_cut, own) if code != NOTHING else None
            )
            weathers.append((weather, code))
        return weathers

    label = LABEL if name == "climate" else f"clear sky {request.year} (upper bound)"
    if name == "climate" and off_land == "clear-sky":
        label += f"; where there is no land, clear sky {request.year} (upper bound)"
    # Eight places a task.
    return _Source(places, label, _cut(len(places), 8), read, [])


def grid_source(grid, places, picked, request, years=None):
    """ERA5 on its own grid.

    Parameters
    ----------
    grid : Era5Grid
    places : Places
    picked : tuple of numpy.ndarray
        Rows and columns of the grid that are places.
    request : Request
        Its horizon_cut.
    years : collection of int, optional
        Used ones of the files' coordinates.

    Returns
    -------
    Source
        Its `read` gives each place of a portion Weather and FILES, or None and NOTHING.

    Raises
    ------
    InputError
        The files lack one of the years.
    """
    rows, columns = picked
    width = len(columns)
    # The first place up to 60° of latitude, or at the lowest one, stands for all in the check
    # against the sun.
    suns, checked, nearest = [], [], max(60.0, np.abs(places.latitude).min())
    # Stamps of all files; only the years asked for are kept, and one that no file has is refused.
    stamps = pd.DatetimeIndex(
        np.unique(np.concatenate([one["time"].to_numpy() for one, _ in grid.files]))
    )
    if missing := sorted(set(years or ()) - set(stamps.year)):
        raise InputError(
            "--years", f"{', '.join(map(str, missing))} not in the weather files", "leave them out"
        )
    kept = np.flatnonzero(stamps.year.isin(years)) if years else slice(None)

    # A few neighbouring places at a time: one read of the file, then each place by itself. The sun
    # is computed once for all, and turned to each place.
    def read(chunk):
        """Weather of each place of a portion, with FILES or NOTHING: list of tuples.

        `chunk` are numbers of places on one parallel; the weather is None where files have none.
        """
        row = chunk[0] // width
        # Values of neighbouring places on one parallel, in the years that are kept.
        block = read_block(grid, rows[[row]], columns[[one % width for one in chunk]]).isel(
            latitude=0, time=kept
        )
        found = []
        for number, one in enumerate(chunk):
            table = block.isel(longitude=number).to_dataframe()
            # A place where a needed variable has no value at all has no weather.
            if table[[*NEEDED]].isna().all().any():
                found.append((None, NOTHING))
                continue
            place = latitude, longitude = float(places.latitude[one]), float(places.longitude[one])
            source = f"{grid.source} at {latitude:g}°, {longitude:g}°"
            # The others have ERA5's values as a record, are checked, and get the sun of their
            # place.
            record = Record(
                convert_era5(table), *place, climate.look_up_altitude(*place), source, ""
            )
            interval = check_weather(record)
            suns[:] = suns or [geocentric_sun(record.data.index, interval)]  # once for all places
            own = sun_of_place(suns[0], *place)
            if not checked and abs(latitude) <= nearest:
                # One place stands for the files, as the check takes longer than a place: its sums
                # and times are held against the sun.
                checked.append(one)
                try:
                    check_years(record, interval, own)
                # A cure by an option is replaced, since none changes times and places of a grid.
                except InputError as error:
                    look_at = (
                        "check latitudes and longitudes, and that times are UTC and end the "
                        "interval of each sum, as in ERA5"
                    )
                    raise InputError(
                        error.source, error.problem, look_at if "--" in error.cure else error.cure
                    ) from error
            found.append((add_sun(record, interval, request.horizon_cut, own), FILES))
        return found

    # As many places at a time as fit into the memory that is allowed.
    # About 100 MB of a grid are read at once.
    together = int(max(1, min(360, 100e6 // (8 * 6 * len(stamps)))))
    chunks = [row * width + part for row in range(len(rows)) for part in _cut(width, together)]
    label = f"ERA5 {grid.source}" + (f", years {', '.join(map(str, years))}" if years else "")
    return _Source(places, label, chunks, read, [])


def station_source(weathers, names):
    """Stations, whose files are read already.

    Parameters
    ----------
    weathers : list of Weather
    names : list of str

    Returns
    -------
    Source
    """
    latitude = np.array([weather.latitude for weather in weathers])
    longitude = np.array([(weather.longitude + 180.0) % 360.0 - 180.0 for weather in weathers])
    places = Places(latitude, longitude, names=names)
    label = "; ".join(weather.label for weather in weathers)
    notes = [
        f"{name}: {note}"
        for name, weather in zip(names, weathers, strict=True)
        for note in weather.notes
    ]

    def read(chunk):
        return [(weathers[one], FILES) for one in chunk]

    return _Source(places, label, _cut(len(places), 1), read, notes)


def _cut(count, size):
    """Runs of at most some places: list of (k,) int arrays."""
    return [np.arange(first, min(first + size, count)) for first in range(0, count, size)]
