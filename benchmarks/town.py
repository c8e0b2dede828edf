"""Time for a town of 91,764 triangles, from its CityGML file to faces.csv.

    python benchmarks/town.py [--runs 3] [--options '--suns hourly']

The town of tests/data/town.npz is written as CityGML at 52.5° N (so that reading counts), then
simulated with ERA5 of 2017, 12 typical days and 3 reflections. Printed: wall seconds, peak memory,
seconds per stage, and the share of the processors' time that was spent in Embree.
"""

import argparse
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
WEATHER = ROOT / "examples" / "berlin" / "era5_berlin_2017.nc"
CORNER = np.array([390_000.0, 5_817_500.0, 35.0])  # of the town in EPSG:25833

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:bldg="http://www.opengis.net/citygml/building/2.0"
 xmlns:gml="http://www.opengis.net/gml"><gml:boundedBy><gml:Envelope srsName="EPSG:25833" srsDimension="3">
<gml:lowerCorner>{low}</gml:lowerCorner><gml:upperCorner>{high}</gml:upperCorner></gml:Envelope></gml:boundedBy>
"""
POLYGON = (
    "<gml:surfaceMember><gml:Polygon "
    'gml:id="t{number}"><gml:exterior><gml:LinearRing><gml:posList>{points}'
    "</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon></gml:surfaceMember>\n"
)


def write_town(path):
    """Write the town with one building per connected part of its mesh."""
    town = np.load(ROOT / "tests" / "data" / "town.npz")
    points, triangles = town["vertices"] + CORNER, town["triangles"]
    links = coo_matrix(
        (np.ones(2 * len(triangles)), (triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())),
        shape=(len(points), len(points)),
    )
    building = connected_components(links, directed=False)[1][triangles[:, 0]]
    text = points[triangles[:, [0, 1, 2, 0]]].reshape(len(triangles), 12)
    with path.open("w", encoding="utf-8") as file:
        low, high = (
            " ".join(f"{value:.3f}" for value in corner)
            for corner in (points.min(0), points.max(0))
        )
        file.write(HEAD.format(low=low, high=high))
        for number in np.unique(building):
            file.write(
                f'<cityObjectMember><bldg:Building gml:id="b{number}"><bldg:lod2MultiSurface>'
            )
            file.write("<gml:MultiSurface>\n")
            for triangle in np.flatnonzero(building == number):
                row = " ".join(f"{value:.4f}" for value in text[triangle])
                file.write(POLYGON.format(number=triangle, points=row))
            file.write(
                "</gml:MultiSurface></bldg:lod2MultiSurface></bldg:Building></cityObjectMember>\n"
            )
        file.write("</CityModel>\n")


def run_once(city, folder, options):
    """Simulate once: (wall seconds, summary)."""
    command = [
        sys.executable,
        "-m",
        "citypv",
        "simulate",
        str(city),
        "--weather",
        str(WEATHER),
        "--out",
        str(folder),
    ]
    command += ["--overwrite", "--quiet", "--ground", "none", "--patch-size", "none", *options]
    started = time.perf_counter()
    subprocess.run(command, check=True, cwd=folder.parent)
    return time.perf_counter() - started, json.loads((folder / "summary.json").read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--options", default="", help="further options of citypv simulate")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        city = Path(work) / "town.gml"
        write_town(city)
        print(f"{city.name}: {city.stat().st_size / 1e6:.1f} MB, {os.cpu_count()} processors")
        walls = []
        for _ in range(options.runs):
            wall, summary = run_once(city, Path(work) / "results", shlex.split(options.options))
            walls.append(wall)
            stages = ", ".join(
                f"{name} {seconds:.1f}" for name, seconds in summary["seconds"].items()
            )
            traced = summary["traced"]
            share = traced["embree_thread_seconds"] / traced["threads"] / wall
            print(f"{wall:6.1f} s wall ({stages}), {share:.0%} of it in Embree")
        memory = summary["peak_memory_bytes"] / 1e9
        print(f"median {statistics.median(walls):.1f} s, peak memory {memory:.2f} GB")


if __name__ == "__main__":
    main()
