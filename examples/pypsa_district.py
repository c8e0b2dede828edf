"""Capacity factors of a district into PyPSA: how much of its roofs and facades pays beside power
from the grid?

    pip install '.[examples]'
    python examples/pypsa_district.py [FOLDER]

FOLDER is a result folder of `citypv simulate`; without it the Berlin example is traced as a draft.
"""

import sys
from pathlib import Path

import numpy as np
import pypsa

import citypv

BERLIN = Path(__file__).parent / "berlin"
GRID_PRICE = 250.0  # [€/MWh]
ANNUITY = {
    "facade": 140.0,
    "steep": 120.0,
    "roof": 100.0,
    "flat": 90.0,
    "rack": 90.0,
}  # [€/kWp a] of a plant, all costs


def build_network(result):
    """Network with one bus: a generator for each group of surfaces, as large as its area allows,
    and the grid.

    Parameters
    ----------
    result : citypv.Result

    Returns
    -------
    pypsa.Network
        Power in kW, costs in € per year.
    """
    series = result.timeseries["capacity_factor"].to_pandas()  # (hours, groups)
    annual = result.groups[result.groups["period"] == "annual"]
    area_per_kwp = result.summary["totals"]["area_per_kwp"]
    usable = result.summary["settings"]["usable"]  # shares of kinds that windows and edges leave
    network = pypsa.Network()
    network.set_snapshots(series.index)
    network.add("Bus", "district")
    for kind, orientation, area in zip(
        annual["kind"], annual["orientation"], annual["area"], strict=True
    ):
        name = f"{kind}_{orientation}"
        cost = ANNUITY.get(kind)
        if cost is not None and name in series:
            most = area * usable.get(kind, 1.0) / area_per_kwp
            limits = {"p_nom_extendable": True, "p_nom_max": most, "capital_cost": cost}
            network.add("Generator", name, bus="district", p_max_pu=series[name], **limits)
    # A demand that is largest at noon and in the evening, 2,000 kW on average.
    hour = series.index.hour.to_numpy() + 0.5
    shape = 1 + 0.3 * np.exp(-((hour - 12) ** 2) / 8) + 0.6 * np.exp(-((hour - 19) ** 2) / 6)
    network.add("Load", "demand", bus="district", p_set=2000 * shape / shape.mean())
    network.add("Generator", "grid", bus="district", p_nom=1e6, marginal_cost=GRID_PRICE / 1000)
    return network


def main(arguments):
    """Find the plant that costs least and print it."""
    if arguments:
        result = citypv.read_results(arguments[0])
    else:
        weather = BERLIN / "era5_berlin_2017.nc"
        result = citypv.simulate(BERLIN / "berlin_3910_5817.gml", weather=weather, preset="draft")
    network = build_network(result)
    network.optimize(solver_name="highs")
    built = network.generators[network.generators["p_nom_extendable"]]
    print(built[["p_nom_max", "p_nom_opt"]].round(0).to_string())
    bought, used = network.generators_t.p["grid"].sum(), network.loads_t.p["demand"].sum()
    print(f"{bought / 1000:,.0f} of {used / 1000:,.0f} MWh from the grid")


if __name__ == "__main__":
    main(sys.argv[1:])
