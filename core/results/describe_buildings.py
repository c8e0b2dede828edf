"""What the page of a building says beside its surfaces: its place and sums as in buildings.csv, and
its power by month and hour of the day as in surfaces.nc.
"""

import base64

import numpy as np
import pandas as pd

from ..settings.errors import InputError
from .describe_errors import LIMITS, SPREAD
from .read_results import check_columns
from .surfaces_file import GIVE_RESULTS, check_names, open_surfaces, read_hours
from .words import read_html, say

SUMS = tuple(  # with the errors of sums of light that surfaces share
    f"{part}{name}"
    for part in ("", "facade_", "roof_", "flat_roof_")
    for name in ("module_area", "kwp", "mwh_per_year", "mwh_standard_error")
)


def describe_buildings(folder):
    """What is said of each building of a result folder, some thousand at a time: yields (name,
    dict).

    Parameters
    ----------
    folder : pathlib.Path
        Folders of earlier versions have no power by hours, and those without buildings.csv nothing.

    Yields
    ------
    str
        Building, as in faces.csv.
    dict
        latitude and longitude [°], module_count, sums as in buildings.csv,
        mwh_dc_per_year; `peak` [kW], the highest mean power of an hour of the day in a month, and
        `hours`, base64 of 288 bytes, the power of each of them in 255ths of it, months one after
        the other.

    Raises
    ------
    InputError
        A file cannot be read, or the two do not belong together.
    """
    path, first = folder / "buildings.csv", 0
    if not path.is_file():
        return
    rows = {"dtype": {"building_id": str}, "keep_default_na": False}
    try:
        with open_surfaces(folder) as file, pd.read_csv(path, chunksize=5_000, **rows) as tables:
            for table in tables:
                columns = _pick_columns(path, table)
                names = columns.pop("building_id")
                hours = read_hours(file, first, first + len(names))
                if hours is not None:
                    check_names(folder, hours[0], names)
                    columns |= _pack_hours(hours[1])
                first += len(names)
                # What is not known is left out, so that a page says nothing of it.
                for name, *values in zip(names, *columns.values(), strict=True):
                    pairs = zip(columns, values, strict=True)
                    yield name, {key: one for key, one in pairs if pd.notna(one)}
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read as a table ({error})", GIVE_RESULTS) from error


def _pick_columns(path, table):
    """Columns of some rows of buildings.csv that pages show: dict of lists."""
    numbers = ("latitude", "longitude", "module_count", "mwh_dc_per_year", *SUMS)
    wanted = ["building_id", *numbers]
    table = table[[name for name in wanted if name in table]]
    table = check_columns(path, table, ("building_id",), numbers)
    return {name: table[name].tolist() for name in wanted}


def _pack_hours(power):
    """Columns `peak` and `hours` of power (b, 12, 24) [kW]."""
    peak = power.max(axis=(1, 2), initial=0.0)
    share = power / np.maximum(peak, np.finfo(np.float32).tiny)[:, None, None]
    packed = [base64.b64encode(own.tobytes()) for own in np.rint(255 * share).astype(np.uint8)]
    return {
        "peak": [float(f"{value:.4g}") for value in peak],
        "hours": [text.decode("ascii") for text in packed],
    }


def compose_building(source, zone):
    """The page of a building as HTML, which web/building.js fills; `source` is HTML on where its
    numbers come from, `zone` the one of its hours of the day.
    """
    words = say(
        "± is a {spread}; of a month it is an upper bound. {limits} Hours by month are mean power, "
        "to half a percent of the highest.",
        spread=say(SPREAD),
        limits=say(LIMITS),
    )
    page = read_html("building.html").replace("$zone", zone).replace("$errors", words)
    return page.replace("$source", source)
