"""Store summaries on the city's object for the panel: suns traced, albedos, full load hours of groups."""

import numpy as np

from ..attributes import PREFIX

GROUPS, WEATHER, PLACE, TOTALS, ALBEDOS, UNREAD, INTERRUPTED = (
    PREFIX + name for name in ("groups", "weather", "weather_place", "totals", "albedos", "unread", "interrupted")
)
ENERGY = PREFIX + "energy_totals"  # [MWh per year] of the same rows
KWP = PREFIX + "kwp"  # of each surface
COMPARISON, FOUND = PREFIX + "compared", PREFIX + "matched"  # before and after: tables as JSON, and a sentence
OF_ENERGY = (GROUPS, WEATHER, PLACE, TOTALS, ENERGY, KWP, COMPARISON, FOUND)
OF_ENERGY += tuple(PREFIX + name for name in ("probe", "best", "charts"))
SHOWN = ("kwp", "mwh_per_year", "full_load_hours")  # of sum_potential, in the table of totals


def sum_totals(transfer, energy, request):
    """Power, energy and hours of all eligible surfaces and of each kind, as in summary.json: dict of dicts."""
    from ...core.energy.pv_system import build_system
    from ...core.results.read_results import TITLES
    from ...core.results.write_summary import sum_totals as sum_whole

    whole = sum_whole(transfer, energy, build_system(request))
    return {"All": whole} | {TITLES[kind]: one for kind, one in whole["kinds"].items()}


def summarise_energy(item, weather, energy, place, totals):
    """Store annual full load hours of each group and totals on the object; return a sentence.

    Parameters
    ----------
    item : bpy.types.Object
    weather : core.weather.weather.Weather
    energy : core.energy.energy.Energy
    place : str
        Where the weather comes from, if from elsewhere (`core.weather.weather.describe_distance`).
    totals : dict
        Of `sum_totals`; as rows: surfaces, kWp, MWh per year, hours per year.
    """
    item[ENERGY] = {name: total["mwh_per_year"] for name, total in totals.items()}
    rows = [
        "|".join([name, *("–" if total[key] is None else f"{total[key]:,.0f}" for key in SHOWN)])
        for name, total in totals.items()
    ]
    item[TOTALS] = rows + [
        f"P{share} of {energy.years:g} years|–|{value:,.0f}|–"
        for share in (50, 90)
        if (value := totals["All"].get(f"p{share}_mwh_per_year")) is not None
    ]
    annual = energy.capacity_factor.sum(axis=0) * energy.interval.total_seconds() / 3600 / energy.years
    item[GROUPS] = [
        f"{kind} {orientation}|{count}|{value:,.0f}"
        for (kind, orientation), count, value in zip(energy.groups, energy.group_count, annual, strict=True)
    ]
    item[WEATHER], item[PLACE] = weather.label, place
    mean = np.average(annual, weights=energy.group_area) if len(annual) else 0.0
    told = "; ".join(filter(None, (weather.label, place)))
    return f"Full load hours of the eligible area: {mean:.0f} h per year ({told})"


def summarise_albedo(item, rows, unread):
    """Store the sources of albedos on the object.

    Parameters
    ----------
    item : bpy.types.Object
    rows : list of dict
        As `core.patches.read_albedo.describe_albedo` makes them.
    unread : list of str
        Materials that tell no albedo.
    """
    names = {"--albedo": "one value", "--ground-albedo": "ground", "--albedo-file": "by surface"}
    told = []
    for row in rows:
        name = (row["name"] or names[row["from"]]).replace("|", "/")
        law = f"{row['albedo']:.3f}" if row["law"] == "lambertian" else row["reflects"]
        count = f"{row['surfaces']:,}" if "surfaces" in row else ""
        told.append(f"{name}|{law}|{count}")
    item[ALBEDOS] = told
    item[UNREAD] = f"Materials without a known albedo: {', '.join(unread)}" if unread else ""
