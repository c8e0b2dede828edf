"""What a city loses as outlines with heights, and what 100,000 outlines cost to read.

    python benchmarks/footprints.py examples/berlin/berlin_3910_5817.gml \
        examples/world/denhaag_01_lod2_v1.gml.gz
    python benchmarks/footprints.py --count 100000

Of each city in LoD2, the ground surfaces of a building become its outline, and its height the one
that surveys write: of its highest point above its lowest (`measuredHeight`), or the median of its
roofs by area (3DBAG's `b3_h_dak_50p`). Both maps are simulated like the city itself, and compared
by kind: area that counts, full load hours, energy in a year.
"""

import argparse
import json
import math
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
import shapely

import citypv
from citypv.core.city.polygons import measure_polygons
from citypv.core.run.study import read_buildings
from citypv.core.settings.request import Request

HEIGHTS = ("highest point", "median of roofs")
KINDS = {
    "facades": ("facade",),
    "roofs": ("roof", "steep", "flat"),
    "all": ("facade", "roof", "steep", "flat"),
}
SHAPES = (  # [m] outlines of 4, 6 and 10 corners
    [(0, 0), (10, 0), (10, 10), (0, 10)],
    [(0, 0), (12, 0), (12, 8), (7, 8), (7, 14), (0, 14)],
    [(0, 0), (6, 0), (6, -2), (9, -2), (9, 0), (14, 0), (14, 9), (9, 9), (9, 12), (0, 12)],
)


def write_city(city, path, height):
    """Write the buildings of a city as GeoJSON in its own plane."""
    area, normal = measure_polygons(*city.shape)
    names, thematic = np.array(city.building_id), np.array(city.thematic)
    corner = np.repeat(np.arange(len(city)), np.diff(city.ring_start[city.polygon_start]))
    features = []
    for name in dict.fromkeys(city.building_id):
        own = names == name
        grounds = [city.rings(k) for k in np.flatnonzero(own & (thematic == "GroundSurface"))]
        parts = [
            shapely.Polygon(rings[0][:, :2], [ring[:, :2] for ring in rings[1:]])
            for rings in grounds
        ]
        if not parts:
            continue
        outline = shapely.union_all(shapely.make_valid(np.array(parts)))
        points = city.points[own[corner], 2]
        roofs = np.flatnonzero(own & (thematic == "RoofSurface"))
        middles = [
            np.mean([city.rings(k)[0][:, 2].min(), city.rings(k)[0][:, 2].max()]) for k in roofs
        ]
        top = points.max()
        if height == HEIGHTS[1] and len(roofs):
            order = np.argsort(middles)
            share = np.cumsum((area * np.abs(normal[:, 2]))[roofs][order])
            top = middles[order[np.searchsorted(share, share[-1] / 2)]]
        properties = {"height": round(float(top - points.min()), 2)}
        features.append(
            {
                "type": "Feature",
                "id": name,
                "properties": properties,
                "geometry": json.loads(shapely.to_geojson(outline)),
            }
        )
    crs = {"type": "name", "properties": {"name": city.plane or city.crs.partition("+")[0]}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))


def sum_kinds(result):
    """Area that counts [m²], energy [MWh] and hours of facades, roofs and all: dict."""
    kinds = result.summary["totals"]["kinds"]
    sums = {}
    for name, members in KINDS.items():
        rows = [kinds[one] for one in members if one in kinds]
        area, kwp, mwh = (
            sum(row[key] for row in rows) for key in ("module_area", "kwp", "mwh_per_year")
        )
        sums[name] = area, mwh, 1000 * mwh / kwp
    return sums


def compare_city(path, preset):
    """Print how far the maps of a city differ from it."""
    # Modules cover every square metre that counts, so that areas are compared.
    settings = {"preset": preset, "layout": "area"}
    whole = sum_kinds(citypv.simulate([path], **settings))
    city = read_buildings([path], Request())
    for name, (area, mwh, hours) in whole.items():
        print(f"| {path.name} | LoD2 | {name} | {area:,.0f} | {mwh:,.0f} | {hours:.0f} | | | |")
    with tempfile.TemporaryDirectory() as work:
        for height in HEIGHTS:
            write_city(city, Path(work) / "map.geojson", height)
            flat = sum_kinds(citypv.simulate([Path(work) / "map.geojson"], **settings))
            for name, values in flat.items():
                area, mwh, hours = values
                change = " | ".join(
                    f"{100 * (own / other - 1):+.1f} %".replace("-", "−")
                    for own, other in zip(values, whole[name], strict=True)
                )
                print(
                    f"| {path.name} | {height} | {name} | {area:,.0f} | {mwh:,.0f} | {hours:.0f} | {change} |"
                )


def write_many(path, count):
    """Write so many outlines of 4 to 10 corners, every way round, 30 m apart."""
    side = math.isqrt(count - 1) + 1
    with path.open("w") as file:
        file.write('{"type": "FeatureCollection", "features": [\n')
        for k in range(count):
            turn = math.radians(k % 90)
            corners = [
                (u * math.cos(turn) - v * math.sin(turn), u * math.sin(turn) + v * math.cos(turn))
                for u, v in SHAPES[k % 3]
            ]
            east, north = 30 * (k // side), 30 * (k % side)
            ring = [
                [round(13 + (east + x) / 68_000, 7), round(52.5 + (north + y) / 111_000, 7)]
                for x, y in [*corners, corners[0]]
            ]
            one = {
                "type": "Feature",
                "id": f"way/{k}",
                "properties": {
                    "building": "yes",
                    "height": 3 + k % 27 if k % 7 else None,
                    "building:levels": "3",
                },
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            }
            file.write(json.dumps(one) + (",\n" if k < count - 1 else "\n"))
        file.write("]}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="*", type=Path)
    parser.add_argument("--preset", default="standard")
    parser.add_argument("--count", type=int, default=0, help="outlines to read")
    options = parser.parse_args()
    for path in options.city:
        compare_city(path, options.preset)
    if options.count:
        with tempfile.TemporaryDirectory() as work:
            path = Path(work) / "many.geojson"
            write_many(path, options.count)
            started = time.process_time()
            city = read_buildings([path], Request())
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            size = path.stat().st_size / 1e6
            print(
                f"{city.report.building_count:,} outlines, {len(city):,} surfaces: "
                f"{time.process_time() - started:.1f} processor seconds, {peak:.2f} GB, file {size:.0f} MB"
            )


if __name__ == "__main__":
    main()
