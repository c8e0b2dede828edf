"""buildings.csv: where each building stands, what its facades and roofs carry and yield, with
errors and poor years.
"""

import numpy as np
import pandas as pd

from ..city.building_facts import BuildingFacts
from ..energy.energy import exceeded_energy
from ..energy.standard_errors import errors_of_energy
from .columns import name_months, write_table

# -> kinds
PARTS = {
    "facade": ("facade",),
    "roof": ("roof", "steep"),
    "flat_roof": ("flat", "rack"),
}


def write_buildings(path, transfer, energy, weather, *, monthly=False):
    """Write sums over the surfaces of each building.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    weather : Weather
        Of the energy.
    monthly : bool
        Whether to add columns with the full load hours of each month.
    """
    table = sum_buildings(transfer, energy, weather, monthly=monthly)
    for name, digits in (("easting", 12), ("northing", 12), ("latitude", 9), ("longitude", 10)):
        table[name] = [f"{value:.{digits}g}" if np.isfinite(value) else "" for value in table[name]]
    write_table(path, table)


def sum_buildings(transfer, energy, weather, *, monthly=False):
    """Sums over the surfaces of each building, in alphabetical order: pandas.DataFrame.

    Parameters as in `write_buildings`. Columns without a part's name are sums of the eligible
    surfaces; columns of parts count modules that lie flat on flat roofs, too. Unknown values are
    NaN.
    """
    surfaces = transfer.surfaces
    names, building = np.unique(
        np.array(surfaces.building_id, dtype=object).astype(str), return_inverse=True
    )
    # Where each building stands, then what its surfaces carry and yield.
    table = {"building_id": names} | (transfer.facts or BuildingFacts()).of(names)
    places = ("easting", "northing", "latitude", "longitude")
    table |= dict(zip(places, _find_middles(transfer, building, len(names)).T, strict=True))
    table |= sum_surfaces(transfer, energy, weather, building, len(names), monthly=monthly)
    if surfaces.height_source is not None:
        # All surfaces of a building have one source; of its parts the first one is told.
        source = np.array(surfaces.height_source, dtype=object)
        told = np.flatnonzero(source != "")
        first = np.full(len(names), "", object)
        first[building[told][::-1]] = source[told][::-1]
        table["height_source"] = first
    return pd.DataFrame(table)


def write_uses(path, transfer, energy, weather):
    """Write sums over the buildings of each function that their files tell, most energy first.

    Parameters as of `write_buildings`; `transfer` has facts. Buildings without a known function
    have a row of their own, with an empty name.
    """
    names, building = np.unique(
        np.array(transfer.surfaces.building_id, dtype=object).astype(str), return_inverse=True
    )
    uses, use = np.unique(transfer.facts.of(names)["function"], return_inverse=True)
    table = {"function": uses, "buildings": np.bincount(use, minlength=len(uses))}
    table |= sum_surfaces(transfer, energy, weather, use[building], len(uses))
    write_table(path, pd.DataFrame(table).sort_values("mwh_per_year", ascending=False))


def sum_surfaces(transfer, energy, weather, label, count, *, monthly=False):
    """Sums over the surfaces of each label, such as a building: dict of (count,) arrays.

    Parameters
    ----------
    transfer : Transfer
    energy : Energy
    weather : Weather
    label : (n,) int
        Sum that each surface belongs to.
    count : int
    monthly : bool
        As in `write_buildings`.
    """
    # kwp  of surfaces [kWp]: times their full load hours it is their energy.
    kwp = energy.kwp_of_hours(np.asarray(transfer.surfaces.area, float))
    eligible = energy.eligible & (kwp > 0)
    # Surfaces of the whole, then of facades, pitched roofs and flat roofs: a kind that the whole
    # leaves out, as flat roofs with the paper's sectors, still has columns of its own.
    parts = {"": eligible} | {
        f"{part}_": np.isin(energy.kind, kinds) & (kwp > 0) for part, kinds in PARTS.items()
    }
    errors = errors_of_energy(transfer, weather, energy)

    def add(values, chosen):
        # of none it has integers
        return np.bincount(label[chosen], values[chosen], count).astype(float)

    # Numbers of all surfaces, of eligible ones and of modules, and the area that counts.
    every = np.ones(len(label), bool)
    table = {
        "surfaces": add(every, every).astype(int),
        "eligible": add(every, energy.eligible).astype(int),
    }
    table["eligible_area"] = add(energy.counted_area, energy.eligible & energy.summed)
    table["module_count"] = add(energy.module_count, eligible)
    # Modules, power and energy of each part; errors of sums as of light that surfaces share.
    for part, own in parts.items():
        rows = np.flatnonzero(own)
        table[f"{part}module_area"] = add(energy.module_area, own)
        table[f"{part}kwp"] = add(energy.kwp, own)
        table[f"{part}mwh_per_year"] = add(kwp * energy.full_load_hours, own) / 1000
        table[f"{part}mwh_standard_error"] = (
            errors.of_sums(rows, kwp[rows], label[rows], count) / 1000
        )
    table["mwh_dc_per_year"] = add(kwp * energy.full_load_hours_dc, eligible) / 1000
    # Energy of each year tells what is exceeded in 9 of 10 and in half; hours are energy over
    # power.
    # (y, b) [MWh]
    by_year = np.array(
        [add(kwp * year, eligible) / 1000 for year in energy.full_load_hours_by_year.T]
    )
    table |= {f"{name}_mwh_per_year": values for name, values in exceeded_energy(by_year).items()}
    hours = {name: getattr(energy, name) for name in ("full_load_hours", "full_load_hours_dc")}
    hours |= name_months(energy.full_load_hours_by_month) if monthly else {}
    # Hours are NaN where a sum has no modules.
    with np.errstate(invalid="ignore"):
        table |= {
            name: add(kwp * values, eligible) / table["kwp"] for name, values in hours.items()
        }
    return table


def _find_middles(transfer, building, count):
    """Middle of each building's bounding box: (b, 4) float64; NaN without outlines, or where the
    place is not known.

    Easting and northing, or longitude and latitude, in the system and the units of the files;
    latitude and longitude [°].

    Parameters
    ----------
    transfer : Transfer
    building : (n,) int
        Of each surface.
    count : int
    """
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    if transfer.outlines is not None:
        # (n + 1,) into points
        first = transfer.outlines.ring_start[transfer.outlines.surface_start]
        owner = np.repeat(building, np.diff(first))
        np.minimum.at(low, owner, transfer.outlines.points)
        np.maximum.at(high, owner, transfer.outlines.points)
    with np.errstate(invalid="ignore"):
        middles, site = (low + high) / 2, transfer.site
        places = site.grid.to_files(site.to_files(middles), "xy")[:, :2]
    places[~np.isfinite(places)] = np.nan
    return np.column_stack([places, *site.find_on_earth(middles)])
