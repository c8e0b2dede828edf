"""Outlines of real files against counts and sizes of a few lines of json and pyproj."""

import csv
import gzip
import itertools
import json
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from test_footprints import areas, assert_closed, read, tops, volume

from citypv.core.read.footprint_names import FLOORS, HEIGHTS, find_names
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

DATA = Path(__file__).parents[1] / "data" / "footprints"
GLOBE = pyproj.Geod(ellps="WGS84")


def features_of(name):
    with gzip.open(DATA / name) as file:
        return json.load(file)["features"]


def shoelace(ring):
    x, y = np.array(ring)[:, :2].T
    return abs(x[:-1] @ y[1:] - x[1:] @ y[:-1]) / 2


def length(ring):
    return float(np.hypot(*np.diff(np.array(ring)[:, :2], axis=0).T).sum())


def test_tokyo():
    """Areas and edges on the ellipsoid, by pyproj."""
    features = features_of("tokyo_part.geojson.gz")
    city = read(DATA / "tokyo_part.geojson.gz")
    plan = walls = 0.0
    for one in features:
        area, edge = GLOBE.geometry_area_perimeter(shapely.geometry.shape(one["geometry"]))
        plan, walls = plan + abs(area), walls + edge * one["properties"]["height"]
    assert city.report.building_count == len(features) == 150
    found = areas(city)
    assert found["RoofSurface"] == pytest.approx(plan, rel=1e-4)
    assert found["WallSurface"] == pytest.approx(walls, rel=1e-4)
    heights = tops(city)
    assert {name: heights[name] for name in heights} == pytest.approx(
        {str(one["properties"]["id"]): one["properties"]["height"] for one in features}
    )


def test_geoclimate():
    """In metres of its own system; 3 m are a floor, not a measurement."""
    features = features_of("geoclimate_building_part.geojson.gz")
    assert len(features) == 164
    # One outline stands there twice, as a way and as a relation.
    again = [one for one in features if one["properties"]["ID_SOURCE"] == "r4269919"]
    features.remove(again[-1])
    city = read(DATA / "geoclimate_building_part.geojson.gz")
    rings = [one["geometry"]["coordinates"] for one in features]
    heights = [one["properties"]["HEIGHT_ROOF"] for one in features]
    holes = sum(len(own) - 1 for own in rings)
    assert city.report.skipped == {"outline already read": ["r4269919"]}
    assert city.report.building_count == len(features) == 163 and holes == 3
    plan = sum(shoelace(own[0]) - sum(map(shoelace, own[1:])) for own in rings)
    walls = sum(top * sum(map(length, own)) for own, top in zip(rings, heights, strict=True))
    found = areas(city)
    assert found["RoofSurface"] == pytest.approx(plan, rel=1e-4)
    assert found["WallSurface"] == pytest.approx(walls, rel=1e-4)
    assert int((np.diff(city.polygon_start) - 1).sum()) == 2 * holes
    three = sum(
        one["properties"]["HEIGHT_ROOF"] == 3 * one["properties"]["NB_LEV"] for one in features
    )
    assert city.report.height_sources == {"HEIGHT_ROOF": len(features) - three, "floors": three}
    assert_closed(city)


def overture(*ids):
    lines = (DATA / "overture.geojsonl").read_text("utf-8").splitlines()
    return [line for line in lines if json.loads(line)["id"] in ids]


def write_lines(path, lines):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def plan_of(line):
    return abs(GLOBE.geometry_area_perimeter(shapely.from_geojson(line, on_invalid="ignore"))[0])


def test_parts_of_overture(tmp_path):
    """An outline of 8 floors with parts of 8 and 3."""
    lines = overture(
        "overture:buildings:building:1234",
        "overture:buildings:part:100",
        "overture:buildings:part:101",
    )
    # Three examples have one id; the one with eight floors and an outline of parts is meant.
    lines = [line for line in lines if '"height"' not in line and "MultiPolygon" not in line]
    assert len(lines) == 3
    city = read(write_lines(tmp_path / "parts.geojsonl", lines))
    plans = {
        json.loads(line)["id"]: abs(
            GLOBE.geometry_area_perimeter(shapely.geometry.shape(json.loads(line)["geometry"]))[0]
        )
        for line in lines
    }
    expected = 24 * plans["overture:buildings:part:100"] + 9 * plans["overture:buildings:part:101"]
    assert volume(city) == pytest.approx(expected, rel=1e-4)
    assert set(city.building_id) == {"overture:buildings:building:1234"}
    assert city.report.building_count == 1 and city.report.part_count == 2
    assert city.report.attributions[0].startswith("© OpenStreetMap contributors")


def test_examples_of_overture_by_themselves(tmp_path):
    """A part hangs from 15 m on; a building with parts elsewhere is drawn itself; one without a
    height is refused.
    """
    hanging = overture("overture:buildings:part:1234")
    city = read(write_lines(tmp_path / "part.geojsonl", hanging))
    assert (city.points[:, 2].min(), city.points[:, 2].max()) == pytest.approx((15, 21.34))
    empire = overture("08b2a100d2d4bfff02006354283c153f")
    assert read(write_lines(tmp_path / "empire.geojsonl", empire)).points[:, 2].max() == 443.2
    plain = [line for line in overture("overture:buildings:building:1234") if '"height"' in line]
    assert read(write_lines(tmp_path / "plain.geojsonl", plain)).points[:, 2].max() == 21.34
    bare = [line for line in overture("overture:buildings:building:1234") if "MultiPolygon" in line]
    with pytest.raises(InputError, match=r"1 of 1 outlines \(100 %\) have neither"):
        read(write_lines(tmp_path / "bare.geojsonl", bare))


def names_of_producers():
    """Attributes with heights and floors of the data sets, without those that are paths."""
    for name in ("inputs-parsing.csv", "inputs-parsing-v1.csv"):
        with (DATA / name).open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                for key, table in (("height", HEIGHTS), ("floors", FLOORS)):
                    text = row[key].strip().partition("/")[0]
                    if text not in ("", "None") and "[" not in row[key].partition("/")[0]:
                        yield row["dataset_name"], text.replace("gen:doubleAttribute", ""), table


def test_names_of_official_data_sets_are_known():
    named = [(owner, text, table) for owner, text, table in names_of_producers() if text]
    assert len(named) >= 40
    unknown = [(owner, text) for owner, text, table in named if not find_names([text], table)]
    assert not unknown
    # So are those that a shapefile cuts, in any case.
    for (_, text, table), change in itertools.product(named, (str.upper, str.lower)):
        if text.isidentifier():
            assert find_names([change(text)[:10]], table) or (len(text) > 10 and ":" in text)
