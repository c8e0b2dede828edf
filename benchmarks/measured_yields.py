"""Yields of the default settings beside those measured at two plants on roofs.

    python benchmarks/measured_yields.py [--weather climate|FILE]

Each plant is a shed of 10 m on open ground whose roof has the plant's tilt and azimuth; the
surroundings are not described, so nothing shades it. Only place and plane are told to the program:
module, mounting, losses, inverter and weather are the defaults. data/measured_yields.csv has the
measured months, data/ATTRIBUTION.md their source, results/measured_yields.md the result.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from citypv.core.run.study import compute_energy, read_scene, read_year, trace_scene
from citypv.core.settings.request import Request

MEASURED = Path(__file__).parent / "data" / "measured_yields.csv"
MONTHS = [f"{month:02d}" for month in range(1, 13)]
SIDE, EAVES = 10.0, 3.0  # [m]


def main():
    """Print both tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--weather", default="climate")
    options = parser.parse_args()
    table = pd.read_csv(MEASURED)
    found = [
        (*plant, own, compute_yield(*plant[1:], options.weather))
        for plant, own in list_plants(table)
    ]
    print("| plant | measured [kWh/kWp], by year | mean | default | error % | DC | error % of DC |")
    print("|---|---|--:|--:|--:|--:|--:|")
    for site, *_, own, (by_month, dc) in found:
        years = own[MONTHS].sum(axis=1)
        mean, ac = years.mean(), by_month.sum()
        each = ", ".join(
            f"{year}: {value:,.0f}" for year, value in zip(own["year"], years, strict=True)
        )
        print(
            f"| {site} | {each} | {mean:,.0f} | {ac:,.0f} | {show(ac, mean)} | {dc:,.0f} | "
            f"{show(dc, mean)} |"
        )
    print(f"\n| error of the month % | {' | '.join(MONTHS)} |\n|---|{'--:|' * 12}")
    for site, *_, own, (by_month, _) in found:
        print(f"| {site} | {' | '.join(map(show, by_month, own[MONTHS].mean()))} |")


def list_plants(table):
    """Plants with their years: list of ((site, latitude, longitude, tilt, azimuth),
    pandas.DataFrame).
    """
    return list(table.groupby(["site", "latitude", "longitude", "surface_tilt", "surface_azimuth"]))


def compute_yield(latitude, longitude, surface_tilt, surface_azimuth, weather):
    """Energy of each month over nominal power, (12,) [kWh/kWp], and that of the year before
    losses.
    """
    request = Request(latitude=latitude, longitude=longitude, up="z", unit="m", weather=weather)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shed.obj"
        path.write_text(write_shed(surface_tilt, surface_azimuth), encoding="utf-8")
        scene = read_scene([path], request)
    year = read_year(scene.site, request)
    energy = compute_energy(trace_scene(scene, year, request), year, request)
    (roof,) = np.flatnonzero(scene.surfaces.kind == "roof")
    np.testing.assert_allclose(scene.surfaces.surface_tilt[roof], surface_tilt, atol=0.01)
    np.testing.assert_allclose(scene.surfaces.surface_azimuth[roof], surface_azimuth, atol=0.01)
    return energy.full_load_hours_by_month[roof], energy.full_load_hours_dc[roof]


def write_shed(surface_tilt, surface_azimuth):
    """A shed whose roof falls towards an azimuth, as OBJ with z up."""
    # the first two at the eaves, which face south
    corners = SIDE / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    high = EAVES + (corners[:, 1] + SIDE / 2) * np.tan(np.radians(surface_tilt))
    turn = np.radians(180.0 - surface_azimuth)
    turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    points = [
        (*place, z) for z_all in (np.zeros(4), high) for place, z in zip(turned, z_all, strict=True)
    ]
    faces = ["5 6 7 8", "4 3 2 1", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    return "\n".join(["o shed", *lines, *(f"f {face}" for face in faces)]) + "\n"


def show(value, expected):
    """Signed difference in percent."""
    return f"{100 * (value / expected - 1):+.1f}".replace("-", "−")


if __name__ == "__main__":
    main()
