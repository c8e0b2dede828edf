"""Sums by district: which building lies where, and sums that are the city's."""

import json
import math
import re
import sqlite3
from contextlib import closing

import numpy as np
import pandas as pd
import pyproj
import pytest
import shapely
from small_city import EAST, FAST, NORTH, write_small_city

import citypv
from citypv.__main__ import main
from citypv.core.city.grid_cells import Outlines
from citypv.core.city.site import Site
from citypv.core.read.read_districts import read_districts
from citypv.core.results.compare_runs import list_differences
from citypv.core.results.districts import place_buildings
from citypv.core.results.draw_districts import draw_map
from citypv.core.results.group_sums import read_districts_of, read_uses_of
from citypv.core.results.read_results import read_summary
from citypv.core.settings.errors import InputError

SITE = Site(52.5, 13.4, 34.0, 0.0, None, (0.0, 0.0, 0.0))
CITY = np.array([[0.0, -3.0], [30.0, 33.0]])  # [m] bounds of the small city's three houses
# In plan of the small city: house a and a third of b; the rest of b, whose middle is at x = 25.
WEST, EASTERN = shapely.box(-10, -10, 23, 20), shapely.box(23, -10, 60, 20)


def write_map(path, shapes, names, *, column="name", crs="EPSG:25833", shift=(EAST, NORTH)):
    """GeoJSON of districts in the plan of the small city; None in place of a name leaves it out."""
    features = [
        {
            "type": "Feature",
            "properties": {"number": row, column: name},
            "geometry": shapely.geometry.mapping(shapely.affinity.translate(shape, *shift)),
        }
        for row, (shape, name) in enumerate(zip(shapes, names, strict=True))
    ]
    collection = {"type": "FeatureCollection", "features": features}
    if crs:
        collection["crs"] = {"type": "name", "properties": {"name": crs}}
    path.write_text(json.dumps(collection), "utf-8")
    return path


def flat_city(boxes):
    """A flat roof and a wall for each box (x0, y0, x1, y1) [m]: Outlines, and each one's building."""
    rings = []
    for x0, y0, x1, y1 in boxes:
        rings.append([(x0, y0, 9), (x1, y0, 9), (x1, y1, 9), (x0, y1, 9)])
        rings.append([(x0, y0, 0), (x1, y0, 0), (x1, y0, 9), (x0, y0, 9)])
    start = 4 * np.arange(len(rings) + 1)
    outlines = Outlines(np.concatenate(rings).astype(np.float32), start, np.arange(len(rings) + 1))
    return outlines, np.repeat(np.arange(len(boxes)), 2)


def test_a_building_lies_where_most_of_its_area_does():
    """By hand: within, on a border with 6 and 4 m, with more outside, far away, around a hole."""
    ring = shapely.box(40, 0, 80, 40) - shapely.box(50, 10, 70, 30)
    shapes = np.array([shapely.box(0, 0, 20, 40), shapely.box(20, 0, 40, 40), ring])
    boxes = [(2, 2, 8, 8), (16, 2, 26, 8), (34, -8, 40, 2), (500, 0, 510, 9), (55, 15, 60, 20)]
    boxes += [(48, 12, 60, 20), (42, 2, 78, 8)]
    place, divided = place_buildings(*flat_city(boxes), len(boxes), shapes)
    assert place.tolist() == [0, 1, 3, 3, 3, 3, 2]
    assert divided.tolist() == [False, True, True, False, False, True, False]


def test_places_agree_with_shares_of_area_of_shapely():
    """400 houses on a net of 5 × 5 slanted districts, against the overlay of their boxes."""
    rng = np.random.default_rng(5)
    low = rng.uniform(-20, 520, (400, 2))
    boxes = np.column_stack([low, low + rng.uniform(4, 60, (400, 2))]).round(2)
    cells = [
        shapely.box(x, y, x + 100, y + 100) for x in range(0, 500, 100) for y in range(0, 500, 100)
    ]
    shapes = np.array([shapely.affinity.skew(cell, 12, origin=(0, 0)) for cell in cells])
    place, divided = place_buildings(*flat_city(boxes), len(boxes), shapes)
    plans = shapely.box(*boxes.T)
    shares = shapely.area(shapely.intersection(plans[:, None], shapes[None]))
    shares = np.column_stack([shares, shapely.area(plans) - shares.sum(axis=1)])
    assert (place == shares.argmax(axis=1)).all()
    assert (divided == ((shares > 1e-3 * shapely.area(plans)[:, None]).sum(axis=1) > 1)).all()
    assert 50 < divided.sum() < 350 and (place == 25).any()


@pytest.mark.parametrize("kind", ["degrees", "plane", "package"])
def test_districts_of_any_system_lie_at_the_city(tmp_path, kind):
    """A ring with a hole in two parts of one name; corners in degrees by the geodesic of WGS 84."""
    geod = pyproj.Geod(ellps="WGS84")

    def on_earth(points):
        distance, azimuth = np.hypot(*points.T), np.degrees(np.arctan2(*points.T))
        ones = np.ones(len(points))
        return np.column_stack(geod.fwd(13.4 * ones, 52.5 * ones, azimuth, distance)[:2])

    hole = shapely.box(-5, -5, 25, 50) - shapely.box(0, 12, 10, 22)
    plans, names = [hole, shapely.box(25, -5, 60, 50)], ["Altstadt", "Altstadt"]
    degrees = [shapely.transform(plan, on_earth) for plan in plans]
    path = tmp_path / "map.geojson"
    if kind == "degrees":
        write_map(path, degrees, names, crs=None, shift=(0, 0))
    elif kind == "plane":
        turn = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:3857", always_xy=True)
        there = [
            shapely.transform(shape, lambda x: np.column_stack(turn.transform(*x.T)))
            for shape in degrees
        ]
        write_map(path, there, names, crs="urn:ogc:def:crs:EPSG::3857", shift=(0, 0))
    else:
        path = write_package(tmp_path / "map.gpkg", degrees, names)
    districts = read_districts(str(path), SITE, CITY)
    assert districts.names == ["Altstadt"]
    assert districts.shapes[0].area == pytest.approx(65 * 55 - 100, rel=1e-4)
    assert districts.shapes[0].symmetric_difference(shapely.union_all(plans)).area < 0.1


def test_a_long_border_along_a_parallel_bends_with_it(tmp_path):
    """Two degrees of the parallel of the site, of which the chord lies 0.4 km further north."""
    path = write_map(
        tmp_path / "map.geojson",
        [shapely.box(12.4, 52, 14.4, 52.5), shapely.box(12.4, 52.5, 14.4, 53)],
        ["South", "North"],
        crs=None,
        shift=(0, 0),
    )
    districts = read_districts(str(path), SITE, CITY)
    x = np.arange(-1000.0, 1000.0, 50.0)
    # [m] the parallel in the plan of the site
    y = x**2 * np.tan(np.radians(52.5)) / (2 * 6_391_000)
    for name, aside in (("South", -0.1), ("North", 0.1)):
        shape = districts.shapes[districts.names.index(name)]
        assert shapely.contains_xy(shape, x, y + aside).all()
        assert not shapely.contains_xy(shape, x, y - aside).any()


def write_package(path, shapes, names):
    """GeoPackage with a layer of districts, in degrees, beside one of other things."""
    with closing(sqlite3.connect(path)) as file, file:
        file.executescript(
            "CREATE TABLE gpkg_geometry_columns (table_name, column_name, srs_id);"
            "CREATE TABLE gpkg_spatial_ref_sys (organization, organization_coordsys_id, definition, srs_id);"
            "INSERT INTO gpkg_spatial_ref_sys VALUES ('EPSG', 4326, '', 4326);"
            "CREATE TABLE roads (fid, geom, speed);"
            "CREATE TABLE ortsteile (fid, geom, OTEIL);"
            "INSERT INTO gpkg_geometry_columns VALUES ('roads', 'geom', 4326), ('ortsteile', 'geom', 4326);"
        )
        head = b"GP\0\1" + (4326).to_bytes(4, "little")
        rows = [
            (k, head + shapely.to_wkb(shape), name)
            for k, (shape, name) in enumerate(zip(shapes, names, strict=True))
        ]
        file.executemany("INSERT INTO ortsteile VALUES (?, ?, ?)", rows)
    return path


@pytest.mark.parametrize(
    ("shapes", "names", "how", "words"),
    [
        ([WEST], ["x"], {"column": "key"}, r"no column such as name, .*number, key.*FILE:COLUMN"),
        ([WEST, EASTERN], ["x", None], {}, "feature 2 has 'nothing' in column name"),
        ([WEST], ["outside"], {}, "feature 1 has 'outside' in column name"),
        ([WEST, shapely.box(0, 0, 60, 20)], ["x", "y"], {}, r"'x' and 'y' overlap by 460 m²"),
        ([WEST], ["x"], {"crs": None}, "names no coordinate reference system"),
        ([WEST], ["x"], {"crs": "EPSG:99999"}, "not known, 'EPSG:99999'"),
        ([WEST], ["x"], {"shift": (NORTH, EAST)}, "has no district at the city"),
        ([shapely.Point(0, 0)], ["x"], {}, "contains no outlines"),
    ],
)
def test_districts_that_cannot_be_used_are_refused(tmp_path, shapes, names, how, words):
    path = write_map(tmp_path / "map.geojson", shapes, names, **how)
    site = Site(52.4974, 13.3797, 34.0, 0.0, "EPSG:25833", (EAST, NORTH, 30.0))
    site.latitude, site.longitude = map(float, place_of(EAST, NORTH))
    with pytest.raises(InputError, match=words) as error:
        read_districts(str(path), site, CITY)
    assert error.value.source == str(path)


def place_of(east, north):
    return pyproj.Transformer.from_crs("EPSG:25833", "EPSG:4326").transform(east, north)


def test_a_file_of_another_kind_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"CityGML.*not a map of districts"):
        read_districts(str(write_small_city(tmp_path / "city.gml")), SITE, CITY)
    with pytest.raises(InputError, match=r"none\.gpkg: no such file"):
        read_districts(str(tmp_path / "none.gpkg"), SITE, CITY)


@pytest.fixture(scope="module")
def traced(tmp_path_factory):
    """The small city's results, and the map that they were summed by."""
    folder = tmp_path_factory.mktemp("districts")
    city = write_small_city(folder / "city.gml")
    districts = write_map(folder / "map.geojson", [WEST, EASTERN], ["West", "Ost"], column="key")
    command = ["simulate", str(city), "--out", str(folder / "out"), *FAST]
    assert main([*command, "--districts", f"{districts}:key"]) == 0
    return folder / "out", districts


@pytest.mark.slow
def test_rows_of_districts_are_the_city(traced):
    """a in the west, b with 7 of 10 m in the east, c in neither; sums are those of buildings.csv."""
    folder, _ = traced
    table = citypv.read_results(folder).districts
    buildings = pd.read_csv(folder / "buildings.csv").set_index("building_id")
    assert table["district"].tolist() == ["West", "Ost", "outside"]
    assert table["buildings"].tolist() == [1, 1, 1]
    assert table["border_buildings"].tolist() == [0, 1, 0]
    shared = [name for name in table if name in buildings and name != "p90_mwh_per_year"]
    assert {"module_count", "kwp", "facade_mwh_standard_error", "full_load_hours"} <= set(shared)
    for name in shared:  # of one building each
        assert table[name].tolist() == buildings.loc[["a", "b", "c"], name].tolist(), name
    totals = json.loads((folder / "summary.json").read_text("utf-8"))["totals"]
    for name in ("module_area", "module_count", "kwp", "mwh_per_year", "eligible_area"):
        assert table[name].sum() == pytest.approx(totals[name], rel=1e-5), name


@pytest.mark.slow
def test_yield_sums_two_buildings_as_one(traced, tmp_path):
    """One district with a and b: numbers add up, errors are between their root of squares and sum."""
    folder, _ = traced
    path = write_map(tmp_path / "one.geojson", [WEST | EASTERN], ["One"])
    command = ["yield", str(folder), "--out", str(tmp_path / "out"), "--quiet"]
    assert main([*command, "--districts", str(path)]) == 0
    one = pd.read_csv(tmp_path / "out" / "districts.csv").set_index("district").loc["One"]
    pair = pd.read_csv(folder / "buildings.csv").set_index("building_id").loc[["a", "b"]]
    assert one["buildings"] == 2 and one["border_buildings"] == 0
    assert one["mwh_per_year"] == pytest.approx(pair["mwh_per_year"].sum(), rel=1e-5)
    errors = pair["mwh_standard_error"]
    assert 0.99 * math.hypot(*errors) < one["mwh_standard_error"] < 1.01 * errors.sum()
    mean = (pair["kwp"] * pair["full_load_hours"]).sum() / pair["kwp"].sum()
    assert one["full_load_hours"] == pytest.approx(mean, rel=1e-5)
    # Other districts are no other state of the city.
    summaries = [read_summary(path / "summary.json") for path in (folder, tmp_path / "out")]
    assert summaries[0]["settings"]["districts"] != summaries[1]["settings"]["districts"]
    assert list_differences(*summaries) == []


@pytest.mark.slow
def test_shapes_are_written_with_their_sums(traced):
    folder, _ = traced
    shapes = json.loads((folder / "districts.geojson").read_text("utf-8"))["features"]
    table = pd.read_csv(folder / "districts.csv")
    assert [one["properties"]["district"] for one in shapes] == table["district"].tolist()
    assert [round(one["properties"]["kwp"], 2) for one in shapes] == table["kwp"].round(2).tolist()
    assert shapes[-1]["geometry"] is None
    turn = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:25833", always_xy=True)
    back = shapely.transform(
        shapely.geometry.shape(shapes[0]["geometry"]),
        lambda x: np.column_stack(turn.transform(*x.T)),
    )
    west = shapely.affinity.translate(WEST, EAST, NORTH)
    assert back.symmetric_difference(west).area < 1.0


@pytest.mark.slow
def test_a_run_refuses_districts_before_it_traces(tmp_path, capsys):
    city = write_small_city(tmp_path / "city.gml")
    path = write_map(tmp_path / "far.geojson", [WEST], ["x"], shift=(EAST + 9000, NORTH))
    command = ["simulate", str(city), "--out", str(tmp_path / "out"), *FAST]
    assert main([*command, "--districts", str(path)]) == 2
    assert "has no district at the city" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_report_and_map_show_the_sums(traced, tmp_path):
    """The last row of the table has the city's totals, as the report writes them."""
    folder, _ = traced
    assert main(["plot", str(folder), "--quiet"]) == 0
    assert main(["site", str(folder), "--out", str(tmp_path / "web"), "--quiet"]) == 0
    totals = json.loads((folder / "summary.json").read_text("utf-8"))["totals"]
    for page in (folder / "report.html", tmp_path / "web" / "index.html"):
        part = page.read_text("utf-8").partition("<h2>Sums by district</h2>")[2]
        rows = re.findall(r"<tr>(.+?)</tr>", part.partition("</table>")[0])
        cells = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in rows]
        assert [row[0] for row in cells[1:]] == ["West", "Ost", "in no district", "All"]
        names = ("mwh_per_year", "kwp", "full_load_hours", "module_count", "module_area")
        shown = [cells[-1][1], *cells[-1][3:7]]
        assert shown == [f"{totals[name]:,.0f}" for name in names]
        assert re.findall("<title>(.*?)</title>", part)[:2] == [
            f"{row[0]}: {row[1]} MWh" for row in cells[1:3]
        ]


@pytest.mark.slow
def test_sums_of_several_folders_add_up(traced, tmp_path):
    """Twice the same city: twice its energy, and one row for each district."""
    folder, _ = traced
    (once, twice) = (read_districts_of([folder] * count) for count in (1, 2))
    assert [row["name"] for row in twice] == ["West", "Ost", "in no district"]
    assert [row["kwp"] for row in twice] == [2 * row["kwp"] for row in once]
    assert read_districts_of([tmp_path]) == []
    with pytest.raises(InputError, match="another folder has one"):
        read_districts_of([folder, tmp_path])


def test_the_map_is_true_to_scale_and_names_can_be_read():
    """Two squares of one degree at 60° north: half as wide as high; black on yellow, white on blue."""
    squares = [
        ("Ost", shapely.box(11, 59.5, 12, 60.5), 9000.0),
        ("West", shapely.box(10, 59.5, 11, 60.5), 0.0),
    ]
    rows = [
        {"name": name, "shape": shape, "kwp": 1.0, "mwh_per_year": energy, "buildings": 1}
        | dict.fromkeys(
            ("border_buildings", "module_count", "module_area", "mwh_standard_error"), 0
        )
        for name, shape, energy in squares
    ]
    html = draw_map(rows)
    # Drawn as large as its view, so that narrow districts do not fill the width of the page.
    drawn = re.search(r'width="(\d+)" height="(\d+)" viewBox="0 0 (\d+) (\d+)"', html).groups()
    assert drawn[:2] == drawn[2:] and int(drawn[1]) <= 640
    paths = re.findall(r'<path d="M(.*?)Z" fill="(#\w+)"', html)
    corners = [np.array([point.split() for point in path.split("L")], float) for path, _ in paths]
    width, height = np.ptp(corners[0], axis=0)
    assert width / height == pytest.approx(0.5, abs=0.005)
    assert corners[1][:, 0].max() == pytest.approx(corners[0][:, 0].min(), abs=0.1)
    assert [colour for _, colour in paths] == ["#fde725", "#440154"]
    assert re.findall(r'fill="(#\w+)">(Ost|West)', html) == [("#000", "Ost"), ("#fff", "West")]


@pytest.mark.slow
def test_districts_given_to_a_traced_city(traced):
    """Sums of the tables are those of the run; errors of one building each, too, of more the sum."""
    folder, path = traced
    of_run, of_tables = (read_districts_of([folder], text) for text in (None, f"{path}:key"))
    for own, other in zip(of_run, of_tables, strict=True):
        for column in (
            "kwp",
            "mwh_per_year",
            "module_count",
            "mwh_standard_error",
            "border_buildings",
        ):
            assert own[column] == pytest.approx(other[column], rel=1e-5), column
        assert own["name"] == other["name"] and own["shape"] == other["shape"]


@pytest.mark.slow
def test_uses_are_summed(traced):
    """a, of which the file tells what it is for, and b and c, of which it does not."""
    folder, _ = traced
    table = pd.read_csv(folder / "uses.csv", keep_default_na=False).set_index("function")
    buildings = pd.read_csv(folder / "buildings.csv", keep_default_na=False)
    assert sorted(table["buildings"]) == [1, 2] and table.loc["", "buildings"] == 2
    for name in ("kwp", "module_count", "mwh_per_year", "facade_module_area"):
        sums = buildings.groupby("function")[name].sum()
        assert table[name].to_dict() == pytest.approx(sums.to_dict(), rel=1e-5), name
    assert list(table["mwh_per_year"]) == sorted(table["mwh_per_year"], reverse=True)
    rows = read_uses_of([folder])
    assert {row["name"]: row["buildings"] for row in rows} == {"not told": 2, table.index.max(): 1}
    (rest,) = [row for row in read_uses_of([folder], most=0) if row]
    assert rest["name"] == "2 others" and rest["buildings"] == 3
    assert rest["kwp"] == pytest.approx(buildings["kwp"].sum(), rel=1e-5)
