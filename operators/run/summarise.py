"""Store summaries on the city's object for the panel: suns traced, albedos, full load hours of
groups.
"""

import numpy as np

from ...core.results.colour_map import choose_range
from ..city.keys import Key

OF_ENERGY = (
    Key.GROUPS,
    Key.WEATHER,
    Key.WEATHER_PLACE,
    Key.TOTALS,
    Key.ENERGY_TOTALS,
    Key.KWP,
    Key.FEW,
    Key.COMPARED,
    Key.MATCHED,
    Key.BEST,
    Key.TOLD,
    Key.PROBE,
    Key.CHARTS,
)


def sum_energy(transfer, weather, energy, request):
    """What `summarise_energy` stores: place of the weather, totals, sums of buildings, power, and
    the scale of the hours of modules.
    """
    from ...core.energy.pv_system import build_system
    from ...core.results.write_buildings import sum_buildings
    from ...core.results.write_summary import sum_totals

    # The scale spans all that counts, so that colours mean the same while modules go.
    area, counted = transfer.surfaces.area, energy.counted_area
    hours = np.full(len(area), np.nan)
    np.divide(energy.full_load_hours * area, counted, out=hours, where=counted > 0)
    return {
        "ends": choose_range(hours, counted),
        "place": weather.describe_distance(transfer.site),
        "whole": sum_totals(transfer, energy, build_system(request)),
        "buildings": sum_buildings(transfer, energy, weather),
        "kwp": energy.kwp_of_hours(transfer.surfaces.area),
    }


def summarise_energy(item, weather, energy, *, place, whole, buildings, kwp, ends):
    """Store annual full load hours of each group, totals and the best buildings on the object;
    return a sentence.

    Parameters
    ----------
    item : bpy.types.Object
    weather : core.weather.weather.Weather
    energy : core.energy.energy.Energy
    place : str
        Where the weather comes from, if from elsewhere (`Weather.describe_distance`).
    whole : dict
        Power, energy and hours of all eligible surfaces and of each kind, of
        `core.results.write_summary.sum_totals`.
    buildings : pandas.DataFrame
        Of `core.results.write_buildings.sum_buildings`.
    kwp : (n,) float [kWp]
        Of `Energy.kwp_of_hours`.
    ends : tuple of two float [h]
        Of the colours of the hours of modules.
    """
    from ...core.results.read_results import kind_title

    # Power of each surface, and those that only have too few hours for modules.
    item[Key.KWP], item[Key.RANGE + "module_hours"] = kwp.tolist(), ends
    item[Key.FEW] = np.flatnonzero(energy.reason == "low-hours").tolist()

    # Totals of all and of each kind, as lines of the panel's table.
    totals = {"All": whole} | {kind_title(kind): one for kind, one in whole["kinds"].items()}
    item[Key.ENERGY_TOTALS] = {name: total["mwh_per_year"] for name, total in totals.items()}
    rows = [
        "|".join(
            [
                name,
                *(
                    "–" if total[key] is None else f"{total[key]:,.0f}"
                    for key in ("kwp", "mwh_per_year", "full_load_hours")
                ),
            ]
        )
        for name, total in totals.items()
    ]
    # Energy that 50 and 90 % of the years exceed follows, where it is known.
    item[Key.TOTALS] = rows + [
        f"P{share} of {energy.years:g} years|–|{value:,.0f}|–"
        for share in (50, 90)
        if (value := whole.get(f"p{share}_mwh_per_year")) is not None
    ]
    # Hours of each group.
    annual = (
        energy.capacity_factor.sum(axis=0) * energy.interval.total_seconds() / 3600 / energy.years
    )
    item[Key.GROUPS] = [
        f"{kind} {orientation}|{count}|{value:,.0f}"
        for (kind, orientation), count, value in zip(
            energy.groups, energy.group_count, annual, strict=True
        )
    ]
    # What files tell of buildings, those with the most energy first.
    ranked = buildings.sort_values("mwh_per_year", ascending=False)
    told = zip(*(ranked[name] for name in ("building_id", "address", "name")), strict=True)
    item[Key.TOLD] = [
        "|".join(one.replace("|", "/") for one in row) for row in told if any(row[1:])
    ]
    columns = ["building_id", "kwp", "mwh_per_year", "p50_mwh_per_year", "p90_mwh_per_year"]
    # The 20 buildings with the most energy, without columns that are unknown.
    best = (
        buildings[buildings["kwp"] > 0]
        .nlargest(20, "mwh_per_year")
        .reindex(columns=columns)
        .dropna(axis=1)
    )
    item[Key.BEST] = [
        "|".join([name.replace("|", "/"), *(f"{one:,.1f}" for one in row)])
        for name, *row in best.itertuples(index=False, name=None)
    ]
    item[Key.WEATHER], item[Key.WEATHER_PLACE] = weather.label, place
    # The sentence has the groups' mean hours, weighed by area.
    mean = np.average(annual, weights=energy.group_area) if len(annual) else 0.0
    told = "; ".join(filter(None, (weather.label, place)))
    return f"Full load hours of the area with modules: {mean:.0f} h per year ({told})"


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
    item[Key.ALBEDOS] = told
    item[Key.UNREAD] = f"Materials without a known albedo: {', '.join(unread)}" if unread else ""
