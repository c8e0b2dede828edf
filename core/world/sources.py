"""Weather of many places: the built-in climate, the clear sky, ERA5 on a grid, or station files."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..climate.climate_grid import look_up_normals
from ..climate.make_climates import INTERVAL, look_up_altitude, make_climates
from ..settings.errors import InputError
from ..sun.sun_of_places import geocentric_sun, sun_of_place
from ..weather.add_sun import add_sun
from ..weather.check_weather import check_weather
from ..weather.check_years import check_years
from ..weather.clear_sky import clear_sky
from ..weather.climate import LABEL, NAMES
from ..weather.record import Record
from .places import Places
from .read_era5_grid import point_of_block, read_block

NOTHING, CLIMATE, CLEAR, FILES = 0, 1, 2, 3  # what the weather of a place is
MEANINGS = {NOTHING: "none", CLIMATE: "built_in_climate", CLEAR: "clear_sky", FILES: "files"}
STAMPS = "check latitudes and longitudes, and that times are UTC and end the interval of each sum, as in ERA5"
AT_ONCE = 8  # places of a task
CHECKED = 60.0  # [°] of latitude up to which a place stands for its files in the check against the sun, if there is one


@dataclass
class Source:
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
        Its year, seed and horizon_cut.
    off_land : {"blank", "clear-sky"}
        Where the climate has no land.

    Returns
    -------
    Source
    """
    times = pd.date_range(f"{request.year}-01-01", f"{request.year + 1}-01-01", freq="h", inclusive="left", tz="UTC")
    sun = geocentric_sun(times, INTERVAL)

    def read(chunk):
        suns = [sun_of_place(sun, places.latitude[one], places.longitude[one]) for one in chunk]
        land = [name == "climate" and has_climate(places, one) for one in chunk]
        records = climate_records(places, chunk, land, suns, request)
        found = []
        for one, own, known in zip(chunk, suns, records, strict=True):
            latitude, longitude = places.latitude[one], places.longitude[one]
            if known is not None:
                found.append((add_sun(known, INTERVAL, request.horizon_cut, own), CLIMATE))
            elif name == "climate" and off_land == "blank":
                found.append((None, NOTHING))
            else:
                clear = clear_sky(latitude, longitude, look_up_altitude(latitude, longitude), request.year, sun=own)
                found.append((add_sun(clear, INTERVAL, request.horizon_cut, own), CLEAR))
        return found

    label = LABEL if name == "climate" else f"clear sky {request.year} (upper bound)"
    if name == "climate" and off_land == "clear-sky":
        label += f"; where there is no land, clear sky {request.year} (upper bound)"
    return Source(places, label, cut(len(places), AT_ONCE), read, [])


def has_climate(places, one):
    """Whether the built-in climate knows a place."""
    return look_up_normals(places.latitude[one], places.longitude[one]) is not None


def climate_records(places, chunk, land, suns, request):
    """Records of the built-in climate, None off land."""
    chosen = [number for number, on in enumerate(land) if on]
    records = [None] * len(chunk)
    if not chosen:
        return records
    latitude, longitude = (axis[[chunk[number] for number in chosen]] for axis in (places.latitude, places.longitude))
    zenith = np.stack([suns[number]["apparent_zenith"].to_numpy() for number in chosen])
    made = make_climates(latitude, longitude, request.year, request.seed, zenith)
    for row, number in enumerate(chosen):
        data = pd.DataFrame({name: made[name][row] for name in NAMES}, index=made["times"])
        altitude = look_up_altitude(latitude[row], longitude[row])
        records[number] = Record(data, latitude[row], longitude[row], altitude, "climate", LABEL)
    return records


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
        Those used, of the files'.

    Returns
    -------
    Source
    """
    rows, columns = picked
    width = len(columns)
    suns, checked, nearest = {}, [], max(CHECKED, np.abs(places.latitude).min())

    def read(chunk):
        row = chunk[0] // width
        block = read_block(grid, slice(rows[row], rows[row] + 1), columns[[one % width for one in chunk]])
        found = []
        for number, one in enumerate(chunk):
            data = point_of_block(block, 0, number, grid.times, grid.rates)
            if data is None:
                found.append((None, NOTHING))
                continue
            latitude, longitude = float(places.latitude[one]), float(places.longitude[one])
            source = f"{grid.source} at {latitude:g}°, {longitude:g}°"
            record = Record(
                keep_years(data, years), latitude, longitude, look_up_altitude(latitude, longitude), source, ""
            )
            interval = check_weather(record)
            key = (len(record.data), record.data.index[0])
            if key not in suns:
                suns[key] = geocentric_sun(record.data.index, interval)
            own = sun_of_place(suns[key], latitude, longitude)
            if not checked and abs(latitude) <= nearest:
                checked.append(one)  # the first place stands for the files: the check takes longer than a place
                check_grid_years(record, interval, own)
            found.append((add_sun(record, interval, request.horizon_cut, own), FILES))
        return found

    chunks = [row * width + part for row in range(len(rows)) for part in cut(width, block_width(grid))]
    label = f"ERA5 {grid.source}" + (f", years {', '.join(map(str, years))}" if years else "")
    return Source(places, label, chunks, read, [])


def check_grid_years(record, interval, position):
    """`check_years`, with a cure that a grid allows: its times and places cannot be changed by options."""
    try:
        check_years(record, interval, position)
    except InputError as error:
        cure = STAMPS if "--" in error.cure else error.cure
        raise InputError(error.source, error.problem, cure) from error


def block_width(grid, most=100e6):
    """Points that are read at once: some 100 MB."""
    return int(max(1, min(360, most // (4 * 6 * len(grid.times)))))


def keep_years(data, years):
    """Rows of some calendar years of the files' stamps, which end the intervals."""
    if not years:
        return data
    year = (data.index + (data.index[1] - data.index[0])).year
    inside, missing = np.isin(year, list(years)), sorted(set(years) - set(year))
    if missing:
        raise InputError("--years", f"{', '.join(map(str, missing))} not in the weather files", "leave them out")
    return data[inside]


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
    latitude = np.array([one.latitude for one in weathers])
    longitude = np.array([(one.longitude + 180.0) % 360.0 - 180.0 for one in weathers])
    places = Places(latitude, longitude, names=names)
    label = "; ".join(one.label for one in weathers)
    notes = [f"{name}: {note}" for name, one in zip(names, weathers, strict=True) for note in one.notes]

    def read(chunk):
        return [(weathers[one], FILES) for one in chunk]

    return Source(places, label, cut(len(places), 1), read, notes)


def cut(count, size):
    """Runs of at most some places: list of (k,) int arrays."""
    return [np.arange(first, min(first + size, count)) for first in range(0, count, size)]
