"""What other programs are given: the same polygons, ids, areas and hours, by readers that are not
the writers.
"""

import argparse
import json
import sqlite3
import struct
import sys
from contextlib import closing
from types import ModuleType

import numpy as np
import pandas as pd
import pyproj
import pytest
import shapely
from read_glb import Glb
from small_city import FAST

from citypv.core.commands.add_options import add_output
from citypv.core.commands.command_line import main
from citypv.core.read.read_city import read_city
from citypv.core.results import exports
from citypv.core.results.colour_map import MAPS
from citypv.core.results.write_cityjson import name_system
from citypv.core.results.write_geopackage import TABLES, write_system
from citypv.core.run.write_run import Output
from citypv.core.settings.errors import InputError


@pytest.fixture(scope="module")
def document(small_results):
    return json.loads((small_results / "city.city.json").read_text(encoding="utf-8"))


def surfaces_of(document):
    """Semantic surface and rings of every polygon, as they stand in the file."""
    for item in document["CityObjects"].values():
        for geometry in item["geometry"]:
            semantics = geometry["semantics"]
            for rings, value in zip(geometry["boundaries"], semantics["values"], strict=True):
                yield semantics["surfaces"][value], rings


@pytest.mark.slow
def test_cityjson_has_the_rows_of_faces_csv(small_results, document):
    texts = {"reason": str, "reason_note": str}
    table = pd.read_csv(small_results / "faces.csv", dtype=texts).set_index("surface_id")
    table = table.fillna(dict.fromkeys(texts, ""))
    found = {surface["id"]: surface for surface, _ in surfaces_of(document)}
    assert set(found) == set(table.index)
    for name, row in table.iterrows():
        surface = found[name]
        assert surface["citypv_eligible"] == (str(row["eligible"]).lower() == "true")
        for column in ("kind", "orientation", *texts):
            assert surface.get(f"citypv_{column}", "") == row[column]
        for column in table.select_dtypes("number"):
            value = surface.get(f"citypv_{column}", np.nan)
            assert value == pytest.approx(row[column], rel=1e-6, nan_ok=True)
        if np.isfinite(row["full_load_hours"]):
            months = surface["citypv_full_load_hours_by_month"]
            assert len(months) == 12
            assert sum(months) == pytest.approx(row["full_load_hours"], rel=1e-4)


def test_cityjson_has_the_shapes_of_the_input(small_results, document):
    vertices = (
        np.array(document["vertices"]) * document["transform"]["scale"]
        + document["transform"]["translate"]
    )
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    before = read_city(small_results.parent / "city.gml")
    rings = {surface["id"]: vertices[boundary[0]] for surface, boundary in surfaces_of(document)}
    for k, name in enumerate(before.surface_id):
        assert rings[name] == pytest.approx(before.rings(k)[0], abs=1e-6)
    assert document["metadata"]["referenceSystem"].endswith("/EPSG/0/25833")
    types = {surface["id"]: surface["type"] for surface, _ in surfaces_of(document)}
    assert types == dict(zip(before.surface_id, before.thematic, strict=True))


def test_cityjson_sums_up_each_building(small_results, document):
    table = pd.read_csv(small_results / "faces.csv")
    summary = json.loads((small_results / "summary.json").read_text(encoding="utf-8"))
    kwp = energy = 0.0
    for name, item in document["CityObjects"].items():
        rows = table[
            (table["building_id"] == name) & table["eligible"].astype(str).str.lower().eq("true")
        ]
        attributes = item["attributes"]
        assert attributes["citypv_eligible_area"] == pytest.approx(
            rows["open_area"].sum(), rel=1e-5
        )
        on_open_area = rows["full_load_hours"] * rows["area"] / rows["open_area"]
        mean = (on_open_area * rows["kwp"]).sum() / rows["kwp"].sum()  # of the modules
        assert attributes["citypv_full_load_hours"] == pytest.approx(mean, rel=1e-4)
        assert sum(attributes["citypv_full_load_hours_by_month"]) == pytest.approx(mean, rel=1e-4)
        kwp, energy = kwp + attributes["citypv_kwp"], energy + attributes["citypv_mwh_per_year"]
    assert kwp == pytest.approx(summary["totals"]["kwp"], rel=1e-4)
    assert energy == pytest.approx(summary["totals"]["mwh_per_year"], rel=1e-4)


@pytest.mark.slow
def test_cells_are_exported_as_they_were_counted(small_results, tmp_path):
    options = [
        "--grid-size",
        "3",
        "--cityjson",
        "--gltf",
        "--ground",
        "none",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(["simulate", str(small_results.parent / "city.gml"), *options, *FAST]) == 0
    document = json.loads((tmp_path / "out" / "city.city.json").read_text(encoding="utf-8"))
    names = [surface["id"] for surface, _ in surfaces_of(document)]
    assert names == pd.read_csv(tmp_path / "out" / "faces.csv")["surface_id"].tolist()
    assert any(name.endswith("#2") for name in names)
    assert "ground" not in [
        node["name"] for node in Glb((tmp_path / "out" / "city.glb").read_bytes()).json["nodes"]
    ]


def test_a_new_export_is_one_line_and_one_file(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="exports: 'note' is not known; give some of transfer"):
        Output(exports="note")
    for table in (exports.EXPORTS, exports.MODELS):
        monkeypatch.setitem(table, "note", exports.Export("city.txt", "a note", "Note"))
    add_output(parser := argparse.ArgumentParser(), exports=True)
    asked = parser.parse_args(["--out", "x", "--note"]).exports
    writer = ModuleType("write_note")
    writer.write_note = lambda path, run, progress: path.write_text(run.scene)
    monkeypatch.setitem(sys.modules, "citypv.core.results.write_note", writer)
    run = exports.RunResults(None, "seen", None, None, None)
    exports.write_exports(tmp_path, run, Output(exports=asked).exports)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"city.txt": "seen"}


@pytest.mark.slow
def test_name_of_the_system():
    local = "+proj=tmerc +lon_0=11 +lat_0=48 +k=1 +ellps=GRS80 +units=m +type=crs"
    assert name_system(local) is None and name_system(None) is None
    for crs, number in (("EPSG:25833", 25833), ("EPSG:7415", 7415), ("EPSG:25832+7837", 25832)):
        assert name_system(crs) == f"https://www.opengis.net/def/crs/EPSG/0/{number}"
        assert pyproj.CRS.from_user_input(name_system(crs)).to_epsg() == number


def test_gltf_has_the_areas_and_colours_of_the_faces(small_results):
    city = Glb((small_results / "city.glb").read_bytes())
    names = ["a", "b", "c", "ground", "modules"]
    assert [node["name"] for node in city.json["nodes"]] == names
    table = pd.read_csv(small_results / "faces.csv")
    # Each building tells the sums of its modules, and all of these are a mesh of rectangles.
    buildings = pd.read_csv(small_results / "buildings.csv", index_col="building_id")
    for node in city.json["nodes"][:3]:
        for name in ("module_count", "kwp", "mwh_per_year"):
            told = buildings.loc[node["name"], name]
            assert node["extras"][name] == pytest.approx(told, rel=1e-4) and told > 0
    (modules,) = city.json["meshes"][4]["primitives"]
    corners = city.accessor(modules["attributes"]["POSITION"])[city.accessor(modules["indices"])]
    edges = np.diff(corners.reshape(-1, 3, 3), axis=1)
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    assert len(corners) == 6 * table["module_count"].sum()
    assert area.sum() == pytest.approx(table["module_area"].sum(), rel=1e-4)
    assert area == pytest.approx(np.full(len(area), area[0]), rel=1e-4)
    extras = city.json["asset"]["extras"]
    stops = decode(
        np.array([[*bytes.fromhex(stop)] for stop in MAPS[extras["colour_map"]].split()])
    )
    for mesh in city.json["meshes"][:3]:
        (primitive,) = mesh["primitives"]
        places = [primitive["attributes"][name] for name in ("POSITION", "NORMAL", "COLOR_0")]
        points, normal, colour = map(city.accessor, places)
        assert colour.dtype == np.uint16
        corners = points.reshape(-1, 3, 3)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = 0.5 * np.linalg.norm(cross, axis=1)
        rows = table[table["building_id"] == mesh["name"]]
        assert area.sum() == pytest.approx(rows["area"].sum(), rel=1e-4)
        assert normal[::3] == pytest.approx(cross / (2 * area[:, None]), abs=1e-5)
        # y is up: the faces that look down are the floor.
        floor = rows.loc[rows["kind"] == "downward", "area"].sum()
        assert area[normal[::3, 1] < -0.9].sum() == pytest.approx(floor, rel=1e-4)
        # Each surface has a colour of its own, whose place on the map is its full load hours.
        for _, row in rows[np.isfinite(rows["full_load_hours"])].iterrows():
            place = np.clip(
                (row["full_load_hours"] - extras["low"]) / (extras["high"] - extras["low"]), 0, 1
            )
            expected = [
                np.interp(place, np.linspace(0, 1, len(stops)), channel) for channel in stops.T
            ]
            same = np.abs(colour[::3, :3] / 65535 - expected).max(axis=1) < 2e-4
            assert area[same].sum() >= row["area"] * (1 - 1e-4)


def decode(colours):
    """sRGB bytes to linear light, IEC 61966-2-1."""
    value = colours / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


@pytest.mark.slow
def test_types_of_surfaces_without_a_class(tmp_path):
    """A house, and 3 m above its roof a face that looks down: none of the floor on the ground."""
    text = "\n".join(
        [f"v {x} {y} {z}" for z in (0, 5, 8) for x, y in ((0, 0), (9, 0), (9, 9), (0, 9))]
        + ["o house", "f 4 3 2 1", "f 5 6 7 8", "f 1 2 6 5", "f 2 3 7 6", "f 3 4 8 7", "f 4 1 5 8"]
        + ["v 1 1 11", "v 8 1 11", "v 8 8 11", "v 1 8 11", "f 16 15 14 13"]
    )
    (tmp_path / "city.obj").write_text(text, encoding="utf-8")
    options = ["--latitude", "50", "--longitude", "8", "--cityjson", "--out", str(tmp_path / "out")]
    assert main(["simulate", str(tmp_path / "city.obj"), *options, *FAST]) == 0
    document = json.loads((tmp_path / "out" / "city.city.json").read_text(encoding="utf-8"))
    types = [surface["type"] for surface, _ in surfaces_of(document)]
    assert types == ["GroundSurface", "RoofSurface", *["WallSurface"] * 4, "OuterCeilingSurface"]
    assert "referenceSystem" not in document["metadata"]


def read_layer(path, name):
    """Rows of a layer of a GeoPackage, with its geometries read by the standard (OGC 12-128r17,
    clause 2.1.3).
    """
    with closing(sqlite3.connect(path)) as file:
        table = pd.read_sql_query(f'SELECT * FROM "{name}"', file)
    shapes = []
    for blob in table.pop("geom"):
        magic, version, flags, number = struct.unpack("<2sBBi", blob[:8])
        assert (magic, version, flags & 1, number) == (b"GP", 0, 1, 25833)
        assert flags >> 1 & 7 == 0  # without an envelope
        shape = shapely.from_wkb(blob[8:])
        assert shape.is_empty == bool(flags >> 4 & 1)
        shapes.append(shape)
    return table, shapes


def test_a_geopackage_has_the_tables_that_the_standard_requires(small_results):
    with closing(sqlite3.connect(small_results / "city.gpkg")) as file:
        assert file.execute("PRAGMA application_id").fetchone()[0] == int.from_bytes(b"GPKG", "big")
        assert file.execute("PRAGMA user_version").fetchone()[0] >= 10200
        assert file.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
        assert not file.execute("PRAGMA foreign_key_check").fetchall()
        systems = dict(file.execute("SELECT srs_id, definition FROM gpkg_spatial_ref_sys"))
        assert {-1, 0, 4326, 25833} == set(systems)
        assert pyproj.CRS.from_wkt(systems[25833]).equals(pyproj.CRS(25833), ignore_axis_order=True)
        layers = file.execute(
            "SELECT table_name, geometry_type_name, srs_id, z FROM gpkg_geometry_columns"
        ).fetchall()
        assert layers == [
            ("surfaces", "POLYGON", 25833, 1),
            ("buildings", "MULTIPOLYGON", 25833, 0),
        ]
        boxes = file.execute("SELECT min_x, min_y, max_x, max_y FROM gpkg_contents").fetchall()
    points = read_city(small_results.parent / "city.gml").points
    expected = [*points[:, :2].min(axis=0), *points[:, :2].max(axis=0)]
    for box in boxes:
        np.testing.assert_allclose(box, expected, atol=1e-6)


def test_a_geopackage_has_the_rows_of_the_tables_and_the_shapes_of_the_input(small_results):
    city = read_city(small_results.parent / "city.gml")
    for layer, name, key in (
        ("surfaces", "faces.csv", "surface_id"),
        ("buildings", "buildings.csv", "building_id"),
    ):
        table, shapes = read_layer(small_results / "city.gpkg", layer)
        texts = {"reason": str, "reason_note": str}
        expected = pd.read_csv(small_results / name, dtype=texts)
        for column in (key, *(texts if layer == "surfaces" else ())):
            assert list(table[column]) == list(expected[column].fillna(""))
        for column in expected.select_dtypes("number"):
            np.testing.assert_allclose(
                table[column].astype(float), expected[column].astype(float), rtol=1e-5
            )
        if layer == "surfaces":
            for polygon, shape in enumerate(shapes):
                rings = [shape.exterior, *shape.interiors]
                for ring, points in zip(rings, city.rings(polygon), strict=True):
                    np.testing.assert_allclose(np.array(ring.coords)[:-1], points)
        else:
            ground = read_layer(small_results / "city.gpkg", "surfaces")
            level = [
                shape.area
                for shape, kind in zip(ground[1], ground[0]["kind"], strict=True)
                if kind == "downward"
            ]
            assert sum(shape.area for shape in shapes) >= sum(level) - 1e-6 > 0


def test_a_geopackage_without_a_reference_system_is_cartesian(tmp_path):
    for number, crs in ((-1, None), (25833, "EPSG:25833+7837")):
        with closing(sqlite3.connect(tmp_path / f"{number}.gpkg")) as file:
            file.executescript(TABLES)
            assert write_system(file, crs) == number
