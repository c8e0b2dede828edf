"""Outlines with heights: what is read, which heights count, and the solids that they become."""

import gzip
import json
import re

import numpy as np
import pytest
from footprint_text import EAST, NORTH, feature, square, write_map

from citypv.core.city.check_geometry import check_city
from citypv.core.city.orient_shells import orient_shells
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.footprint_heights import parse_length
from citypv.core.run.study import make_scene, read_buildings
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python


def read(path, **settings):
    return read_buildings([path], Request(**settings))


def areas(city):
    """Area [m²] by class."""
    area, _ = measure_polygons(*city.shape)
    return {
        str(name): float(area[np.array(city.thematic) == name].sum())
        for name in np.unique(city.thematic)
    }


def tops(city):
    """Height of the top of each building [m]."""
    polygon = np.repeat(np.arange(len(city)), np.diff(city.ring_start[city.polygon_start]))
    names, own = np.array(city.building_id)[polygon], {}
    for name in dict.fromkeys(city.building_id):
        own[name] = float(city.points[names == name, 2].max())
    return own


def volume(city):
    """Volume [m³] of closed shells, by the divergence theorem."""
    area, normal = measure_polygons(*city.shape)
    first = city.points[city.ring_start[city.polygon_start[:-1]]] - city.points.min(axis=0)
    return float((area * (normal * first).sum(axis=1)).sum() / 3)


def assert_closed(city):
    """All buildings are closed shells that face outwards."""
    check_city(city)
    building = np.unique(city.building_id, return_inverse=True)[1]
    found = orient_shells(*city.shape, building)
    assert found.watertight.all() and not found.flip.any()


def test_a_block_has_the_areas_of_its_sides(tmp_path):
    """10 m × 10 m × 6 m, and 20 m × 8 m × 12 m with a court of 4 m × 4 m."""
    court = [square(40, 0, 20, 8), square(45, 2, 4)]
    path = write_map(
        tmp_path / "map.geojson",
        feature(square(0, 0), "a", height=6),
        feature(court, "b", height="12"),
    )
    city = read(path)
    roofs = 100 + 160 - 16
    walls = 40 * 6 + (56 + 16) * 12
    assert areas(city) == pytest.approx(
        {"GroundSurface": roofs, "RoofSurface": roofs, "WallSurface": walls}, rel=1e-5
    )
    assert volume(city) == pytest.approx(600 + 144 * 12, rel=1e-5)
    assert_closed(city)
    assert tops(city) == pytest.approx({"a": 6.0, "b": 12.0})
    assert set(city.lod) == {"1"} and set(city.height_source) == {"height"}
    assert city.surface_id[:2] == ["a_1", "a_2"] and city.report.building_count == 2


def test_rings_may_run_either_way_and_stay_open(tmp_path):
    ring = square(0, 0)
    for number, one in enumerate((ring, ring[::-1], ring[:-1], [[*place, 5.0] for place in ring])):
        path = write_map(
            tmp_path / f"map{number}.geojson", feature([place[:2] for place in one], height=3)
        )
        if number == 3:
            text = json.loads(path.read_text())
            places = text["features"][0]["geometry"]["coordinates"][0]
            text["features"][0]["geometry"]["coordinates"] = [[[*place, 7.0] for place in places]]
            path.write_text(json.dumps(text))
        city = read(path)
        assert volume(city) == pytest.approx(300, rel=1e-5), number
        assert_closed(city)


@pytest.mark.parametrize(
    ("attributes", "top"),
    [
        ({"height": 7.5}, 7.5),
        ({"HEIGHT": "7,5"}, 7.5),
        ({"building:height": "7.5 m"}, 7.5),
        ({"height": "30'"}, 30 * 0.3048),
        ({"height": "7'6\""}, 7.5 * 0.3048),
        ({"height": "24.6 ft"}, 24.6 * 0.3048),
        ({"Height_ft": 30}, 30 * 0.3048),
        ({"HEIGHTROOF": 30, "BIN": 1000001, "GROUNDELEV": 20}, 30 * 0.3048),
        ({"HEIGHT_ROO": 30, "DOITT_ID": 1}, 30 * 0.3048),
        ({"HEIGHT_ROOF": 9.0, "HEIGHT_WALL": 6.0}, 9.0),
        ({"HAUTEUR": 8.2, "NB_ETAGES": 4}, 8.2),
        ({"HAUTEUR": 0.0, "NB_ETAGES": 4}, 12.0),
        ({"height": -1, "num_floors": 2}, 6.0),
        ({"height": "*******", "num_floors": 2}, 6.0),
        ({"height": None, "building:levels": "3", "roof:levels": "1"}, 12.0),
        ({"b3_h_dak_50p": 14.5, "b3_h_maaiveld": 2.5}, 12.0),
        ({"Z_MIN_SOL": 510.0, "Z_MIN_TOIT": 518.5, "HAUTEUR": None}, 8.5),
        ({"objekthoehe": None, "traufhoehe": 5.0}, 5.0),
        ({"bu-base:heightAboveGround/value": 5.0}, 5.0),
        ({"measuredHei": 1, "measuredHe": 8.0}, 8.0),
        ({"mittlere_Gebäudehöhe": 8.0, "Höhe_Keller": 3.0}, 8.0),
        ({"altura_edificio": 11.0}, 11.0),
        ({"num_pisos": 5}, 15.0),
    ],
)
def test_heights_by_producer(tmp_path, attributes, top):
    city = read(write_map(tmp_path / "map.geojson", feature(square(0, 0), **attributes)))
    low, high = city.points[:, 2].min(), city.points[:, 2].max()
    assert high - low == pytest.approx(top, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("12", 12),
        (" 12.5 m ", 12.5),
        ("12,5", 12.5),
        ("40'", 12.192),
        ("1200 cm", 12),
        ("10-12", None),
        ("two", None),
        ("", None),
    ],
)
def test_lengths_in_words(text, metres):
    number, unit = parse_length(text)
    found = number * (1.0 if np.isnan(unit) else unit)
    assert np.isnan(found) if metres is None else found == pytest.approx(metres)


def test_heights_that_the_user_names(tmp_path):
    attributes = {"height": 99, "eaves": 20, "top": 120.0, "terrain_height": 100.0}
    path = write_map(tmp_path / "map.geojson", feature(square(0, 0), "a", **attributes))
    for name, top in (
        ("eaves", 20),
        ("eaves:ft", 20 * 0.3048),
        ("EAVES:cm", 0.2),
        ("top:absolute", 20),
    ):
        city = read(path, height=name)
        assert np.ptp(city.points[:, 2]) == pytest.approx(top), name
    assert np.ptp(read(path, unit="ft").points[:, 2]) == pytest.approx(99 * 0.3048)
    with pytest.raises(
        InputError, match=r"--height: .* has no attribute 'ridge'; .*height, eaves, top"
    ):
        read(path, height="ridge")


def test_feet_are_told_by_floors(tmp_path):
    """Twelve buildings of 11 units a floor: no floor has 11 m."""
    houses = [feature(square(20 * k, 0), height=11 * (k + 1) + 2, stories=k + 1) for k in range(12)]
    city = read(write_map(tmp_path / "map.geojson", *houses))
    assert max(tops(city).values()) == pytest.approx((11 * 12 + 2) * 0.3048)
    assert any("--height height:m" in note for note in city.report.notes)


def test_heights_above_the_sea_are_told_by_the_ground(tmp_path):
    houses = [
        feature(square(20 * k, 0), f"h{k}", max_height=520 + 2 * k, ground_height=510 + k)
        for k in range(9)
    ]
    city = read(write_map(tmp_path / "map.geojson", *houses))
    # Each stands on its own ground, and ends where it says.
    assert tops(city) == pytest.approx({f"h{k}": 520 + 2 * k for k in range(9)})
    assert city.points[:, 2].min() == pytest.approx(510)


def test_too_many_without_a_height_are_refused(tmp_path):
    houses = [feature(square(20 * k, 0), f"h{k}", height=5 if k else None) for k in range(9)]
    path = write_map(tmp_path / "map.geojson", *houses)
    with pytest.raises(InputError, match=re.escape("1 of 9 outlines (11 %) have neither a height")):
        read(path)
    city = read(path, default_height=4)
    assert tops(city)["h0"] == pytest.approx(4)
    sources = dict(zip(city.building_id, city.height_source, strict=True))
    assert sources["h0"] == "default" and sources["h1"] == "height"
    # One of ten is left out, and told.
    few = write_map(tmp_path / "few.geojson", *houses, feature(square(400, 0), "h9", height=5))
    assert read(few).report.skipped == {"outline without a height or floors": ["h0"]}


def test_heights_that_are_floors_in_disguise_are_marked(tmp_path):
    houses = [
        feature(square(20 * k, 0), height=3 * (k % 4 + 1), floors=k % 4 + 1) for k in range(20)
    ]
    city = read(write_map(tmp_path / "map.geojson", *houses))
    assert set(city.height_source) == {"floors"} and city.report.height_sources == {"floors": 20}


def test_parts_take_the_place_of_their_outline(tmp_path):
    """An outline of 20 m × 10 m with two parts, one above the other, and one without a height."""
    path = write_map(
        tmp_path / "map.geojson",
        feature(square(0, 0, 20, 10), "b", height=30, type="building", has_parts=True),
        feature(square(0, 0), "p1", height=30, type="building_part", building_id="b"),
        feature(square(10, 0), "p2", num_floors=2, type="building_part", building_id="b"),
        feature(square(10, 0), "p3", height=9, min_height=6, type="building_part", building_id="b"),
        feature(square(50, 0), "c", height=5, type="building"),
    )
    city = read(path)
    assert city.report.building_count == 2 and city.report.part_count == 3
    assert set(city.building_id) == {"b", "c"} and set(city.part) == {"", "p1", "p2", "p3"}
    assert volume(city) == pytest.approx(3000 + 600 + 300 + 500, rel=1e-5)
    assert "OuterCeilingSurface" in city.thematic


def test_parts_of_openstreetmap_lie_in_their_outline(tmp_path):
    path = write_map(
        tmp_path / "map.geojson",
        feature(square(0, 0, 20, 10), "way/1", building="yes", height="20"),
        feature(square(0, 0), "way/2", **{"building:part": "yes", "height": "20 m"}),
        feature(square(10, 0), "way/3", **{"building:part": "yes", "building:levels": "2"}),
        feature(
            square(50, 0), "way/4", **{"building": "house", "building:part": "yes", "height": 5}
        ),
        feature(square(80, 0), "way/5", leisure="park"),
        feature(square(90, 0), "way/6", building="no", height=3),
        feature(square(110, 0), "way/7", building="yes", height=3, layer="-1"),
        feature(square(130, 0), "way/8", building="yes", height=3, location="underground"),
    )
    city = read(path)
    assert set(city.building_id) == {"way/1", "way/4"}
    assert volume(city) == pytest.approx(2000 + 600 + 500, rel=1e-5)
    assert city.report.skipped == {"underground": ["way/7", "way/8"]}
    assert any("2 outlines" in note and "no building" in note for note in city.report.notes)


@pytest.mark.parametrize(
    ("roof", "expected"),
    [
        # Blocks of 20 m × 10 m, 9 m high with the roof's 3 m: volumes of prisms and pyramids.
        ({"roof:shape": "gabled", "roof:orientation": "along"}, 200 * 6 + 300),
        ({"roof:shape": "gabled", "roof:orientation": "across"}, 200 * 6 + 300),
        ({"roof:shape": "gabled", "roof:direction": "N"}, 200 * 6 + 300),
        ({"roof:shape": "skillion", "roof:direction": "90"}, 200 * 6 + 300),
        # A ridge of 10 m, and the two ends of a pyramid over 10 m × 10 m.
        ({"roof:shape": "hipped", "roof:orientation": "along"}, 200 * 6 + 150 + 100),
        ({"roof:shape": "pyramidal"}, 200 * 6 + 200),
        ({"roof:shape": "gabled"}, 200 * 9),
        ({"roof:shape": "skillion"}, 200 * 9),
        ({"roof:shape": "onion", "roof:direction": "N"}, 200 * 9),
    ],
)
def test_roofs_of_openstreetmap(tmp_path, roof, expected):
    house = feature(
        square(0, 0, 20, 10), "way/1", building="yes", height=9, **{"roof:height": 3}, **roof
    )
    city = read(write_map(tmp_path / "map.geojson", house))
    assert volume(city) == pytest.approx(expected, rel=1e-5)
    assert_closed(city)
    assert set(city.lod) == {"2" if expected < 1800 else "1"}
    assert np.ptp(city.points[:, 2]) == pytest.approx(9)


def test_a_skillion_roof_slopes_down_to_its_direction(tmp_path):
    house = feature(
        square(0, 0, 20, 10),
        building="yes",
        height=9,
        **{"roof:shape": "skillion", "roof:height": "10'", "roof:direction": "SE"},
    )
    city = read(write_map(tmp_path / "map.geojson", house))
    _, normal = measure_polygons(*city.shape)
    roof = np.flatnonzero(np.array(city.thematic) == "RoofSurface")
    assert len(roof) == 1
    assert normal[roof[0], 0] == pytest.approx(-normal[roof[0], 1]) and normal[roof[0], 0] > 0


def test_outlines_that_cross_themselves_or_are_drawn_twice_are_told(tmp_path):
    bow = [[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]
    path = write_map(
        tmp_path / "map.geojson",
        feature(bow, "bow", height=4),
        feature(square(20, 0), "once", height=4),
        feature(square(20, 0)[2:] + square(20, 0)[1:3], "again", height=4),
        feature(square(25, 0), "over", height=4),
        feature([[50, 0], [60, 0], [50, 0]], "line", height=4),
        feature(square(70, 0, 10, 0.05), "strip", height=4),
    )
    city = read(path)
    assert volume(city) == pytest.approx(4 * (50 + 100 + 100 + 0.5), rel=1e-4)
    assert city.report.skipped["outline already read"] == ["again"]
    assert any("line" in names for names in city.report.skipped.values())
    assert city.report.repaired["outline crosses or touches itself: mended"] == ["bow"]
    for name, words in (("over", "lie partly on others"), ("strip", "thinner than 10 cm")):
        assert any(words in note and name in note for note in city.report.notes)


def test_a_map_stands_where_its_system_says(tmp_path):
    """Degrees have longitude first, also where the registry has latitude first; metres stay."""
    degrees = feature([[x + 9.5 / EAST, y + 51.3 / NORTH] for x, y in square(0, 0)], "a", height=5)
    scene = make_scene(read(write_map(tmp_path / "degrees.geojson", degrees)), Request())
    assert (scene.site.latitude, scene.site.longitude) == pytest.approx((51.3, 9.5), abs=1e-3)
    for name in ("EPSG:25832", "urn:ogc:def:crs:EPSG::25832", "EPSG:31467"):
        # of pyproj: 51.3° N, 9.5° E in both grids
        east, north = (3_534_945, 5_685_140) if "31467" in name else (534_858, 5_683_306)
        ring = [[east + x, north + y] for x, y in square(0, 0)]
        own = feature(square(0, 0), "a", height=5)
        own["geometry"]["coordinates"] = [ring]
        crs = {"type": "name", "properties": {"name": name}}
        scene = make_scene(read(write_map(tmp_path / "metres.geojson", own, crs=crs)), Request())
        assert (scene.site.latitude, scene.site.longitude) == pytest.approx((51.3, 9.5), abs=2e-3)


def test_lines_of_features_are_read_like_a_collection(tmp_path):
    houses = [feature(square(20 * k, 0), f"h{k}", height=5) for k in range(4)]
    whole = read(write_map(tmp_path / "map.geojson", *houses))
    for name, sign in (("map.geojsonl", ""), ("map.geojsons", "\x1e"), ("map.csv.gz", "")):
        lines = "".join(f"{sign}{json.dumps(house)}\n" for house in houses).encode()
        (tmp_path / name).write_bytes(gzip.compress(lines) if name.endswith("gz") else lines)
        city = read(tmp_path / name)
        assert city.surface_id == whole.surface_id and np.array_equal(city.points, whole.points)


def test_outlines_stand_on_terrain(tmp_path):
    """Terrain that rises by 1 m in 10 m to the east; a house stands on its lowest corner."""
    rows = "\n".join(" ".join(f"{100 + 0.5 * column:g}" for column in range(40)) for _ in range(40))
    head = "ncols 40\nnrows 40\nxllcorner 534800\nyllcorner 5683200\ncellsize 5\n"
    (tmp_path / "ground.asc").write_text(head + rows + "\n")
    own = feature(square(0, 0), "a", height=6)
    own["geometry"]["coordinates"] = [[[534_870 + x, 5_683_240 + y] for x, y in square(0, 0)]]
    crs = {"type": "name", "properties": {"name": "EPSG:25832"}}
    path = write_map(tmp_path / "map.geojson", own, crs=crs)
    city = read(path, terrain=str(tmp_path / "ground.asc"))
    # The middle of the first cell lies at 534,802.5 m east, at 100 m.
    low = 100 + 0.1 * (534_870 - 534_802.5)
    assert city.points[:, 2].min() == pytest.approx(low, abs=1e-6)
    assert tops(city)["a"] == pytest.approx(low + 6, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '{"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": null}]}',
            "no outlines",
        ),
        (
            '{"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [0, 0]}}',
            r"no outlines \(but 1 Point\)",
        ),
        (
            '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], ["x", 1], [0, 0]]]}',
            "no outlines",
        ),
        (
            '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [NaN, 1], [0, 0]]]}',
            "outline 1: a coordinate",
        ),
        (
            '{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}',
            "neither a height nor",
        ),
        ('{"type": "Topology", "features": []}', "not GeoJSON"),
    ],
)
def test_maps_that_cannot_be_used_say_why(tmp_path, text, words):
    (tmp_path / "map.geojson").write_text(text)
    with pytest.raises(InputError, match=words):
        read(tmp_path / "map.geojson")


def test_heights_above_the_sea_end_where_they_say_on_terrain(tmp_path):
    rows = "\n".join(" ".join(["250"] * 20) for _ in range(20))
    head = "ncols 20\nnrows 20\nxllcorner 534800\nyllcorner 5683280\ncellsize 10\n"
    (tmp_path / "ground.asc").write_text(head + rows + "\n")
    own = feature(square(0, 0), "a", roof_top=262.5)
    own["geometry"]["coordinates"] = [[[534_858 + x, 5_683_306 + y] for x, y in square(0, 0)]]
    crs = {"type": "name", "properties": {"name": "EPSG:25832"}}
    path = write_map(tmp_path / "map.geojson", own, crs=crs)
    city = read(path, terrain=str(tmp_path / "ground.asc"), height="roof_top:absolute")
    assert (city.points[:, 2].min(), city.points[:, 2].max()) == pytest.approx((250, 262.5))
    with pytest.raises(InputError, match="no attribute tells that of the ground; give --terrain"):
        read(path, height="roof_top:absolute")


def test_heights_that_no_town_has_are_refused(tmp_path):
    """Heights above the sea, of a town without heights of the ground."""
    houses = [feature(square(20 * k, 0), height=520 + k) for k in range(12)]
    path = write_map(tmp_path / "map.geojson", *houses)
    with pytest.raises(InputError, match="nine of ten outlines: heights above the sea"):
        read(path)
    assert max(tops(read(path, height="height:cm")).values()) == pytest.approx(5.31)


def test_centimetres_are_told_by_floors(tmp_path):
    houses = [feature(square(20 * k, 0), height=310 * (k + 1), floors=k + 1) for k in range(12)]
    city = read(write_map(tmp_path / "map.geojson", *houses))
    assert max(tops(city).values()) == pytest.approx(3.1 * 12)


@pytest.mark.parametrize(
    "tags",
    [
        {"other_tags": '"height"=>"7.5","addr:street"=>"A \\"B\\" road"'},
        {"tags": {"height": "7.5 m", "name": "x"}},
    ],
)
def test_tags_in_one_column(tmp_path, tags):
    own = feature(square(0, 0), None, osm_way_id="12", osm_id=None, building="yes", **tags)
    other = feature(square(30, 0), None, osm_way_id=None, osm_id="7", building="yes", **tags)
    city = read(write_map(tmp_path / "map.geojson", own, other))
    assert tops(city) == pytest.approx({"way/12": 7.5, "relation/7": 7.5})


def test_attributes_of_other_producers_mean_nothing_here(tmp_path):
    """A theme of its own, and a building_id beside a feature's id, leave all as it is."""
    houses = [
        feature(square(20 * k, 0), f"f{k}", theme="Gebäude", building_id=f"b{k}", height=5)
        for k in range(3)
    ]
    city = read(write_map(tmp_path / "map.geojson", *houses))
    assert city.report.building_count == 3 and city.report.part_count == 0
    assert set(city.building_id) == {"b0", "b1", "b2"}
