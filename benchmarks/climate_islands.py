"""Annual and monthly GHI of the built-in climate beside those of islands that it was not made from.

    python benchmarks/climate_islands.py [TMY3]

data/island_ghi.csv has two kinds of judge: typical years of stations (TMY3, National Renewable
Energy Laboratory) and long-term means of another satellite product (NASA POWER, CERES, 2001–2020).
TMY3 is a folder with files *.tmy3 of whatever stations, whose years are compared as well, by
region; data/ATTRIBUTION.md says where all of it is from.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from citypv.core.weather.climate import cleanest_sky, hours_of_year, look_up_altitude, monthly_sums
from citypv.core.weather.climate_grid import look_up_normals

ISLANDS = Path(__file__).parent / "data" / "island_ghi.csv"
MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
TROPIC = 30.0  # [°] of latitude
REGIONS = {
    "AK": "Alaska",
    "HI": "tropical islands",
    "PR": "tropical islands",
    "VI": "tropical islands",
}
REGIONS["GU"] = "tropical islands"


def main():
    """Print the tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tmy3", type=Path, nargs="?", help="folder with files *.tmy3")
    options = parser.parse_args()
    table = pd.read_csv(ISLANDS)
    table["error"] = [
        compare_year(*row) for row in table[["latitude", "longitude", "annual"]].to_numpy()
    ]
    typical = table[table["source"] == "TMY3"]
    tropical = typical["latitude"] < TROPIC
    print_stations("TMY3, tropical islands", typical[tropical])
    print_stations("TMY3, islands farther north", typical[~tropical])
    print_stations("NASA POWER, islands", table[table["source"] == "NASA POWER"])
    if options.tmy3:
        print_regions(options.tmy3)


def compare_year(latitude, longitude, annual):
    """Error of the climate's annual GHI [%] against a sum [kWh/m²]."""
    return 100 * (365 * look_up_normals(latitude, longitude).ghi / annual - 1)


def print_stations(title, stations):
    """One line per station, with the root mean square of its months where they are known."""
    print(
        f"\n## {title}\n\n| station | GHI | climate | error % | months, rms % "
        "|\n|---|--:|--:|--:|--:|"
    )
    for _, row in stations.iterrows():
        climate = row["annual"] * (1 + row["error"] / 100)
        months = "" if np.isnan(row["jan"]) else f"{compare_months(row):.1f}"
        print(
            f"| {row['station']} | {row['annual']:,.0f} | {climate:,.0f} | {row['error']:+.1f} | "
            f"{months} |"
        )
    print(f"\n{describe(stations['error'])}")


def compare_months(row):
    """Root mean square error of the months' GHI [%] over the mean month, each scaled to the
    station's year.
    """
    station = row[MONTHS].to_numpy(float)
    place, times = (row["latitude"], row["longitude"]), hours_of_year(2021)
    normals = look_up_normals(*place)
    annual = np.array([[365_000.0 * normals.ghi]])
    sky = cleanest_sky([place], times, np.array([[look_up_altitude(*place)]]), annual)
    months = monthly_sums(annual, [normals], sky, times)[0]
    difference = months / months.sum() - station / station.sum()
    return 1200 * np.sqrt((difference**2).mean())


def describe(errors):
    """Mean, scatter and number within 10 % of errors, in words."""
    within = (errors.abs() <= 10).sum()
    spread = f"mean {errors.mean():+.1f} %, standard deviation {errors.std():.1f} %"
    return (
        f"{spread}, {within} of {len(errors)} within 10 %, from {errors.min():+.1f} to "
        f"{errors.max():+.1f} %."
    )


def print_regions(folder):
    """Errors of the year at all stations of a folder, by region."""
    stations = [read_station(path) for path in sorted(folder.glob("**/*.tmy3"))]
    errors = pd.DataFrame(stations, columns=["region", "error"])
    print("\n## All stations of the folder\n")
    for region, own in errors.groupby("region"):
        print(f"- {region}: {describe(own['error'])}")


def read_station(path):
    """Region of a station's typical year and error of the climate there [%]."""
    with path.open(encoding="latin-1") as file:
        state, _, latitude, longitude = file.readline().replace('"', "").rsplit(",", 5)[1:5]
        ghi = pd.read_csv(file, usecols=["GHI (W/m^2)"]).sum().item() / 1000
    return REGIONS.get(state, "rest of the USA"), compare_year(
        float(latitude), float(longitude), ghi
    )


if __name__ == "__main__":
    main()
