"""summary.json: input, settings, decisions, cost and error budget of a run."""

import importlib.metadata
import json
import platform
import re
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ..accuracy.error_budget import budget_errors
from ..energy.counted_area import REASONS, name_group
from ..energy.energy import exceeded_energy
from ..energy.pv_system import KINDS, build_system
from .list_findings import list_findings
from .vary_windows import vary_windows


def write_summary(path, summary):
    """Write a summary as JSON, with null for numbers that are not finite."""
    path.write_text(
        json.dumps(finite(summary), indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
    )


def summarise(transfer, energy, weather, request, *, scene=None, seconds=None):
    """Everything needed to judge or to repeat a run.

    Parameters
    ----------
    transfer : Transfer
    energy : Energy
    weather : Weather
    request : Request
    scene : Scene, optional
        If the run has one.
    seconds : dict of str to float, optional
        Time per stage.

    Returns
    -------
    dict
    """
    system = build_system(request)
    # What was read, weather, settings, what was traced, time and memory, errors and sums.
    # kilo_hours  from the sum of irradiance over intervals [Wm⁻²] to a year's [kWh/m²].
    kilo_hours = weather.interval.total_seconds() / 3600 / 1000 / energy.years
    summary = {
        "input": _describe_input(transfer, energy, scene),
        "weather": {
            "label": weather.label,
            "latitude": weather.latitude,
            "longitude": weather.longitude,
            "altitude": weather.altitude,
            "distance_km": weather.distance_to(transfer.site),
            "years": energy.years,
            **{
                f"{name}_annual": float(weather.data[name].sum()) * kilo_hours
                for name in ("ghi", "dhi", "dni")
            },
            "unit": "kWh/m² per year",
            "notes": weather.notes,
            "checks": weather.checks,
        },
        "settings": request.as_dict(),
        "sky": energy.sky,
        "traced": transfer.record.as_dict() if transfer.record else {},
        "suns": {"way": transfer.suns.sampling, "count": len(transfer.suns)},
        "seconds": seconds or {},
        "peak_memory_bytes": peak_memory(),
        "error_budget": budget_errors(transfer, energy, weather)
        | {"windows": vary_windows(transfer, energy, system)},
        "totals": sum_totals(transfer, energy, system),
        "years": describe_years(energy),
        "versions": versions(),
    }
    # What only some runs have: strings, given albedos, the distance to the edge of the model.
    strings = summary["totals"]["string_shade"]
    summary["error_budget"]["string_shade"] = strings and strings["percent"]
    if transfer.albedos is not None:
        summary["albedo"] = transfer.albedos
    if edge := measure_edge(transfer, energy):
        summary["edge"] = edge
    return summary


def measure_edge(transfer, energy):
    """Share of the facades' counted area near the edge of the city, and how much more it yields
    there [%]: dict.

    The hours of facades towards each direction are compared with the facades that look at no edge
    within 100 m. Empty where there is no such edge, or no facade counts.
    """
    # Facades that count, with their distance from the edge of the city, infinite where they look at
    # none.
    distance, surfaces = transfer.surfaces.edge_distance, transfer.surfaces
    rows = np.flatnonzero(
        energy.eligible & (np.asarray(surfaces.kind) == "facade") & (energy.counted_area > 0)
    )
    if distance is None or not np.isfinite(distance).any() or not len(rows):
        return {}
    area, hours = (
        energy.counted_area[rows],
        energy.full_load_hours[rows] * np.asarray(surfaces.area)[rows],
    )
    side, distance = (
        np.asarray(surfaces.orientation)[rows],
        np.nan_to_num(distance[rows], nan=np.inf),
    )
    # For each direction: hours near the edge against what its area would have at inner facades'
    # mean.
    measures = {"unit": "m, %, %"}
    for within in (25, 100):
        near = distance <= within
        gained = expected = 0.0
        for one in np.unique(side[near]):
            own, inner = near & (side == one), (distance == np.inf) & (side == one)
            if inner.any() and hours[inner].sum() > 0:
                gained += hours[own].sum()
                expected += area[own].sum() * hours[inner].sum() / area[inner].sum()
        measures[f"share_within_{within}"] = float(100 * area[near].sum() / area.sum())
        measures[f"more_hours_within_{within}"] = (
            float(100 * (gained / expected - 1)) if expected else None
        )
    return measures


def _describe_input(transfer, energy, scene):
    """Place, counts and areas of a city; with a scene also report, findings and ground: dict."""
    # Counts and areas by kind.
    kinds = (
        pd.Series(transfer.surfaces.area, dtype=float)
        .groupby(transfer.surfaces.kind)
        .agg(count="count", area="sum")
    )
    description = {
        "site": asdict(transfer.site),
        "surfaces": len(transfer.surfaces),
        "kinds": kinds.to_dict("index"),
        "eligible": int(energy.eligible.sum()),
    }
    # What only a run from files has: report, findings, squares of the ground.
    if scene is not None:
        description["report"] = asdict(scene.report)
        description["findings"] = [
            {
                "heading": one.heading,
                "reason": one.reason,
                "count": len(one.names),
                "area": one.area,
            }
            for one in list_findings(scene, transfer.covered_share)
        ]
        description["triangles"] = len(scene.triangles)
        if scene.lattice is not None:
            low, high, step, patch_size, _ = scene.lattice
            squares = {
                "low": low.tolist(),
                "high": high.tolist(),
                "step": step,
                "patch_size": patch_size,
            }
            description["ground_squares"] = squares
        description["ground_triangles"] = int((scene.surface_of_triangle < 0).sum())
    return description


def sum_totals(transfer, energy, system):
    """Power and annual energy if all eligible area that is open and usable carried modules, whole
    and by kind.

    With the paper's sectors flat roofs have a line among `kinds`, but are not part of the whole.
    `without_modules` has all other area, by the reason why it counts nothing; `dark` surfaces that
    count although next to no light reaches them, in deep courts and shafts. `every_square_metre` is
    what modules on all of the area would give, whatever the layout.
    """
    area, counts = np.asarray(transfer.surfaces.area, float), energy.summed
    rows = {name: counts & (energy.kind == name) for name in KINDS}
    own = energy.eligible & np.isfinite(energy.full_load_hours)
    counted = energy.counted_area[counts]
    # Hours are means over whole polygons; here they become means over the area that counts.
    hours = energy.full_load_hours[counts] * area[counts] / counted
    # Open surfaces below a hundredth of the mean see next to no light all year.
    dark = hours * counted.sum() < 0.01 * (hours @ counted)
    every = replace(energy, kwp=energy.area_kwp).sum_potential(energy.eligible, area)
    # Energy of each year, (y,) [MWh]; with several, what half and nine of ten exceed is told.
    by_year = energy.kwp_of_hours(area)[own] @ energy.full_load_hours_by_year[own] / 1000
    return {
        "count": int((energy.eligible & counts).sum()),
        **energy.sum_potential(energy.eligible, area),
        **{
            f"{name}_mwh_per_year": float(value) for name, value in exceeded_energy(by_year).items()
        },
        "area_per_kwp": system.module.area_of_kwp,
        "layout": "area" if energy.layout is None else "rows",
        "every_square_metre": {name: every[name] for name in ("kwp", "mwh_per_year")},
        "kinds": {
            name: {"count": int(chosen.sum()), **energy.sum_potential(chosen, area)}
            for name, chosen in rows.items()
            if chosen.any()
        },
        "string_shade": energy.sum_string_loss(area, system.strings == "string"),
        "without_modules": _sum_left_out(area, energy),
        "dark": {"count": int(dark.sum()), "area": float(counted[dark].sum())},
        "unit": "m², m²/kWp, kWp, h, kWh/kWp, MWh",
    }


def _sum_left_out(area, energy):
    """Surfaces that do not count, and their area [m²], by the reason; and what is covered or has no
    room of those that count.

    With the counted area they add up to the area of all surfaces.

    Parameters
    ----------
    area : numpy.ndarray, (n,)
        Whole area of the surfaces [m²].
    energy : Energy

    Returns
    -------
    dict of str to dict
        Key of `LEFT_OUT` -> count, area.
    """
    counts = energy.summed
    left_out = area - np.where(counts, energy.counted_area, 0.0)
    rows = {reason: ~counts & (energy.reason == reason) for reason in REASONS}
    rows["parts"] = counts & (left_out > 0)
    return {
        name: {"count": int(own.sum()), "area": float(left_out[own].sum())}
        for name, own in rows.items()
        if own.any()
    }


def describe_years(energy):
    """Full load hours of the groups by year, with mean and standard deviation; empty for a single
    year.
    """
    years = energy.sum_years()
    if not years:
        return {}
    table = pd.DataFrame(
        years, index=[name_group(*names) for names in energy.groups]
    ).T  # (y, g) [h]
    spread = table.agg(["mean", "std", "min", "max"])
    spread.index = ["mean", "standard_deviation", "lowest", "highest"]
    groups = {
        name: own.to_dict() | {"full_load_hours": table[name].tolist()}
        for name, own in spread.items()
    }
    return {"years": list(years), "groups": groups, "unit": "h"}


def versions():
    """Versions of Python, CityPV and libraries, None of what is not installed."""
    numbers = {"python": platform.python_version()}
    # All that a number may depend on: what pyproject.toml asks for, and whose k-means tsam takes.
    libraries = (
        *(
            "cftime",
            "embreex",
            "h5netcdf",
            "h5py",
            "lxml",
            "mapbox-earcut",
            "numba",
            "numpy",
            "pandas",
            "pvlib",
            "pyproj",
        ),
        *(
            "rasterio",
            "requests",
            "scikit-learn",
            "scipy",
            "shapely",
            "threadpoolctl",
            "tifffile",
            "tsam",
            "xarray",
        ),
    )
    for name in ("citypv", *libraries):
        try:
            numbers[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            numbers[name] = None
    return numbers


def peak_memory():
    """Peak memory of this process [bytes]; None if the platform does not report it."""
    if sys.platform == "win32":
        return None
    status = Path("/proc/self/status")
    if status.exists():  # Linux, whose rusage goes on from the process that started this one
        match = re.search(r"^VmHWM:\s*(\d+) kB", status.read_text("utf-8"), re.MULTILINE)
        if match:
            return 1024 * int(match[1])
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def finite(value):
    """Convert a value to plain types, with None for numbers that are not finite."""
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
