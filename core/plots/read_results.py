"""Read the files of a result folder that a report is made of."""

import json
from dataclasses import dataclass
from pathlib import Path

import h5netcdf
import numpy as np
import pandas as pd

from ..results.transfer_fields import FORMAT, OUTLINES
from ..scene.outline_surfaces import Outlines
from ..settings.errors import InputError

CURE = "give a folder that citypv simulate or citypv yield has written"
FACE_TEXTS = ("surface_id", "building_id", "kind", "orientation", "eligible")
FACE_NUMBERS = (
    *("area", "surface_azimuth", "covered_share", "full_load_hours"),
    "full_load_hours_standard_error",
)
GROUP_TEXTS = ("kind", "orientation", "period")
GROUP_NUMBERS = ("index", "full_load_hours", "count", "area")
SECTIONS = {  # of summary.json, and what must stand in each
    "input": ("site",),
    "weather": ("label", "ghi_annual", "dhi_annual", "dni_annual"),
    "settings": ("module",),
    "suns": ("way", "count"),
    "error_budget": (),
    "totals": ("eligible_area", "kwp", "mwh_per_year", "area_per_kwp"),
}
TOLERANCE = 0.01  # by which hours in two files of one run may differ: both are rounded


@dataclass
class Results:
    """What the files of a result folder say."""

    name: str  # of the folder
    faces: pd.DataFrame  # faces.csv, a row per surface
    groups: pd.DataFrame  # groups.csv
    summary: dict  # summary.json
    times: pd.DatetimeIndex  # (T,) UTC, start of each interval
    interval: pd.Timedelta
    suns: np.ndarray | None  # (s, 3) unit vectors towards the suns that were traced; None without transfer.nc
    outlines: Outlines | None  # None where transfer.nc is not there, or has none


def read_results(folder):
    """Read a result folder.

    Parameters
    ----------
    folder : path-like

    Returns
    -------
    Results

    Raises
    ------
    InputError
        A file is missing, cannot be read, or belongs to another run than the others.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(folder, "is no folder" if folder.exists() else "there is no such folder", CURE)
    summary = read_summary(folder / "summary.json")
    faces = read_table(folder / "faces.csv", FACE_TEXTS, FACE_NUMBERS)
    groups = read_table(folder / "groups.csv", GROUP_TEXTS, GROUP_NUMBERS)
    if groups.duplicated([*GROUP_TEXTS, "index"]).any():
        raise InputError(folder / "groups.csv", "has two rows for one period of a group", CURE)
    times, interval, sums = read_times(folder / "timeseries.nc")
    compare_hours(folder / "timeseries.nc", groups, sums * (interval / pd.Timedelta(hours=1)), summary)
    suns, outlines = read_shapes(folder / "transfer.nc", faces["surface_id"].tolist())
    name = folder.absolute().name
    return Results(name, faces, groups, summary, times, interval, suns, outlines)


def check_file(path):
    """Refuse a file that is not there."""
    if not path.is_file():
        raise InputError(path, "there is no such file", CURE)


def read_summary(path):
    """Summary of a run: dict."""
    check_file(path)
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(path, f"cannot be read as JSON ({error})", CURE) from error
    missing = list_missing(summary)
    if missing:
        raise InputError(path, f"has no {', '.join(missing)}", CURE)
    return summary


def list_missing(summary):
    """What a summary lacks, by name: list of str."""
    summary = summary if isinstance(summary, dict) else {}
    missing = [name for name in SECTIONS if not isinstance(summary.get(name), dict)]
    parts = {name: keys for name, keys in SECTIONS.items() if name not in missing}
    missing += [f"{name}.{key}" for name, keys in parts.items() for key in keys if summary[name].get(key) is None]
    site = {} if missing else summary["input"]["site"]
    return missing or [f"input.site.{key}" for key in ("latitude", "longitude") if not isinstance(site.get(key), float)]


def read_table(path, texts, numbers):
    """Table with some columns of text and some of numbers; an empty cell is NaN. Other columns stay as they are.

    Raises
    ------
    InputError
        A column is missing, or holds something else.
    """
    check_file(path)
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(texts, str), keep_default_na=False)
    except (ValueError, OSError) as error:
        raise InputError(path, f"cannot be read as a table ({error})", CURE) from error
    missing = [name for name in (*texts, *numbers) if name not in table]
    if missing:
        raise InputError(path, f"has no column {', '.join(missing)}", CURE)
    for name in set(table.columns) - set(texts):
        try:
            table[name] = pd.to_numeric(table[name].where(table[name] != ""))
        except (ValueError, TypeError) as error:
            if name in numbers:
                raise InputError(path, f"column {name} holds something that is no number ({error})", CURE) from error
    return table


def read_times(path):
    """Time axis of timeseries.nc, its interval, and the sum over time of each group's capacity factors."""
    check_file(path)
    try:
        with h5netcdf.File(path) as file:
            bounds = np.asarray(file["time_bounds"][:], np.int64)  # (T, 2) [s] since 1970
            factors = np.asarray(file["capacity_factor"][:], float)  # (T, g)
            names = read_texts(file["group"])
    except (OSError, KeyError, IndexError, ValueError) as error:
        raise InputError(path, f"cannot be read as a time series of CityPV ({error})", CURE) from error
    if len(bounds) == 0:
        raise InputError(path, "holds no times", CURE)
    times = pd.to_datetime(bounds[:, 0], unit="s", utc=True)
    interval = pd.Timedelta(seconds=int(bounds[0, 1] - bounds[0, 0]))
    return times, interval, pd.Series(factors.sum(axis=0), index=names)


def read_texts(variable):
    """Texts of an open NetCDF file: list of str."""
    return [text.decode() if isinstance(text, bytes) else str(text) for text in variable[:]]


def compare_hours(path, groups, hours, summary):
    """Refuse a time series whose sums are not the annual hours of groups.csv."""
    years = summary["weather"].get("years") or 1.0
    annual = groups[groups["period"] == "annual"]
    expected = dict(zip(annual["kind"] + "_" + annual["orientation"], annual["full_load_hours"], strict=True))
    same = set(expected) == set(hours.index)
    if not same or any(
        abs(hours[name] / years - value) > TOLERANCE * max(value, 1) for name, value in expected.items()
    ):
        raise InputError(path, "does not belong to the groups.csv beside it", CURE)


def read_shapes(path, surface_id):
    """Directions of the traced suns and outlines of the surfaces, without the large matrices.

    Parameters
    ----------
    path : pathlib.Path
        transfer.nc, which may not be there.
    surface_id : list of str
        Of faces.csv.

    Returns
    -------
    suns : (s, 3) numpy.ndarray or None
    outlines : Outlines or None
    """
    if not path.exists():
        return None, None
    try:
        with h5netcdf.File(path) as file:
            if file.attrs.get("title") != FORMAT:
                raise InputError(path, f"is no file of the format {FORMAT!r}", CURE)
            suns, names = np.asarray(file["direction"][:], float), read_texts(file["surface_id"])
            known = set(OUTLINES) <= set(file.variables)
            outlines = Outlines(*(np.asarray(file[name][:]) for name in OUTLINES)) if known else None
    except (OSError, KeyError, IndexError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(path, f"cannot be read as a Transfer ({error})", CURE) from error
    if names != surface_id or (outlines is not None and len(outlines.surface_start) != len(names) + 1):
        raise InputError(path, "does not belong to the faces.csv beside it", CURE)
    return suns, outlines
