"""What report and solar map show of each surface: one description of its columns, their values from
faces.csv, and the scales of their colours.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from ..energy.counted_area import REASONS
from .colour_map import DIVERGING, GROUND, MAPS, MISSING, choose_range
from .columns import COLUMNS
from .read_results import MONTHS, WORDS, select_mounted
from .supply_curve import sum_by_hours, supply_curve
from .words import say

FLAT = "modules lie flat; not among the totals of the city"


class _Viewed(NamedTuple):
    """One column of the viewers."""

    name: str
    meaning: str = ""  # with its unit, in the tiles of the map
    source: str = ""  # column of `count_faces` with the same values
    title: str = ""  # of the fact that is shown of a surface that is clicked; "" if none is
    unit: str = ""  # behind the fact's number
    digits: int = 0
    error: str = ""  # column of its standard error
    mounted: bool = False  # whether it is shown of surfaces with modules alone
    plus: str = ""  # before numbers above zero
    unknown: str = "–"  # in place of NaN


VIEWED = (
    _Viewed("tilt", "tilt from the horizontal [degree]", "surface_tilt", "Tilt", "°", 1),
    _Viewed(
        "azimuth",
        "azimuth clockwise from true north [degree]",
        source="surface_azimuth",
        title="Azimuth",
        unit="°",
        digits=1,
    ),
    _Viewed("area", "area without holes [m2]", "area", "Area", " m²", 2),
    _Viewed(
        "counted",
        "area that counts [m2]",
        source="counted_area",
        title="Area that counts",
        unit=" m²",
        digits=2,
        mounted=True,
    ),
    _Viewed(
        "kwp",
        "nominal power of modules on the area that counts [kWp]",
        source="kwp",
        title="Power",
        unit=" kWp",
        digits=2,
        mounted=True,
    ),
    _Viewed(
        "modules",
        "number of modules",
        source="module_count",
        title="Modules",
        mounted=True,
    ),
    _Viewed(
        "hours",
        "full load hours per year of the area that counts [h]",
        title="Full load hours",
        unit=" h",
        digits=1,
        error="error",
    ),
    _Viewed("error", "standard error of the full load hours [h]"),
    # The page itself multiplies power by hours.
    _Viewed("energy", title="Energy in a year", unit=" kWh", error="energy_error", mounted=True),
    _Viewed(
        "change",
        title="Change of the hours",
        unit=" h",
        digits=1,
        error="change_error",
        mounted=True,
        plus="+",
        unknown="new",
    ),
    _Viewed("sky", "sky view factor", "sky_view_factor", "Sky view factor", digits=3),
    _Viewed("month", "full load hours of the month, UTC [h]"),
    _Viewed("building", "number of the building in this map"),
    _Viewed("reason", "why the surface does not count"),
)


def describe_view(kinds, sides, layers, supply, totals):
    """What the page must know to show any surface, and all of them: dict.

    `supply` is of `sum_counting`, `totals` of summary.json: the curve begins with the sums that
    stand there.
    """
    curve = supply_curve(supply)
    for name, column in (("kwp", "kwp"), ("mwh", "mwh_per_year")):
        facades = totals["kinds"].get("facade", {}).get(column, 0.0)
        curve["facades"][name][0] = facades
        curve["roofs"][name][0] = totals[column] - facades
    return {
        "kinds": [
            {"name": name, "single": say(WORDS[name][0]), "many": say(WORDS[name][1])}
            for name in kinds
        ],
        "sides": sides,
        "columns": [
            column._asdict() | {"title": say(column.title), "unknown": say(column.unknown)}
            for column in VIEWED
            if column.title
        ],
        "reasons": ["", say(FLAT), *map(say, REASONS.values())],
        "months": [say(month) for month in MONTHS],
        "layers": layers,
        "supply": curve,
        "missing": f"#{MISSING}",
        "ground": f"#{GROUND}",
    }


def measure_faces(faces, months):
    """Numbers of each surface.

    Parameters
    ----------
    faces : pandas.DataFrame
        Of `count_faces`.
    months : (n, 12) float [h]

    Returns
    -------
    mounted : pandas.DataFrame
        Of `select_mounted`.
    values : dict of (n,) arrays
        `reason` (int): place in the header's reasons of what is to be said of the surface, 0 if it
        counts, 1 if it does beside the totals. All others are float; hours of surfaces that carry
        modules hold for the area that counts.
    """
    mounted = select_mounted(faces)
    area, hours = faces["area"].to_numpy(float), faces["full_load_hours"].to_numpy(float)
    counted = faces["counted_area"].to_numpy(float)
    carries, counts = (faces["reason"] == "").to_numpy(), counted > 0
    # Hours of faces.csv are means over the whole polygon, covered parts with zero.
    spread = np.where(counts, area / np.where(counts, counted, 1.0), 1.0)
    values = {
        "reason": np.where(
            carries,
            faces["eligible"] != "true",
            pd.Index(REASONS).get_indexer(faces["reason"]) + 2,
        ),
        **{column.name: faces[column.source].to_numpy(float) for column in VIEWED if column.source},
        "hours": hours * spread,
        "error": faces["full_load_hours_standard_error"].to_numpy(float) * spread,
    }
    months = np.where(carries, months.T * spread, np.nan)
    return mounted, values | {f"month_{number:02d}": own for number, own in enumerate(months, 1)}


def sum_counting(kind, values):
    """Power and energy of the surfaces in the totals, of kinds (n,) str and `values` of
    `measure_faces`, by their hours: as of `sum_by_hours`.
    """
    rows = values["reason"] == 0
    # As the page has them, so that the slider greys exactly what the curve leaves out.
    hours = values["hours"][rows].astype(np.float32).astype(float)
    return sum_by_hours(kind[rows], hours, values["kwp"][rows])


def list_layers(values, mounted):
    """What the city can be coloured by: list of dict.

    Each has the name of its values, title, unit, colours, their lowest and highest value and, if a
    month, the lowest and highest of all months. What is unknown of all surfaces is left out.
    """
    # Titles and units as in the tables; limits of colours from what carries modules, by area, but
    # of energy by number.
    titles = {column.name: (column.title, column.legend_unit) for column in COLUMNS if column.title}
    rows = mounted.index.to_numpy()
    area = values["counted"][rows]
    ranges = {name: choose_range(array[rows], area) for name, array in values.items()}
    ranges["energy"] = choose_range((values["kwp"] * values["hours"])[rows], np.ones(len(rows)))
    months = [name for name in values if name.startswith("month_")]
    words = {
        "hours": titles["full_load_hours"],
        "error": titles["full_load_hours_standard_error"],
        "energy": ("Energy of the surface", "kWh per year"),
        "sky": titles["sky_view_factor"],
    }
    words |= {
        name: (say("Full load hours in {month}", month=say(MONTHS[int(name[-2:]) - 1])), "h")
        for name in months
    }
    # Months share one scale, so that they can be compared.
    every = np.concatenate([values[name][rows] for name in months])
    shared = dict.fromkeys(months, choose_range(every, np.tile(area, len(months))))
    # A change has a scale with zero in its middle, from what changed for certain.
    if "change" in values:
        words = {"change": ("Change of the full load hours", "h per year")} | words
        known = rows[np.abs(values["change"][rows]) > 2 * values["change_error"][rows]]
        most = max(map(abs, choose_range(values["change"][known], values["counted"][known])))
        ranges["change"] = -most, most
    stops = {
        name: [f"#{stop}" for stop in text.split()]
        for name, text in (MAPS | {"change": DIVERGING}).items()
    }
    return [
        {
            "name": name,
            "title": say(title),
            "unit": say(unit),
            "range": ranges[name],
            "shared": shared.get(name),
            "stops": stops["change" if name == "change" else "viridis"],
        }
        for name, (title, unit) in words.items()
        if name in ("hours", "energy") or np.isfinite(values[name]).any()
    ]
