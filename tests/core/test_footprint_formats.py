"""Formats of outlines with heights: one small town in each, read alike."""

import gzip
import json
import shutil
import sqlite3
import struct

import numpy as np
import pytest
import shapely
from footprint_text import EAST, NORTH, collection, feature, in_degrees, square, write_map
from test_footprints import assert_closed, read, tops, volume

from citypv.core.results.write_geopackage import TABLES, write_system
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

COURT = [square(40, 0, 20, 8), square(45, 2, 4)]
TOWN = (
    feature(square(0, 0), "way/1", height=6.0, building="yes"),
    feature(COURT, "way/2", height=12.0, building="yes"),
    feature(square(80, 0), "way/3", height=None, building="yes", **{"building:levels": 2}),
)
VOLUME = 100 * 6 + (160 - 16) * 12 + 100 * 6  # [m³]


def columns_of(town):
    """Ids, heights and floors of a town, and its shapes."""
    rows = [one["properties"] for one in town]
    shapes = [shapely.from_geojson(json.dumps(one["geometry"])) for one in town]
    return {
        "osm_id": [one["id"] for one in town],
        "height": [row["height"] for row in rows],
        "num_floors": [row.get("building:levels") for row in rows],
    }, shapes


def write_geopackage(path, town, crs="EPSG:4326", *, layers=("buildings",)):
    """A GeoPackage by Python's own SQLite."""
    columns, shapes = columns_of(town)
    with sqlite3.connect(path) as file:
        file.executescript(TABLES)
        number = write_system(file, crs)
        for layer in layers:
            file.execute(
                f'CREATE TABLE "{layer}" (fid INTEGER PRIMARY KEY, geom, osm_id, height, num_floors)'
            )
            file.execute(
                "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', 'POLYGON', ?, 0, 0)",
                (layer, number),
            )
            for row, shape in enumerate(shapes):
                # The first has an envelope in its header.
                box = struct.pack("<4d", *np.array(shape.bounds)[[0, 2, 1, 3]]) if row == 0 else b""
                head = struct.pack("<2sBBi", b"GP", 0, 0b11 if box else 0b1, number) + box
                values = [columns[name][row] for name in columns]
                file.execute(
                    f'INSERT INTO "{layer}" VALUES (?, ?, ?, ?, ?)',
                    (row + 1, head + shape.wkb, *values),
                )
    file.close()
    return path


OSM = """<?xml version='1.0' encoding='UTF-8'?>
<osm version="0.6" generator="hand" attribution="http://www.openstreetmap.org/copyright">
{nodes}
<way id="1">{way1}<tag k="building" v="yes"/><tag k="height" v="6 m"/></way>
<way id="21">{way21}</way>
<way id="22">{way22}</way>
<way id="23">{way23}</way>
<way id="3">{way3}<tag k="building" v="house"/><tag k="building:levels" v="2"/></way>
<way id="4">{way1}<tag k="highway" v="footway"/></way>
<way id="5"><nd ref="1"/><nd ref="2"/><tag k="building" v="yes"/></way>
<relation id="2"><member type="way" ref="21" role="outer"/><member type="way" ref="22" role="outer"/>
<member type="way" ref="23" role="inner"/>
<tag k="type" v="multipolygon"/><tag k="building" v="yes"/><tag k="height" v="12"/></relation>
</osm>
"""


def osm_nodes():
    """Rings of the town as numbers of nodes, and the place of each."""
    rings = [square(0, 0), *COURT, square(80, 0)]
    places, numbers = [], []
    for ring in rings:
        first = len(places) + 1
        places += in_degrees(ring[:-1])
        numbers.append([first, first + 1, first + 2, first + 3, first])
    return places, numbers


def osm_text():
    places, (one, outer, inner, three) = osm_nodes()
    nodes = "\n".join(
        f'<node id="{number}" lat="{lat!r}" lon="{lon!r}"/>'
        for number, (lon, lat) in enumerate(places, start=1)
    )
    ways = {"way1": one, "way21": outer[:3], "way22": outer[2:], "way23": inner, "way3": three}
    return OSM.format(
        nodes=nodes,
        **{
            name: "".join(f'<nd ref="{number}"/>' for number in ring) for name, ring in ways.items()
        },
    )


def overpass(*, inline):
    """The same as the Overpass API writes it: nodes last, or places in the ways."""
    places, (one, outer, inner, three) = osm_nodes()

    def way(number, ring, **tags):
        shape = [{"lon": places[k - 1][0], "lat": places[k - 1][1]} for k in ring]
        own = {"geometry": shape} if inline else {"nodes": ring}
        return {"type": "way", "id": number, "tags": tags} | own

    members = [(21, outer[:3], "outer"), (22, outer[2:], "outer"), (23, inner, "inner")]
    relation = {
        "type": "relation",
        "id": 2,
        "tags": {"type": "multipolygon", "building": "yes", "height": "12"},
        "members": [
            {"type": "way", "ref": number, "role": role}
            | ({"geometry": way(number, ring)["geometry"]} if inline else {})
            for number, ring, role in members
        ],
    }
    elements = [
        way(1, one, building="yes", height="6"),
        way(3, three, building="yes", **{"building:levels": "2"}),
        relation,
    ]
    if not inline:
        elements += [way(number, ring) for number, ring, _ in members]
        elements += [
            {"type": "node", "id": k, "lon": x, "lat": y}
            for k, (x, y) in enumerate(places, start=1)
        ]
    return json.dumps({"version": 0.6, "generator": "Overpass API", "elements": elements})


def assert_town(city, names=("way/1", "way/2", "way/3"), *, accuracy=1e-5):
    assert volume(city) == pytest.approx(VOLUME, rel=accuracy)
    assert_closed(city)
    heights = tops(city)
    assert [heights[name] for name in names] == pytest.approx([6, 12, 6])
    source = dict(zip(city.building_id, city.height_source, strict=True))
    assert source[names[0]] == "height" and source[names[2]] == "floors"


def test_geojson(tmp_path):
    assert_town(read(write_map(tmp_path / "town.geojson", *TOWN)))
    # GeoJSON by any other name.
    shutil.copy(tmp_path / "town.geojson", tmp_path / "town.json")
    assert_town(read(tmp_path / "town.json"))
    (tmp_path / "town.json").unlink()
    assert_town(read(tmp_path))


def test_geopackage(tmp_path):
    path = write_geopackage(tmp_path / "town.gpkg", TOWN)
    assert_town(read(path))
    (tmp_path / "town.gpkg.gz").write_bytes(gzip.compress(path.read_bytes()))
    assert_town(read(tmp_path / "town.gpkg.gz"))
    several = write_geopackage(tmp_path / "more.gpkg", TOWN, layers=("roads", "gebaeude"))
    city = read(several)
    assert_town(city)
    assert any("layer gebaeude was read, not roads" in note for note in city.report.notes)
    with pytest.raises(InputError, match="several layers that may be buildings"):
        read(write_geopackage(tmp_path / "two.gpkg", TOWN, layers=("a", "b")))
    (tmp_path / "cut.gpkg").write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError, match=r"cut\.gpkg"):
        read(tmp_path / "cut.gpkg")


def test_openstreetmap(tmp_path):
    """A way, a multipolygon of two pieces with a hole, a way with floors; one way is not closed."""
    (tmp_path / "town.osm").write_text(osm_text())
    (tmp_path / "town.json").write_text(overpass(inline=False))
    (tmp_path / "inline.json").write_text(overpass(inline=True))
    (tmp_path / "town.osm.gz").write_bytes(gzip.compress(osm_text().encode()))
    for name in ("town.osm", "town.json", "inline.json", "town.osm.gz"):
        city = read(tmp_path / name)
        assert_town(city, ("way/1", "relation/2", "way/3"))
        assert city.report.attributions == [
            "© OpenStreetMap contributors, Open Database License (ODbL)"
        ]
        skipped = [name for names in city.report.skipped.values() for name in names]
        assert skipped == ([] if name.endswith("json") else ["way/5"])


def test_an_island_in_a_court_of_openstreetmap_stays(tmp_path):
    rings = [square(0, 0, 30), square(5, 5, 20), square(10, 10, 10)]
    shape = [[{"lon": x, "lat": y} for x, y in in_degrees(ring)] for ring in rings]
    roles = ("outer", "inner", "outer")
    members = [
        {"type": "way", "ref": k, "role": role, "geometry": places}
        for k, (role, places) in enumerate(zip(roles, shape, strict=True))
    ]
    tags = {"type": "multipolygon", "building": "yes", "height": "10"}
    relation = {"type": "relation", "id": 7, "tags": tags, "members": members}
    (tmp_path / "yard.json").write_text(json.dumps({"elements": [relation]}))
    assert volume(read(tmp_path / "yard.json")) == pytest.approx(10 * (900 - 400 + 100), rel=1e-5)


def test_parts_that_a_relation_of_openstreetmap_names(tmp_path):
    """A part lies beside the outline of its building; the relation tells that they belong
    together.
    """
    rings = {1: square(0, 0, 20, 10), 2: square(0, 0), 3: square(20, 0)}
    tags = {1: {"building": "yes", "height": "9"}}
    tags |= {2: {"building:part": "yes", "height": "9"}, 3: {"building:part": "yes", "height": "3"}}
    elements = [
        {
            "type": "way",
            "id": k,
            "tags": tags[k],
            "geometry": [{"lon": x, "lat": y} for x, y in in_degrees(ring)],
        }
        for k, ring in rings.items()
    ]
    roles = {1: "outline", 2: "part", 3: "part"}
    members = [{"type": "way", "ref": k, "role": role} for k, role in roles.items()]
    elements.append({"type": "relation", "id": 9, "tags": {"type": "building"}, "members": members})
    # A part may be a multipolygon, which stands before the relation of its building.
    elements[2] = {
        "type": "relation",
        "id": 3,
        "tags": tags[3] | {"type": "multipolygon"},
        "members": [elements[2] | {"ref": 5, "role": "outer"}],
    }
    members[2] = {"type": "relation", "ref": 3, "role": "part"}
    (tmp_path / "house.json").write_text(json.dumps({"elements": elements}))
    city = read(tmp_path / "house.json")
    assert set(city.building_id) == {"way/1"} and set(city.part) == {"way/2", "relation/3"}
    assert volume(city) == pytest.approx(100 * (9 + 3), rel=1e-5)


@pytest.mark.parametrize("suffix", [".shp", ".fgb"])
def test_formats_of_gdal(tmp_path, suffix):
    pyogrio = pytest.importorskip("pyogrio")
    columns, shapes = columns_of(TOWN)
    # A shapefile keeps ten letters of a name.
    height = "building_height"[: 10 if suffix == ".shp" else None]
    driver = {".shp": "ESRI Shapefile", ".fgb": "FlatGeobuf"}[suffix]
    fields = [
        np.array(columns["osm_id"], object),
        np.array(columns["height"], float),
        np.array([0, 0, 2], np.int32),
    ]
    pyogrio.raw.write(
        tmp_path / f"town{suffix}",
        shapely.to_wkb(shapes),
        fields,
        ["osm_id", height, "num_floors"],
        driver=driver,
        geometry_type="Polygon",
        crs="EPSG:4326",
    )
    city = read(tmp_path / f"town{suffix}")
    assert volume(city) == pytest.approx(VOLUME, rel=1e-5)
    assert tops(city) == pytest.approx({"way/1": 6, "way/2": 12, "way/3": 6})
    assert set(city.height_source) == {height, "floors"}


def test_geoparquet(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    columns, shapes = columns_of(TOWN)
    columns["geometry"] = [shape.wkb for shape in shapes]
    columns["id"] = columns.pop("osm_id")
    about = {
        "version": "1.1.0",
        "primary_column": "geometry",
        "columns": {"geometry": {"encoding": "WKB"}},
    }
    table = arrow.table(columns).replace_schema_metadata({"geo": json.dumps(about)})
    parquet.write_table(table, tmp_path / "town.parquet")
    assert_town(read(tmp_path / "town.parquet"))


def test_openstreetmap_pbf(tmp_path):
    osmium = pytest.importorskip("osmium")
    (tmp_path / "town.osm").write_text(osm_text())
    with osmium.SimpleWriter(str(tmp_path / "town.osm.pbf")) as writer:
        for one in osmium.FileProcessor(str(tmp_path / "town.osm")):
            writer.add(one)
    # PBF rounds to 1e-7°, 1.1 cm.
    city = read(tmp_path / "town.osm.pbf")
    assert_town(city, ("way/1", "relation/2", "way/3"), accuracy=5e-3)


@pytest.mark.parametrize("name", ["a.shp", "a.parquet", "a.pbf"])
def test_what_is_not_installed_is_named(tmp_path, name, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    (tmp_path / name).write_bytes(b"PAR1 and more")
    with pytest.raises(InputError, match="reader is not installed; type: pip install"):
        read(tmp_path / name)


def test_a_town_of_two_formats_stands_in_one_system(tmp_path):
    """Degrees join a map in metres, whose system counts."""
    metres = feature(square(0, 0), "m", height=6)
    metres["geometry"]["coordinates"] = [[[534_858 + x, 5_683_306 + y] for x, y in square(0, 0)]]
    crs = {"type": "name", "properties": {"name": "EPSG:25832"}}
    first = write_map(tmp_path / "a.geojson", metres, crs=crs)
    # of pyproj: 51.3° N, 9.5° E is 534,857.97 m east and 5,683,305.58 m north there
    degrees = feature([[x + 9.5 / EAST, y + 51.3 / NORTH] for x, y in square(0, 0)], "d", height=6)
    second = write_map(tmp_path / "b.geojson", degrees)
    from citypv.core.run.study import read_buildings
    from citypv.core.settings.request import Request

    city = read_buildings([first, second], Request())
    assert city.crs == "EPSG:25832"
    names = np.repeat(city.building_id, np.diff(city.ring_start[city.polygon_start]))
    lows = [city.points[names == name, :2].min(axis=0) for name in ("m", "d")]
    assert lows[0] == pytest.approx(lows[1], abs=0.5)


def test_collections_say_whom_to_name(tmp_path):
    text = collection(*TOWN, attribution="City of Elsewhere, CC BY 4.0")
    (tmp_path / "town.geojson").write_text(json.dumps(text))
    assert read(tmp_path / "town.geojson").report.attributions[0] == "City of Elsewhere, CC BY 4.0"
