"""Storeys and windows of single facades, or of all of a kind, from a file."""

import numpy as np

from ..read.open_input import read_rows
from ..settings.errors import InputError, id_of_cell
from .lay_city import FacadeRow

CURE = "write the header surface,storey,window_band,usable and a line for each"


def read_facades(path):
    """Read storeys, windows and usable shares by surface id or by kind.

    Parameters
    ----------
    path : str or path-like
        CSV whose header is `surface` and one or more of `storey` [m], `window_band` [m], `usable`
        (0 to 1). An empty cell leaves a value to the kind's line, then to the settings.

    Returns
    -------
    dict of str to FacadeRow

    Raises
    ------
    InputError
        The file cannot be read, has other columns, names a surface twice, or a number is out of
        its range.
    """
    rows = read_rows(path, CURE)
    first, *columns = next(rows, None) or [""]
    if first != "surface" or not columns or not set(columns) <= set(FacadeRow._fields):
        raise InputError(path, "line 1 is not a header of facades", CURE)
    facades = {}
    for number, cells in enumerate(rows, start=2):
        if len(cells) != len(columns) + 1:
            problem = f"line {number} has {len(cells)} cells, the header {len(columns) + 1}"
            raise InputError(path, problem, "write one cell for each column, empty or not")
        name = id_of_cell(cells[0])
        if name in facades:
            raise InputError(path, f"line {number} names {name!r} again", "name each once")
        values = {
            column: _read_number(path, number, column, cell)
            for column, cell in zip(columns, cells[1:], strict=True)
            if cell.strip()
        }
        facades[name] = FacadeRow(**values)
    return facades


def _read_number(path, line, column, cell):
    """Number of a cell in the range of its column."""
    least, most = {"storey": (1.0, 20.0), "window_band": (0.0, 20.0), "usable": (0.0, 1.0)}[column]
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not least <= value <= most:  # also true for NaN
        problem = f"line {line}: {column} {cell!r} is no number from {least:g} to {most:g}"
        raise InputError(path, problem, "give one, or leave the cell empty")
    return value


def check_facades(surfaces, path):
    """Refuse a file of facades that names what is neither a surface nor a kind of a city.

    Parameters
    ----------
    surfaces : Surfaces
    path : str or None

    Raises
    ------
    InputError
    """
    known = {*surfaces.surface_id, *map(str, surfaces.kind)}
    unknown = set(read_facades(path)) - known if path else set()
    unknown -= {whole for whole in unknown if f"{whole}#1" in known}
    if unknown:
        problem = f"{sorted(unknown)[0]!r} is neither a surface nor a kind of this city"
        raise InputError(path, problem, "use surface_id or kind as in faces.csv")
