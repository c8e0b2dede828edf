"""Read the angles of a horizon from a file.

Four formats are told apart by their content:
    azimuth,elevation       two columns, azimuth clockwise from north [°], any order and spacing, header optional;
                            the other way round if the header names them so
    PVGIS printhorizon CSV  columns A and H_hor, A from the south, west positive
    PVGIS printhorizon JSON the same
    PVGIS user horizon      elevations only, equally spaced, from north clockwise
"""

import json
import re

import numpy as np

from ..files.open_input import open_input
from ..settings.errors import InputError
from .horizon import STEPS, TerrainHorizon

CURE = "give lines of azimuth,elevation in degrees, or a horizon file of PVGIS"
LARGEST = 4_000_000  # bytes
HIGHEST = 90.0
ELEVATION_FIRST = re.compile(r"\W*(elev|height|h_hor|horizon|altitude)\w*\W.*\bazi", re.IGNORECASE)


def read_horizon_table(path):
    """Horizon from a file of angles.

    Parameters
    ----------
    path : path-like
        Text, plain or gzip-compressed. Elevations below the horizontal count as 0.

    Returns
    -------
    TerrainHorizon

    Raises
    ------
    InputError
        The file is not one of the formats above, or an angle is out of range.
    """
    with open_input(path) as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST or b"\0" in content:
        raise InputError(path, "is not a horizon file", CURE)
    text = content.decode("utf-8-sig", errors="replace")
    azimuth, elevation = angles_of_json(path, text) if text.lstrip().startswith("{") else angles_of_text(path, text)
    check_angles(path, azimuth, elevation)
    order = np.argsort(azimuth % 360, kind="stable")
    around = np.arange(STEPS) * (360.0 / STEPS)
    heights = np.interp(around, (azimuth % 360)[order], elevation[order], period=360.0)
    return TerrainHorizon(np.maximum(heights, 0), str(path))


def angles_of_json(path, text):
    """Azimuths from north and elevations of PVGIS' JSON."""
    try:
        rows = json.loads(text)["outputs"]["horizon_profile"]
        values = np.array([(row["A"], row["H_hor"]) for row in rows], float).reshape(-1, 2)
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(path, "is not a horizon of PVGIS", CURE) from error
    return values[:, 0] + 180, values[:, 1]


def angles_of_text(path, text):
    """Azimuths from north and elevations of a text."""
    rows, lines, header = [], [], ""
    for number, line in enumerate(text.splitlines(), start=1):
        fields = [field for field in re.split(r"[,;\s]+", line.strip()) if field]
        try:
            values = [float(field) for field in fields]
        except ValueError:
            if rows and header_of_pvgis(header):
                break  # PVGIS explains its columns below them
            if rows:
                raise InputError(f"{path}:{number}", f"{line.strip()[:40]!r} are no numbers", CURE) from None
            header = line
            continue
        if values:
            rows.append(values)
            lines.append(number)
    widths = {len(row) for row in rows}
    if header_of_pvgis(header) and rows and min(widths) >= 2:
        return np.array([row[0] + 180 for row in rows]), np.array([row[1] for row in rows])
    if widths == {2}:
        first, second = np.array(rows).T
        return (second, first) if ELEVATION_FIRST.match(header) else (first, second)
    if rows and (widths == {1} or len(rows) == 1):
        values = np.array([value for row in rows for value in row])
        return np.arange(len(values)) * (360.0 / len(values)), values
    other = next((line for line, row in zip(lines, rows, strict=True) if len(row) != len(rows[0])), None)
    if other is None:
        raise InputError(path, "has neither two columns nor one", CURE)
    raise InputError(f"{path}:{other}", "has more or fewer columns than the lines before", CURE)


def header_of_pvgis(header):
    """Whether a line names the columns of PVGIS' horizon."""
    return re.match(r"\s*A\W+H_hor\b", header) is not None


def check_angles(path, azimuth, elevation):
    """Refuse angles out of range, and a horizon of fewer than three."""
    if len(azimuth) < 3:
        raise InputError(path, f"has {len(azimuth)} angles", "give at least three around the site")
    bad = ~(np.abs(azimuth) <= 540) | ~(np.abs(elevation) < HIGHEST)  # also true for NaN
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        problem = f"azimuth {azimuth[row]:g}°, elevation {elevation[row]:g}° (entry {row + 1}) is out of range"
        raise InputError(path, problem, "give azimuths from 0 to 360° and elevations below 90°")
