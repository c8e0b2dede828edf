"""Sums by district and by use for report and solar map, from the tables of result folders."""

import json
from pathlib import Path

import numpy as np
import shapely

from ..read.read_districts import read_districts
from ..settings.errors import InputError
from .districts import on_earth, place_buildings
from .draw_districts import draw_map
from .page import paragraph, section, table
from .read_results import place_of_results, read_results, read_table
from .surfaces_file import GIVE_RESULTS
from .words import number, say

SUMS = ("buildings", "module_count", "module_area", "kwp", "mwh_per_year", "mwh_standard_error")
BORDER = "border_buildings"  # which sums by use have not


def compose_sums(folders, districts=None):
    """Sums by district and by use of result folders, for the report and the solar map; "" without
    any.

    Parameters
    ----------
    folders : list of path-like
    districts : str, optional
        As `text` of `read_districts_of`.
    """
    parts = []
    if rows := read_districts_of(folders, districts):
        words = say(
            "A building counts where most of its area lies. Only buildings of this city model are "
            "summed up; a district may have more."
        )
        sums = _table_of_sums(rows, say("District"))
        parts.append(
            section(say("Sums by district"), draw_map(rows), sums, paragraph(words, "small"))
        )
    if rows := read_uses_of(folders):
        parts.append(section(say("Sums by use"), _table_of_sums(rows, say("Use of the buildings"))))
    return "\n".join(parts)


def read_districts_of(folders, text=None):
    """Sums by district of some folders, a row for each name: list of dict.

    Each has `name`, `shape` in degrees (None of the last, which lies in no district) and sums.
    Errors of several folders, and of buildings that are summed up here, add up: more they cannot
    be.

    Parameters
    ----------
    folders : list of path-like
    text : str, optional
        FILE or FILE:COLUMN with districts in place of districts.geojson.

    Returns
    -------
    list of dict
        Empty where no folder has sums by district.

    Raises
    ------
    InputError
        A file cannot be read, or some of the folders have none.
    """
    if text is None:
        tables = map(_read_shapes, _list_paths(folders, "districts.geojson"))
    else:
        tables = (_sum_buildings(folder, text) for folder in folders)
    # What lies in no district stays the last row.
    rows = _add_rows(row for table in tables for row in table)
    return sorted(rows, key=lambda row: row["shape"] is None)


def read_uses_of(folders, *, most=12):
    """Sums by function of some folders, most energy first, those that are left as one: list of dict
    with `name` and sums.

    Parameters, errors and what errors of several are as of `read_districts_of`.
    """
    tables = [read_table(path, ("function",), SUMS) for path in _list_paths(folders, "uses.csv")]
    rows = _add_rows(
        row | {"name": row["function"] or say("not told")}
        for table in tables
        for row in table[["function", *SUMS]].to_dict("records")
    )
    rows.sort(key=lambda row: -row["mwh_per_year"])
    left = rows[most:] if len(rows) > most + 1 else []
    others = [row | {"name": say("{count} others", count=len(left))} for row in left]
    return rows[: len(rows) - len(left)] + _add_rows(others)


def _table_of_sums(rows, title):
    """A table of sums, whose last row sums up all: str.

    Parameters
    ----------
    rows : list of dict
        Of `read_districts_of` or `read_uses_of`.
    title : str
        What the names are.
    """
    # The column of the sum, its heading and digits, most asked for first, as a phone shows it.
    columns = {
        "mwh_per_year": (say("Energy in a year [MWh]"), ",.0f"),
        "mwh_standard_error": ("± [MWh]", ",.1f"),
        "kwp": (say("Nominal power [kWp]"), ",.0f"),
        "full_load_hours": (say("Full load hours [h]"), ",.0f"),
        "module_count": (say("Modules"), ",.0f"),
        "module_area": (say("Area of modules [m²]"), ",.0f"),
        "buildings": (say("Buildings"), ",.0f"),
        BORDER: (say("on its border"), ",.0f"),
    }
    if BORDER not in rows[0]:
        del columns[BORDER]
    (whole,) = _add_rows(row | {"name": say("All"), "shape": None} for row in rows)
    cells = []
    for row in [*rows, whole | {"mwh_standard_error": None}]:
        hours = 1000 * row["mwh_per_year"] / row["kwp"] if row["kwp"] else None
        values = row | {"full_load_hours": hours}
        numbers = [number(values[name], form) for name, (_, form) in columns.items()]
        cells.append([row["name"], *numbers])
    head = [title, *(heading for heading, _ in columns.values())]
    return table(head, cells, numbers=range(1, len(head)))


def _list_paths(folders, name):
    """Paths of a file in each folder, none where no folder has it: list of Path.

    Raises
    ------
    InputError
        Some have it, and others not.
    """
    paths = [Path(folder) / name for folder in folders]
    missing = [path for path in paths if not path.is_file()]
    if missing and len(missing) < len(paths):
        raise InputError(
            missing[0], "there is no such file, but another folder has one", GIVE_RESULTS
        )
    return [] if missing else paths


def _add_rows(rows):
    """One row for each name, with the sums of its rows, in the order of first names: list of
    dict.
    """
    together = {}
    for row in rows:
        name = row["name"]
        if name not in together:
            together[name] = dict(row)
            continue
        for column in (*SUMS, BORDER):
            if column in row:
                together[name][column] += row[column]
    return list(together.values())


def _read_shapes(path):
    """Rows of districts.geojson: list of dict."""
    with InputError.parsing(path, "cannot be read as sums by district", GIVE_RESULTS):
        features = json.loads(path.read_text("utf-8"))["features"]
        rows = []
        for feature in features:
            own, drawn = feature["properties"], feature["geometry"]
            row = {column: float(own[column]) for column in (*SUMS, BORDER)}
            row["name"] = own["district"] if drawn else say("in no district")
            rows.append(row | {"shape": shapely.geometry.shape(drawn) if drawn else None})
    return rows


def _sum_buildings(folder, text):
    """Rows of buildings.csv summed by district: list of dict, as of `_read_shapes`."""
    results, (site, _) = read_results(folder), place_of_results(folder)
    table = read_table(Path(folder) / "buildings.csv", ("building_id",), SUMS[1:])
    if results.outlines is None:
        raise InputError(folder, "has no shapes of surfaces", "simulate the city again")
    districts = read_districts(text, site, results.outlines.points)
    # Buildings of faces.csv, in alphabetical order as in buildings.csv.
    names, building = np.unique(
        results.faces["building_id"].to_numpy(object).astype(str), return_inverse=True
    )
    place, divided = place_buildings(results.outlines, building, len(names), districts.shapes)
    sums = table.set_index("building_id").reindex(names).assign(buildings=1, place=place)
    sums[BORDER] = divided
    sums = sums.groupby("place")[[*SUMS, BORDER]].sum()
    sums = sums.reindex(range(len(districts.names) + 1), fill_value=0).astype(float)
    named = [*districts.names, say("in no district")]
    shapes = [on_earth(shape, site) for shape in districts.shapes]
    return [
        row | {"name": name, "shape": shape}
        for row, name, shape in zip(sums.to_dict("records"), named, [*shapes, None], strict=True)
    ]
