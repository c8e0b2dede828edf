"""Runs of outlines with heights: tables, report, map and variants."""

import json
import sqlite3
from contextlib import closing

import numpy as np
import pandas as pd
import pytest
from footprint_text import feature, square, write_map
from test_footprints import volume

from citypv.__main__ import main
from citypv.core.results.read_results import read_results
from citypv.core.run.study import read_buildings
from citypv.core.settings.request import Request

pytestmark = pytest.mark.slow

FEW = ["--weather", "clear-sky", "--samples", "64", "--suns", "days:2", "--threads", "1", "--quiet"]
LICENCE = "City of Elsewhere, CC BY 4.0"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result folder of three outlines on ground at 100 m, which can be edited."""
    folder = tmp_path_factory.mktemp("outlines")
    houses = [
        feature(square(0, 0), "way/1", height=8, ground_height=100),
        feature(square(30, 0), "way/2", floors=3, ground_height=100),
        feature(square(60, 0), "way/3", ground_height=100),
    ]
    path = write_map(folder / "town.geojson", *houses, attribution=LICENCE)
    made = [
        "simulate",
        str(path),
        "--default-height",
        "5",
        "--out",
        str(folder / "base"),
        *("--editable", "--cityjson", "--geopackage"),
    ]
    assert main([*made, *FEW]) == 0
    return folder


def test_tables_and_report_say_what_the_heights_are_worth(folder):
    table = pd.read_csv(folder / "base" / "buildings.csv").set_index("building_id")
    assert table["height_source"].to_dict() == {
        "way/1": "height",
        "way/2": "floors",
        "way/3": "default",
    }
    # A roof of 100 m², and four walls of 10 m times the height.
    area = table["eligible_area"].to_numpy()
    assert area == pytest.approx([100 + 40 * 8, 100 + 40 * 9, 100 + 40 * 5], rel=1e-5)
    summary = json.loads((folder / "base" / "summary.json").read_text("utf-8"))
    assert summary["input"]["report"]["lods_chosen"] == {"1": 18}
    assert main(["plot", str(folder / "base"), "--quiet"]) == 0
    page = (folder / "base" / "report.html").read_text("utf-8")
    for words in (
        "LoD1: roofs are flat.",
        "1 by the number of floors, 1 by --default-height, of 3 buildings",
        LICENCE,
    ):
        assert words in page


def test_a_map_names_whom_its_files_name(folder):
    assert main(["site", str(folder / "base"), "--out", str(folder / "web"), "--quiet"]) == 0
    assert LICENCE in (folder / "web" / "index.html").read_text("utf-8")


def test_outlines_are_edited_by_their_ids(folder):
    """Raised, removed, and added from another map, which stands on the ground of the base."""
    added = write_map(folder / "new.geojson", feature(square(0, 30), "way/4", height=7))
    edit = ["variant", str(folder / "base"), "--raise", "way/1=3", "--remove", "way/2"]
    edit += ["--add", str(added), "--out", str(folder / "edited"), "--quiet"]
    assert main(edit) == 0
    results = read_results(folder / "edited")
    faces, outlines = results.faces, results.outlines
    assert set(faces["building_id"]) == {"way/1", "way/3", "way/4"}
    heights = {}
    for row, name in enumerate(faces["building_id"]):
        z = np.concatenate(outlines.rings(row))[:, 2]
        low, high = heights.get(name, (np.inf, -np.inf))
        heights[name] = min(low, z.min()), max(high, z.max())
    assert heights["way/1"] == pytest.approx((0, 11), abs=1e-3)
    assert heights["way/4"] == pytest.approx((0, 7), abs=1e-3)
    table = pd.read_csv(folder / "edited" / "buildings.csv").set_index("building_id")
    assert table["height_source"]["way/4"] == "height"


def test_what_is_written_in_degrees_is_read_again(folder):
    """CityJSON names CRS84; the GeoPackage's buildings say what their heights are worth."""
    city = read_buildings([folder / "base" / "city.city.json"], Request())
    assert volume(city) == pytest.approx(100 * (8 + 9 + 5), rel=1e-5)
    with closing(sqlite3.connect(folder / "base" / "city.gpkg")) as file:
        rows = file.execute(
            "SELECT building_id, height_source, typeof(height_source) FROM buildings"
        )
        assert sorted(rows.fetchall()) == [
            ("way/1", "height", "text"),
            ("way/2", "floors", "text"),
            ("way/3", "default", "text"),
        ]
