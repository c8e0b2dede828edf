"""The numbers that are drawn and listed: tables made of groups.csv and faces.csv."""

import numpy as np
import pandas as pd

from ..energy.counted_area import KINDS, ORIENTATIONS
from ..racks.rack_names import find_racked_roofs

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
TITLES = {
    "facade": "Facades",
    "roof": "Pitched roofs",
    "rack": "Racks on flat roofs",
    "flat": "Flat roofs, modules lying flat",
}
MOST_BINS = 40
BIN_WIDTHS = (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500)  # [h]
HALF = 0.5  # of a flat roof: covered by more than this, no modules lie on it
SMALLEST = 6.25  # [m²] of a flat roof that modules lie on
ERROR = "full_load_hours_standard_error"


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
        Kind → hours by index (rows) and orientation (columns), both in their usual order. Empty where the file has no
        such period.
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
    """The different names, those of a given order first, others behind them by the alphabet: list of str."""
    found = set(names)
    return [name for name in order if name in found] + sorted(found - set(order))


def tabulate_groups(groups, faces):
    """The groups with their annual full load hours and the standard error of those.

    The error stands in groups.csv or, in files without it, is that of a mean over surfaces whose errors are
    independent: √(Σ (A·σ)²) / Σ A.

    Parameters
    ----------
    groups : pandas.DataFrame
    faces : pandas.DataFrame

    Returns
    -------
    pandas.DataFrame
        kind, orientation, count, area [m²], full_load_hours [h], error [h] (NaN: unknown) and, where groups.csv has it,
        specific_yield [kWh/kWp].
    """
    table = groups[groups["period"] == "annual"].copy()
    if ERROR in table:
        table["error"] = table[ERROR]
    else:
        table["error"] = [
            error_of_mean(faces, kind, orientation, area)
            for kind, orientation, area in zip(table["kind"], table["orientation"], table["area"], strict=True)
        ]
    columns = ["kind", "orientation", "count", "area", "full_load_hours", "error"]
    return table[columns + [name for name in ("specific_yield",) if name in table]].reset_index(drop=True)


def error_of_mean(faces, kind, orientation, area):
    """Standard error [h] of a group's mean over an area [m²] that counts."""
    own = faces[(faces["eligible"] == "true") & (faces["kind"] == kind) & (faces["orientation"] == orientation)]
    return float(np.sqrt(((own["area"] * own[ERROR]) ** 2).sum(skipna=False)) / area) if area > 0 else np.nan


def select_mounted(faces):
    """Surfaces that modules may lie on, with the area that is open and the hours there.

    Parameters
    ----------
    faces : pandas.DataFrame

    Returns
    -------
    pandas.DataFrame
        kind, area [m²] that is open, full_load_hours [h] of that area; eligible surfaces, and flat roofs without racks.
        The rows keep the index of `faces`.
    """
    flat = (faces["kind"] == "flat") & (faces["area"] >= SMALLEST) & (faces["covered_share"] <= HALF)
    flat &= ~find_racked_roofs(faces["surface_id"].tolist(), faces["kind"])
    chosen = faces[((faces["eligible"] == "true") | flat) & faces["full_load_hours"].notna()]
    open_area = chosen["open_area"] if "open_area" in chosen else chosen["area"]
    chosen, open_area = chosen[open_area > 0], open_area[open_area > 0]
    # Hours of faces.csv are means over the whole polygon, covered parts with zero.
    hours = chosen["full_load_hours"] * chosen["area"] / open_area
    return pd.DataFrame({"kind": chosen["kind"], "area": open_area, "full_load_hours": hours})


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
    width = next((step for step in BIN_WIDTHS if highest / step <= MOST_BINS), BIN_WIDTHS[-1])
    edges = np.arange(int(highest // width) + 2) * float(width)
    areas = {}
    for kind in in_order(mounted["kind"], (*KINDS, "flat")):
        own = mounted[mounted["kind"] == kind]
        areas[kind] = np.histogram(own["full_load_hours"], edges, weights=own["area"])[0]
    return edges, areas


def kind_title(kind):
    """Heading of a kind of surfaces."""
    return TITLES.get(kind, kind.capitalize())
