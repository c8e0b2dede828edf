"""Axes of gridded weather, and the lines of a grid that stand for a place."""

import numpy as np
import pandas as pd

from ..settings.errors import InputError

AXES = ("time", "latitude", "longitude")


def name_axes(source, dataset, cure):
    """Give gridded weather the axes time, latitude and longitude, whatever they are called in its
    file.

    Parameters
    ----------
    source : path-like
        The file, for messages.
    dataset : xarray.Dataset
    cure : str
        For a file without such axes.

    Returns
    -------
    xarray.Dataset
        With these three dimensions, and perhaps expver; further ones of length 1 are dropped.

    Raises
    ------
    InputError
        An axis is missing or out of range, there are further dimensions, or the calendar is not the
        usual one.
    """
    # Other names of the axes become ours, and axes that are missing are refused; further dimensions
    # of length 1 are dropped.
    names = {"valid_time": "time", "lat": "latitude", "lon": "longitude"}
    renamed = {
        old: new for old, new in names.items() if old in dataset.variables and new not in dataset
    }
    dataset = dataset.rename(renamed)
    for name in AXES:
        if name not in dataset.variables:
            raise InputError(source, f"no coordinate {name}", cure)
    known = {*AXES, "expver"}
    dataset = dataset.squeeze(
        [name for name, size in dataset.sizes.items() if size == 1 and name not in known]
    )
    # What is left is refused: members, steps of a forecast, lists of points.
    further = [f"{name} ({size})" for name, size in dataset.sizes.items() if name not in known]
    if further:
        raise InputError(
            source,
            f"has values along {', '.join(further)}, not only along {', '.join(AXES)}",
            "give one value for each time, latitude and longitude of a regular grid",
        )
    # All three axes, even of a single time or place; times in the usual calendar.
    dataset = dataset.expand_dims([name for name in AXES if name not in dataset.dims])
    # In a forecast time is when it began: the times that it holds for take its place.
    if "valid_time" in dataset.variables:
        dataset = dataset.assign_coords(time=dataset["valid_time"].to_numpy()).drop_vars(
            "valid_time"
        )
    _check_axes(source, dataset)
    # Years of 365 days are moved to the standard calendar; any other calendar is refused.
    if getattr(dataset["time"].dt, "calendar", None) in ("noleap", "365_day"):
        dataset = dataset.convert_calendar("standard", use_cftime=False)
    if not np.issubdtype(dataset["time"].dtype, np.datetime64):
        raise InputError(source, "its times are not in a standard calendar", cure)
    return dataset


def _check_axes(source, dataset):
    """Refuse latitudes and longitudes that are missing, twice, or not on Earth, and times that are
    there twice.
    """
    for name, most in (("latitude", 90.0), ("longitude", 360.0)):
        values = dataset[name].to_numpy().astype(float)
        # Coordinates may lie 0.001° beyond the poles.
        outside = values[~(np.abs(values) <= most + 1e-3)]
        if len(outside):
            raise InputError(
                source,
                f"has a {name} of {outside[0]:g}°",
                f"give {name}s from -{most:g} to {most:g}",
            )
    for name in AXES:
        values = pd.Index(dataset[name].to_numpy())
        if values.has_duplicates:
            twice = values[values.duplicated()][0]
            words = f"{str(twice)[:16]}" if name == "time" else f"{twice:g}°"
            raise InputError(source, f"has the {name} {words} twice", "give each once")


def weigh_lines(distance, point):
    """Weights of the grid lines along one axis for the values at a place.

    Parameters
    ----------
    distance : numpy.ndarray, (k,)
        From the place to each grid line [°], signed.
    point : {"nearest", "bilinear"}
        How.

    Returns
    -------
    numpy.ndarray, (k,) float64, or None
        Sums to 1; beyond the last line that one counts alone. None if the place is outside by more
        than half a cell.
    """
    lines, away = np.unique(distance), np.abs(distance)
    # A grid with a single row or column has ERA5's cell of 0.25°.
    cell = np.diff(lines).min() if len(lines) > 1 else 0.25
    if away.min() > 0.5 * cell + 1e-6:
        return None
    weight = np.zeros(len(away))
    if point == "nearest":
        weight[away.argmin()] = 1.0
    else:
        weight = np.maximum(1.0 - away / cell, 0.0)
    return weight / weight.sum()
