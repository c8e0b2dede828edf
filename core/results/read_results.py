"""Read the files of a result folder that a report is made of, and the tables that are drawn and
listed from them.
"""

import json
from collections import Counter
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

import h5netcdf
import numpy as np
import pandas as pd

from ..city.build_ground import Lattice
from ..city.building_facts import FACTS
from ..city.classify import ORIENTATIONS
from ..city.grid_cells import Outlines
from ..city.site import Site
from ..energy.counted_area import CHOSEN, REASONS
from ..energy.pv_system import KINDS
from ..modules.lay_modules import ModuleLayout
from ..read.netcdf_file import refuse_links
from ..settings.errors import InputError, id_of_cell
from .columns import IDS
from .surfaces_file import (
    AGAIN,
    GIVE_RESULTS,
    MONTHLY,
    check_names,
    open_surfaces,
    read_layout,
    zone_of_hours,
)
from .transfer_file import read_fields

FACE_TEXTS = ("surface_id", "building_id", "kind", "orientation", "eligible")
FACE_TEXTS += ("reason", "reason_note")
FACE_NUMBERS = ("area", "open_area", "kwp", "module_count", "surface_tilt", "surface_azimuth")
FACE_NUMBERS += ("sky_view_factor", "full_load_hours", "full_load_hours_standard_error")
BUILDING_SUMS = ("kwp", "mwh_per_year", "mwh_standard_error")
GROUP_TEXTS = ("kind", "orientation", "period")

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
WORDS = {  # kind -> one, several, what bounds it
    "facade": ("Facade", "Facades", " (upright within 1°)"),
    "roof": ("Pitched roof", "Pitched roofs", " (15° to 60°)"),
    "flat": ("Flat roof", "Flat roofs", " (below 15°)"),
    "steep": ("Steep roof", "Steep roofs", " (above 60°)"),
    "downward": ("Underside", "Undersides", ""),
    "ground": ("Ground", "Ground", ""),
    "rack": ("Rack on a flat roof", "Racks on flat roofs", ""),
}
BIN_WIDTHS = (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500)  # [h]


@dataclass
class Results:
    """What the files of a result folder say."""

    name: str  # of the folder
    faces: pd.DataFrame  # of `count_faces`, a row per surface
    groups: pd.DataFrame  # groups.csv
    summary: dict  # summary.json
    times: pd.DatetimeIndex  # (T,) UTC, start of each interval
    interval: pd.Timedelta
    suns: np.ndarray  # (s, 3) unit vectors towards the suns that were traced
    outlines: Outlines | None  # None where the light comes from a file without them
    months: np.ndarray  # (n, 12) [h] full load hours of each surface by month
    layout: ModuleLayout | None = None  # where modules lie; None: every square metre counts
    # a row per building: building, address, name, function, year, texts, "" where nothing is told;
    # kwp, mwh_per_year and mwh_standard_error, NaN where they are not known
    buildings: pd.DataFrame | None = None
    folder: Path | None = None
    zone: str = ""  # of the hours of the day of buildings; "" where they are not known


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
    # All files of a run must be there.
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(
            folder, "is no folder" if folder.exists() else "there is no such folder", GIVE_RESULTS
        )
    for name in ("summary.json", "faces.csv", "groups.csv", "timeseries.nc"):
        if not (folder / name).is_file():
            raise InputError(folder / name, "there is no such file", GIVE_RESULTS)
    # Tables, with columns and types checked; each group has one row a period.
    summary = read_summary(folder / "summary.json")
    path = folder / "faces.csv"
    faces = count_faces(path, read_table(path, FACE_TEXTS, FACE_NUMBERS), summary)
    groups = read_table(
        folder / "groups.csv",
        GROUP_TEXTS,
        ("index", "full_load_hours", "count", "area", "full_load_hours_standard_error"),
    )
    if groups.duplicated([*GROUP_TEXTS, "index"]).any():
        raise InputError(
            folder / "groups.csv", "has two rows for one period of a group", GIVE_RESULTS
        )
    # Times of the series; shapes, suns and months, which must be of the same surfaces as faces.csv.
    axis = _read_times(folder / "timeseries.nc")
    with open_surfaces(folder) as file:
        outlines = Outlines(**found) if (found := read_fields(file, "outlines")) else None
        suns, months = (np.asarray(file[name][:], float) for name in ("direction", MONTHLY))
        check_names(folder, file["surface_id"][:], faces["surface_id"].tolist())
        read, zone = (suns, outlines, months, read_layout(file)), zone_of_hours(file)
    # A missing buildings.csv, as in earlier versions, leaves texts and sums of buildings empty.
    read = *read, _read_buildings(folder / "buildings.csv", faces), folder, zone
    return Results(folder.absolute().name, faces, groups, summary, *axis, *read)


def _read_buildings(path, faces):
    """What is told of the buildings of faces.csv, and their sums, as of Results; nothing in folders
    of earlier versions.
    """
    table = pd.DataFrame({"building_id": []})
    if path.is_file():
        texts = {"building_id": str, **dict.fromkeys(FACTS, str)}
        columns = {*texts, *BUILDING_SUMS}
        try:
            table = pd.read_csv(
                path, usecols=columns.__contains__, dtype=texts, keep_default_na=False
            )
        except (ValueError, OSError) as error:
            raise InputError(path, f"cannot be read as a table ({error})", GIVE_RESULTS) from error
    known = [name for name in (*FACTS, "building_id") if name in table]
    table = check_columns(path, table, known, ()).set_index("building_id")
    names = sorted(set(faces["building_id"]))
    table = table.reindex(names, columns=[*FACTS, *BUILDING_SUMS])
    return table.fillna(dict.fromkeys(FACTS, "")).rename_axis("building").reset_index()


def town_of(addresses):
    """The town of most addresses, each "street number, town; …"; "" where fewer than half tell
    it.
    """
    towns = Counter(
        address.split("; ")[0].rpartition(", ")[2] for address in addresses if ", " in address
    )
    told = sum(1 for address in addresses if address)
    town, count = next(iter(towns.most_common(1)), ("", 0))
    return town if 2 * count > told else ""


def read_summary(path):
    """Summary of a run: dict; refused where it is no JSON or lacks what the pages need."""
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        # Of summary.json, and what must stand in each.
        sections = {
            "input": ("site", "surfaces"),
            "weather": ("label", "ghi_annual", "dhi_annual", "dni_annual"),
            "settings": ("module", "mounting", "sectors", "hidden_walls", "usable"),
            "suns": ("way", "count"),
            "error_budget": ("unit",),
            "totals": (
                "eligible_area",
                "kwp",
                "mwh_per_year",
                "area_per_kwp",
                "kinds",
                "without_modules",
                "dark",
            ),
        }
        told = {
            (name, key): summary.get(name, {}).get(key)
            for name, keys in sections.items()
            for key in keys
        }
        # The error names entries that are missing or null; without any, a latitude or longitude
        # that is no number.
        missing = [".".join(names) for names, value in told.items() if value is None]
        site = {} if missing else summary["input"]["site"]
        missing = missing or [
            f"input.site.{key}"
            for key in ("latitude", "longitude")
            if not isinstance(site.get(key), Real)
        ]
    except (ValueError, AttributeError) as error:
        raise InputError(
            path, f"cannot be read as the summary of a run ({error})", GIVE_RESULTS
        ) from error
    if missing:
        raise InputError(path, f"has no {', '.join(missing)}", AGAIN)
    return summary


def place_of_results(folder):
    """Where the city of an earlier run stands, and on which squares of generated ground.

    Parameters
    ----------
    folder : path-like

    Returns
    -------
    site : Site
    lattice : Lattice or None

    Raises
    ------
    InputError
        The folder holds no results.
    """
    path = Path(folder) / "summary.json"
    if not path.is_file():
        raise InputError(path, "there is no such file", GIVE_RESULTS)
    read = read_summary(path)["input"]
    site = Site(**read["site"] | {"origin": tuple(read["site"]["origin"])})
    ground = read.get("ground_squares")
    if ground is None:
        return site, None
    return site, Lattice(
        np.array(ground["low"]),
        np.array(ground["high"]),
        ground["step"],
        ground["patch_size"],
        site,
    )


def read_table(path, texts, numbers):
    """Table with some columns of text and some of numbers; an empty cell is NaN. Other columns stay
    as they are.

    Raises
    ------
    InputError
        A column is missing, or holds something else.
    """
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(texts, str), keep_default_na=False)
    except (ValueError, OSError) as error:
        raise InputError(path, f"cannot be read as a table ({error})", GIVE_RESULTS) from error
    return check_columns(path, table, texts, numbers)


def read_run_table(path):
    """A table of a run, whose name is one of the following, with all its columns."""
    texts = {
        "faces.csv": FACE_TEXTS,
        "groups.csv": GROUP_TEXTS,
        "buildings.csv": ("building_id",),
        "districts.csv": ("district",),
    }
    return read_table(path, texts[Path(path).name], ())


def check_columns(path, table, texts, numbers):
    """The table, all columns but texts as numbers; parameters and errors as of `read_table`."""
    missing = [name for name in (*texts, *numbers) if name not in table]
    if missing:
        raise InputError(path, f"has no column {', '.join(missing)}", AGAIN)
    for name in set(IDS) & set(table.columns):
        table[name] = [id_of_cell(str(cell)) for cell in table[name]]
    for name in set(table.columns) - {*texts, *IDS}:
        try:
            table[name] = pd.to_numeric(table[name].where(table[name] != ""))
        except (ValueError, TypeError) as error:
            if name in numbers:
                raise InputError(
                    path, f"column {name} holds something that is no number ({error})", GIVE_RESULTS
                ) from error
    return table


def count_faces(path, faces, summary):
    """Rows of faces.csv with `counted_area` [m²], on which modules are or, but for the user's
    choice, would be; else 0.

    Raises
    ------
    InputError
        A reason is not known.
    """
    unknown = sorted(set(faces["reason"]) - {"", *REASONS})
    if unknown:
        raise InputError(path, f"has the reason {unknown[0]!r}, which is not known", AGAIN)
    whole = summary["settings"]["hidden_walls"] == "count"
    area = faces["area" if whole else "open_area"]
    return faces.assign(counted_area=area.where(faces["reason"].isin(["", *CHOSEN]), 0.0))


def _read_times(path):
    """Time axis of timeseries.nc, and its interval."""
    with InputError.parsing(path, "cannot be read as a time series of CityPV", GIVE_RESULTS):
        refuse_links(path)
        with h5netcdf.File(path) as file:
            bounds = np.asarray(file["time_bounds"][:], np.int64).reshape(-1, 2)  # [s] since 1970
    if len(bounds) == 0:
        raise InputError(path, "holds no times", GIVE_RESULTS)
    times = pd.to_datetime(bounds[:, 0], unit="s", utc=True)
    return times, pd.Timedelta(seconds=int(bounds[0, 1] - bounds[0, 0]))


def tabulate_periods(groups, period):
    """Full load hours of each group in the months or hours.

    Parameters
    ----------
    groups : pandas.DataFrame
        groups.csv.
    period : str
        "month", "hour", "solar_hour" or "year".

    Returns
    -------
    dict of str to pandas.DataFrame
        Kind → hours by index (rows) and orientation (columns), both in their usual order. Empty
        where the file has no such period.
    """
    rows = groups[groups["period"] == period]
    tables = {}
    for kind in in_order(rows["kind"], KINDS):
        own = rows[rows["kind"] == kind]
        table = own.pivot_table("full_load_hours", "index", "orientation")
        table.index = table.index.astype(int)
        tables[kind] = table[in_order(table.columns, ORIENTATIONS)]
    return tables


def in_order(names, order):
    """The different names, first in a given order, the rest by the alphabet: list of str."""
    different = set(names)
    return [name for name in order if name in different] + sorted(different - set(order))


def select_mounted(faces):
    """Surfaces that carry modules, with the area that counts and the hours there.

    Parameters
    ----------
    faces : pandas.DataFrame
        Of `count_faces`.

    Returns
    -------
    pandas.DataFrame
        kind, area [m²] that counts, full_load_hours [h] of that area. The rows keep the index of
        `faces`.
    """
    chosen = faces[faces["reason"] == ""]
    # Hours of faces.csv are means over the whole polygon, covered parts with zero.
    hours = chosen["full_load_hours"] * chosen["area"] / chosen["counted_area"]
    return pd.DataFrame(
        {"kind": chosen["kind"], "area": chosen["counted_area"], "full_load_hours": hours}
    )


def tabulate_histograms(mounted):
    """Area by full load hours, for each kind.

    Parameters
    ----------
    mounted : pandas.DataFrame
        From `select_mounted`.

    Returns
    -------
    edges : (b + 1,) numpy.ndarray
        Bounds of the bins [h], the same for all kinds.
    areas : dict of str to (b,) numpy.ndarray
        Kind → area in each bin [m²].
    """
    highest = mounted["full_load_hours"].max() if len(mounted) else 1.0
    width = next((step for step in BIN_WIDTHS if highest / step <= 40), BIN_WIDTHS[-1])
    edges = np.arange(int(highest // width) + 2) * float(width)
    areas = {}
    for kind in in_order(mounted["kind"], KINDS):
        own = mounted[mounted["kind"] == kind]
        areas[kind] = np.histogram(own["full_load_hours"], edges, weights=own["area"])[0]
    return edges, areas


def kind_title(kind):
    """Heading of a kind of surfaces."""
    return WORDS[kind][1]
