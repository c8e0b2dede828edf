"""What a choice of suns does to full load hours, measured on patches of the scene itself against
four times as many days, or every hour's sun.
"""

from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from ..city.scene import Scene
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.prepare_scene import PreparedScene
from ..light.sun_sampling_error import trace_sun_samples
from ..settings.progress import silent
from ..settings.request import Request
from ..settings.threads import map_in_order, usable_threads
from ..sky.sky_models import choose_sky
from ..sun.sun_sampling import choose_suns
from ..weather.weather import Weather

NO_ERROR = dict.fromkeys(
    ("bias", "bias_standard_error", "of_groups", "rms", "rms_standard_error"), 0.0
)
FEWER = 100  # patches where several choices are compared before a run


class CityYear(NamedTuple):
    """What is traced, and the year that weighs it."""

    scene: Scene
    prepared: PreparedScene | None  # with its tree; None: prepared where it is needed
    weather: Weather
    request: Request


def measure_ways(inputs, transfer, ways, progress=silent, *, patches=500):
    """Error of full load hours by some choices of suns. Reflections are left out: they change more
    slowly than shadows.

    Parameters
    ----------
    inputs : CityYear
    transfer : Transfer
    ways : list of Suns
    progress : callable
    patches : int
        On how many, at most.

    Returns
    -------
    list of dict
        For each way, in percent of full load hours: `bias` (all together) and its
        `bias_standard_error`, `of_groups` (rms of the means of kinds and orientations), `rms`
        (patch by patch) and its `rms_standard_error`, and how many `patches`.
    """
    # If every hour's suns are the only choice, or no surface is eligible, nothing is traced: all
    # errors are 0, on 0 patches.
    # Else the truth are suns of four times the days where all choices are whole days and there are
    # enough of them in the year, or every hour's.
    scene, prepared, weather, request = inputs
    every, surfaces = {suns.sampling: suns for suns in ways}, transfer.surfaces
    if every.keys() == {"hourly"} or not surfaces.eligible.any():
        return [NO_ERROR | {"patches": 0} for _ in ways]
    truth = _choose_truth(every, weather.axis)
    every.setdefault(truth, choose_suns(truth, *weather.axis, position=weather.data))
    # A few patches under each choice of suns, and their full load hours.
    few = trace_sun_samples(
        scene, transfer, [*every.values()], request, progress, prepared=prepared, count=patches
    )
    system, sky, threads = (
        build_system(request),
        choose_sky(request, transfer),
        usable_threads(request.threads),
    )
    # Linear algebra gets one thread, set here for the whole process: no thread can set it alone.
    with threadpool_limits(1, "blas"):
        light = map_in_order(
            lambda one: compute_energy(one, weather, system, threads, sky=sky), few, threads
        )
        hours_by = {way: energy.full_load_hours for way, energy in zip(every, light, strict=True)}
    # Patches were drawn by their area, so that each stands for as much of it, or all were taken:
    # with these weights the hours of each choice are compared with the truth's.
    sample = few[0].surfaces
    least = surfaces.area[surfaces.eligible].sum() / patches
    weight, names = np.maximum(sample.area, least), name_groups(sample)
    true = hours_by[truth]
    return [compare_hours(hours_by[suns.sampling], true, weight, names) for suns in ways]


def _choose_truth(ways, axis):
    """A choice of suns against which some others, of str, are measured: of four times their days
    where that is less than half of all, else every hour's.

    Suns between days are interpolated, so that the error falls with their distance or faster: of
    four times the days it is a quarter or less, which adds at most 3 % by squares.
    """
    names, counts = zip(*(way.partition(":")[::2] for way in ways), strict=True)
    if set(names) == {"days"}:
        days = 4 * max(map(int, counts))
        if 2 * days <= min((axis.times[-1] - axis.times[0]).days, 365):
            return f"days:{days}"
    return "hourly"


def name_groups(surfaces):
    """Kind and orientation of surfaces as one text each: (n,) str."""
    return np.array(
        [" ".join(pair) for pair in zip(surfaces.kind, surfaces.orientation, strict=True)]
    )


def compare_hours(found, true, weight, names):
    """What some full load hours are off, in percent, by patches with weights and names of groups:
    dict as of `measure_ways`.
    """
    # error  of each patch, in percent of the mean hours.
    mean, count = np.average(true, weights=weight), len(true)
    if not mean > 0:
        return NO_ERROR | {"patches": count}
    error = 100 * (found - true) / mean
    rms = np.sqrt(np.average(error**2, weights=weight))
    # The mean of each group is off by a share of its own hours; they count by their hours.
    group = np.unique(names, return_inverse=True)[1]
    apart, hours = (np.bincount(group, weight * part) for part in (found - true, true))
    shift = np.divide(apart, hours, out=np.zeros(len(hours)), where=hours > 0)
    return {
        "bias": float(np.average(error, weights=weight)),
        "bias_standard_error": float(
            error.std() / np.sqrt(count)
        ),  # the patches are drawn by chance
        "of_groups": float(100 * np.sqrt(np.average(shift**2, weights=hours))),
        "rms": float(rms),
        "rms_standard_error": float((error**2).std() / np.sqrt(count) / max(2 * rms, 1e-9)),
        "patches": count,
    }
