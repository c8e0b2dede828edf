"""How many patches reflections need: one size for all, or split where uneven light matters.

    python benchmarks/patches.py [--cities Berlin,town,Manhattan] [--errors 0.5,0.25] [--finest 2.5]

The Berlin tile, the middle of the town of tests/data/town.npz and of Midtown Manhattan, 51 suns of four typical days,
three reflections. Printed for each way: patches, processor time of pilots and run, and what all eligible surfaces and
facades (north east south west) receive more of reflected light, in percent, than with --finest everywhere: of
sky and suns. Last the error that the run itself estimates.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from citypv.core.city.city import City
from citypv.core.files.read_city import read_city
from citypv.core.progress import silent
from citypv.core.radiosity.measure_unevenness import measure_unevenness
from citypv.core.radiosity.trace_gather import trace_gather
from citypv.core.request import Request
from citypv.core.scene.classify import classify, measure_tilt
from citypv.core.scene.scene import Scene, Site, Surfaces
from citypv.core.split_uneven_patches import (
    COARSEST,
    NO_HALVINGS,
    SUNS_WORSE,
    judge_choice,
    measure_edges,
    refine_patches,
    split_uneven_patches,
)
from citypv.core.study import place_city
from citypv.core.sun.choose_suns import choose_suns

ROOT = Path(__file__).parents[1]
REQUEST = Request(latitude=52.5, longitude=13.4)
DEFAULT = 10.0  # [m]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cities", default=",".join(CITIES))
    parser.add_argument("--errors", default="0.5,0.25", help="[%%]")
    parser.add_argument("--finest", type=float, default=2.5, help="[m]")
    options = parser.parse_args()
    for city in options.cities.split(","):
        stand = CITIES[city]()
        known = measure(stand(options.finest))
        print(f"{city}: {known['patches']:,} patches of {options.finest:g} m in {known['seconds']:.0f} s", flush=True)
        tell(f"{DEFAULT:g} m", measure(stand(DEFAULT)), known)
        for error in map(float, options.errors.split(",")):
            size, pilot = choose_one_size(stand, error)
            tell(f"{error:g} %, one size of {size:.1f} m", measure(stand(size)), known, pilot)
            started = time.process_time()
            scene, account = split_uneven_patches(stand(COARSEST), replace(REQUEST, patch_error=error), silent)
            pilot = time.process_time() - started
            tell(f"{error:g} %, split from {account['given']:,}", measure(scene), known, pilot)


def measure(scene):
    """Reflected light of a scene: patches, seconds, and by surface that of the sky and of the suns."""
    started = time.process_time()
    transfer = trace_gather(scene, SUNS, REQUEST, silent)
    return {
        "patches": len(scene.triangles),
        "seconds": time.process_time() - started,
        "sky": transfer.diffuse_relative - transfer.sky_view_factor,
        "suns": transfer.direct_reflected @ SUNS.weight,
        "surfaces": scene.surfaces,
        "budget": 100 / 3 * max(map(abs, transfer.settings["estimate_discretisation_error"].values())),
    }


def choose_one_size(stand, error):
    """Size of patches so that all of them together leave the error, from the same pilot: size, its seconds."""
    scene, started = stand(DEFAULT), time.process_time()
    left = judge_choice(100 * SUNS_WORSE / 2 * measure_unevenness(scene, REQUEST, silent), NO_HALVINGS)
    return DEFAULT * error / left, time.process_time() - started


def tell(way, found, known, pilot=0.0):
    """One line."""
    surfaces = known["surfaces"]
    area = np.where(surfaces.eligible, surfaces.area, 0)
    facade = surfaces.kind == "facade"
    groups = [facade & (surfaces.orientation == side) for side in ("north", "east", "south", "west")]
    words = f"  {way:28} {found['patches']:9,} patches, {pilot:4.1f} + {found['seconds']:5.1f} s"
    for part in ("sky", "suns"):
        more, whole = area * (found[part] - known[part]), area * known[part]
        sides = " ".join(f"{100 * more[group].sum() / whole[group].sum():+.2f}" for group in groups)
        words += f", {part} {100 * more.sum() / whole.sum():+.2f} ({sides})"
    print(f"{words}, estimated {found['budget']:.2f}", flush=True)


def stand_berlin():
    """The tile, by size of patches."""
    city = read_city([ROOT / "examples" / "berlin" / "berlin_3910_5817.gml"])
    return lambda size: place_city(city, replace(REQUEST, patch_size=size))


def stand_manhattan(half=120.0):
    """Buildings within `half` metres of the middle, by size of patches."""
    city = read_city([ROOT / "tests" / "data" / "obj" / "nyc_midtown_citicorp_1km.obj.gz"])
    _, building = np.unique(city.building_id, return_inverse=True)
    rings = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    of_point = building[np.repeat(rings, np.diff(city.ring_start))]
    count = np.bincount(of_point)
    middle = np.stack([np.bincount(of_point, city.points[:, axis]) / count for axis in (0, 1)], axis=1)
    near = (np.abs(middle - np.median(middle, axis=0)).max(axis=1) < half)[building]
    part = take_polygons(city, np.flatnonzero(near))
    return lambda size: place_city(part, replace(REQUEST, latitude=40.757, longitude=-73.97, patch_size=size))


def take_polygons(city, chosen):
    """A city of some polygons."""
    rings = [city.rings(polygon) for polygon in chosen]
    lengths = [len(ring) for polygon in rings for ring in polygon]
    return City(
        surface_id=[city.surface_id[polygon] for polygon in chosen],
        building_id=[city.building_id[polygon] for polygon in chosen],
        thematic=[city.thematic[polygon] for polygon in chosen],
        points=np.concatenate([ring for polygon in rings for ring in polygon]),
        ring_start=np.concatenate([[0], np.cumsum(lengths)]),
        polygon_start=np.concatenate([[0], np.cumsum([len(polygon) for polygon in rings])]),
        crs=city.crs,
    )


def stand_town(half=220.0):
    """Triangles within `half` metres of the middle, each a surface, by size of patches."""
    town = np.load(ROOT / "tests" / "data" / "town.npz")
    middle = town["vertices"][town["triangles"]].mean(axis=1)[:, :2]
    near = np.abs(middle - 500.0).max(axis=1) < half
    vertices, triangles = town["vertices"].astype(float), town["triangles"][near].astype(np.int32)
    used, corners = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], corners.reshape(-1, 3).astype(np.int32)
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    normal /= 2 * area[:, None]
    tilt, azimuth = measure_tilt(normal)
    count = len(triangles)
    names, nothing = [str(number) for number in range(count)], [""] * count
    surfaces = Surfaces(names, nothing, nothing, *classify(area, tilt, azimuth, nothing), area, tilt, azimuth, normal)
    dark = np.zeros(count, bool)
    site = Site(REQUEST.latitude, REQUEST.longitude, 0.0, 0.0, None, (0.0, 0.0, 0.0))
    whole = Scene(vertices, triangles, np.arange(count, dtype=np.int32), dark, dark.copy(), surfaces, site)
    return lambda size: refine_patches(whole, np.minimum(measure_edges(whole), size))


def four_days():
    """Suns of four typical days."""
    hours = pd.date_range("2021-01-01 00:30", periods=8760, freq="h", tz="UTC")
    year = hours, pd.Timedelta("1h"), REQUEST.latitude, REQUEST.longitude
    return choose_suns("typical-days:4", *year, REQUEST.seed)


CITIES = {"Berlin": stand_berlin, "town": stand_town, "Manhattan": stand_manhattan}
SUNS = four_days()

if __name__ == "__main__":
    main()
