"""What each option of the plant, the sky and the area changes in full load hours, from one trace.

    python benchmarks/options.py DIR [--weather FILE]

DIR is a folder of `citypv simulate`, such as that of `make demo`. The base is DC on open racks
under the isotropic sky, in the paper's four sectors. Each row changes one thing of it.
"""

import argparse
import tempfile
from pathlib import Path

import citypv

WEATHER = Path(__file__).parents[1] / "examples/berlin/era5_berlin_2017.nc"
BASE = {
    "sky": "isotropic",
    "losses": 0.0,
    "inverter": "none",
    "mounting": "open-rack",
    "sectors": "paper",
}
ROWS = {
    "`--mounting insulated-back`": {"mounting": "insulated-back"},
    "`--mounting close-mount`": {"mounting": "close-mount"},
    "`--diffuse-iam on`": {"diffuse_iam": True},
    "`--iam physical`": {"iam": "physical"},
    "`--iam ashrae`": {"iam": "ashrae"},
    '`--module "Canadian Solar Inc. CS5P-220M"` (CEC)': {"module": "Canadian Solar Inc. CS5P-220M"},
    '`--module "Canadian Solar CS5P-220M 2009"` (Sandia)': {
        "module": "Canadian Solar CS5P-220M 2009"
    },
    "`--losses 11.4 --inverter pvwatts`": {"losses": 11.4, "inverter": "pvwatts"},
    "`--sky perez`": {"sky": "perez"},
    "`--horizon-cut neglect`": {"horizon_cut": "neglect"},
    "`--hidden-walls count`": {"hidden_walls": "count"},
    "`--clearance 0.01`": {"clearance": 0.01},
    "`--effects spectrum=off`": {"effects": {"spectrum": False}},
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--weather", default=WEATHER)
    options = parser.parse_args()
    base = find_hours(options, {})
    print("| | facades N, E, S, W | roofs N, E, S, W | area that counts |\n|---|---|---|--:|")
    for name, change in ROWS.items():
        found = find_hours(options, change)
        changes = [percent(found[0][group], hours) for group, hours in base[0].items()]
        print(
            f"| {name} | {', '.join(changes[:4])} | {', '.join(changes[4:])} | "
            f"{percent(found[1], base[1])} |",
            flush=True,
        )


def find_hours(options, change):
    """Full load hours of facades and pitched roofs by direction, and the area that counts [m²]."""
    result = citypv.read_results(options.folder)
    with tempfile.TemporaryDirectory() as folder:
        weighed = result.with_weather(
            options.weather, out=Path(folder) / "out", **{**BASE, **change}
        )
        groups = weighed.groups[weighed.groups["period"] == "annual"].set_index(
            ["kind", "orientation"]
        )
    wanted = [
        (kind, way) for kind in ("facade", "roof") for way in ("north", "east", "south", "west")
    ]
    hours = "full_load_hours" if change.get("losses") else "full_load_hours_dc"
    return {group: groups.loc[group, hours] for group in wanted}, groups.loc[wanted, "area"].sum()


def percent(found, base):
    return f"{100 * (found / base - 1):+.1f}".replace("-", "−")


if __name__ == "__main__":
    main()
