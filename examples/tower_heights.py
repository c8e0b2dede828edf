"""What does a building take from its neighbours as it grows? Its gain against their loss, at ten
heights.

    python examples/tower_heights.py [FOLDER BUILDING] [--picture PICTURE] [--step METRES]

FOLDER is a result folder of `citypv simulate --editable`, BUILDING an id of its buildings.csv;
without them a building of the Berlin example is raised, traced as a draft.
"""

import argparse
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

import citypv

BERLIN = Path(__file__).parent / "berlin"
BUILDING = "BLDG_000300000024213a"
OWN, OTHERS = "#0072b2", "#d55e00"  # of Okabe and Ito, told apart with any colour vision


def raise_in_steps(base, building, heights):
    """What a building gains, and what all others lose, when all of it above its foot goes up.

    Parameters
    ----------
    base : citypv.Result
        Of a run with exports=("editable",).
    building : str
    heights : sequence of float [m]

    Returns
    -------
    pandas.DataFrame
        By height: gain, loss and their standard errors [MWh per year]; losses are positive.
    """
    rows = []
    for height in heights:
        change = citypv.compare(base, base.variant(raised={building: height})).buildings
        own = change["building_id"] == building
        gain, loss = (change.loc[some, "mwh_change"].sum() for some in (own, ~own))
        errors = [
            (change.loc[some, "mwh_change_standard_error"] ** 2).sum() ** 0.5
            for some in (own, ~own)
        ]
        rows.append([height, gain, -loss, *errors])
    return pd.DataFrame(
        rows, columns=["height", "gain", "loss", "gain_error", "loss_error"]
    ).set_index("height")


def draw_heights(table, path):
    """Draw the table of `raise_in_steps` with bars of two standard errors: a PNG file."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    lines = ("gain", "gain of the building", OWN, "o"), ("loss", "loss of all others", OTHERS, "s")
    for name, words, colour, mark in lines:
        axes.errorbar(
            table.index,
            table[name],
            2 * table[f"{name}_error"],
            color=colour,
            marker=mark,
            label=words,
        )
    axes.set(xlabel="raised by (m)", ylabel="energy (MWh per year)", xlim=(0, None), ylim=(0, None))
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=120)


def main(arguments=None):
    """Raise, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("base", nargs="*", metavar="FOLDER BUILDING")
    parser.add_argument("--picture", default="tower_heights.png")
    parser.add_argument("--step", type=float, default=6.0, help="of ten heights [m]")
    options = parser.parse_args(arguments)
    if options.base:
        folder, building = options.base
        base = citypv.read_results(folder)
    else:
        weather, building = BERLIN / "era5_berlin_2017.nc", BUILDING
        base = citypv.simulate(
            BERLIN / "berlin_3910_5817.gml", weather=weather, preset="draft", exports=("editable",)
        )
    table = raise_in_steps(base, building, [options.step * number for number in range(1, 11)])
    print(table.round(1).to_string())
    draw_heights(table, options.picture)


if __name__ == "__main__":
    main()
