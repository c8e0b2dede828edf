"""CityJSON of several producers and versions against counts and areas that independent scripts
found.
"""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from cityjson_text import CUBE, FACES, at, house, instance, model, read, row, solid

from citypv.core.city.locate_site import locate_site
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

DATA = Path(__file__).parents[1] / "data" / "cityjson"
EXPECTED = json.loads((DATA / "expected.json").read_text(encoding="utf-8"))
NO_BUILDINGS = ("all_geometry_types_v10.json", "geomtemplate_2.city.json")
CASES = [
    (name, lod)
    for name, e in EXPECTED.items()
    if name not in NO_BUILDINGS
    for lod in sorted({key.split(":")[0][3:] for key in e["area_by_lod_geom_class"]})
]
PLACES = {  # of the publisher's towns, to a tenth of a degree
    "3dbag_3476_v11_triangulated.city.json": (52.1, 4.5),
    "3dbag_5870_ext.city.jsonl": (52.05, 4.3),
    "3dbag_delft_subset_v20.city.jsonl": (52.0, 4.4),
    "denhaag_random_5.city.jsonl": (52.1, 4.3),
    "montreal_b4.city.jsonl": (
        45.5,
        -77.55,
    ),  # it names UTM zone 18 for coordinates of MTM zone 8, 310 km further east
    "rotterdam_delfshaven_v20.city.json": (51.9, 4.4),
}


def find(name):
    return DATA / name if (DATA / name).exists() else DATA / f"{name}.gz"


def areas(city):
    return measure_polygons(city.points, city.ring_start, city.polygon_start)[0]


@pytest.mark.parametrize(("name", "lod"), CASES)
def test_counts_and_areas_of_every_lod(name, lod):
    city = read_city(find(name), lod=lod)
    types, area, thematic = EXPECTED[name]["types"], areas(city), np.array(city.thematic)
    assert city.report.building_count == types["Building"] + types.get("BuildingZ", 0)
    assert city.report.part_count == types.get("BuildingPart", 0)
    expected = {
        key.split(":")[2]: row
        for key, row in EXPECTED[name]["area_by_lod_geom_class"].items()
        if key.split(":")[0] == f"lod{lod}"
    }
    lost = sum(
        len(city.report.skipped.get(reason, ()))
        for reason in ("no area", "fewer than three points")
    )
    assert len(city) + lost == sum(count for count, _ in expected.values())
    for word, (count, square_metres) in expected.items():
        chosen = thematic == (word if word != "None" else "")
        assert count - lost <= chosen.sum() <= count
        assert area[chosen].sum() == pytest.approx(square_metres, rel=1e-3, abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLACES)
def test_place_on_earth_and_best_lod(name):
    city = read_city(find(name))
    assert set(city.report.lods_chosen) <= {"2", "2.2"}
    latitude, longitude, _ = locate_site(city.crs, city.points.mean(axis=0))
    assert (latitude, longitude) == pytest.approx(PLACES[name], abs=0.06)
    low, high = (np.array(EXPECTED[name][word]) for word in ("min", "max"))
    assert (city.points >= low - 2e-3).all()
    assert (city.points <= high + 2e-3).all()


READ = {  # file: buildings, polygons, area [m²] as its coordinates tell
    "appearance_lookalike.city.jsonl": (1, 1, 1.0),
    "bbox_seq.city.jsonl": (1, 1, 100.0),
    "cityjson_late_attribute.city.json": (2, 2, 200.0),
    "fcb_bbox_attr.city.jsonl": (3, 3, 300.0),
    "fcb_multi_object_feature.city.jsonl": (2, 2, 200.0),
    "fcb_string_truncation.city.jsonl": (2, 2, 200.0),
    "fcb_unsigned_range.city.jsonl": (2, 2, 200.0),
    "geometry_vertices_attr_collision.city.json": (1, 1, 100.0),
    "hierarchy.city.json": (1, 1, 100.0),
    "minimal.city.json": (1, 1, 100.0),
    "minimal_oneline.city.json": (1, 1, 1.0),
    "multisolid.city.json": (1, 2, 200.0),
    "numeric_lod.city.json": (1, 1, 100.0),
    "reserved_attr_collision.city.json": (1, 1, 100.0),
    "seq_named_city_json.city.json": (2, 2, 200.0),
    "temporal_offset.city.json": (1, 1, 100.0),
    "unknown_crs.city.json": (1, 1, 1.0),
    "wkb_winding.city.json": (1, 1, 0.5),
}
NO_BUILDING = (  # but generic objects, trees, a road
    "all_geometry_types_v10.json",
    "geomtemplate_2.city.json",
    "geometry_templates.city.json",
    "csol.json",
    "cube.json",
    "geometry_templates_bad_lod.city.json",
    "insert_appearance.city.json",
    "insert_crs_28992.city.json",
    "cube10.json",
    "insert_other_lod.city.json",
    "no_geometry.city.json",
    "cube2.json",
    "msol.json",
    "msol2.json",
    "nonmanifold.json",
    "torus.city.json",
)
REFUSED = {
    **dict.fromkeys(NO_BUILDING, "contains no buildings"),
    **dict.fromkeys(
        ("sample.city.jsonl", "sample_late_attribute.city.jsonl"), "no building has usable geometry"
    ),
    "cityparquet_metadata.json": "contains no outlines",  # a GeoJSON feature
}


@pytest.mark.parametrize("name", READ)
def test_odd_files_are_read(name):
    city = read_city(find(name))
    assert (city.report.building_count, len(city)) == READ[name][:2]
    assert areas(city).sum() == pytest.approx(READ[name][2])


@pytest.mark.parametrize("name", REFUSED)
def test_files_without_buildings_are_refused_with_the_reason(name):
    with pytest.raises(InputError, match=REFUSED[name]):
        read_city(find(name))


def test_every_file_at_hand_is_tried():
    names = {path.name.removesuffix(".gz") for path in DATA.iterdir()} - {"expected.json"}
    assert names == set(EXPECTED) | set(READ) | set(REFUSED)


@pytest.mark.parametrize(
    "name", ["cube.json", "torus.city.json", "nonmanifold.json", "msol.json", "csol.json"]
)
def test_solids_of_generic_objects_have_their_area_once_they_are_buildings(tmp_path, name):
    document = json.loads(find(name).read_text(encoding="utf-8"))
    for item in document["CityObjects"].values():
        item["type"] = "Building"
    city = read(tmp_path, document)
    scale = document.get("transform", {}).get("scale", [1, 1, 1])
    points = np.array(document["vertices"]) * scale
    whole = 0.0
    for geometry in (one for item in document["CityObjects"].values() for one in item["geometry"]):
        solids = [geometry["boundaries"]] if geometry["type"] == "Solid" else geometry["boundaries"]
        for surface in (surface for one in solids for surface in one[0]):
            sizes = [fan_area(points[ring]) for ring in surface]
            whole += sizes[0] - sum(sizes[1:])
    lost = sum(city.report.skipped_area.values())  # drawn twice, where two solids touch
    assert areas(city).sum() + lost == pytest.approx(whole, rel=1e-9)


def fan_area(ring):
    fan = np.cross(ring[1:-1] - ring[0], ring[2:] - ring[0]).sum(axis=0)
    return 0.5 * float(np.linalg.norm(fan))


def test_semantics_ids_and_parts(tmp_path):
    surfaces = [
        {"type": "GroundSurface", "id": "g"},
        {"type": "RoofSurface"},
        {"type": "WallSurface", "id": "w"},
    ]
    semantics = {"surfaces": surfaces, "values": [[0, 1, 2, 2, 2, None]]}
    part = house(solid(semantics=semantics), kind="BuildingPart", parents=["b"])
    city = read(tmp_path, model({"p": part, "b": house(children=["p"])}))
    assert city.thematic == [
        "GroundSurface",
        "RoofSurface",
        "WallSurface",
        "WallSurface",
        "WallSurface",
        "",
    ]
    assert city.surface_id == ["g", "b_2", "b_3", "b_4", "b_5", "b_6"]
    assert set(city.building_id) == {"b"}
    assert (city.report.building_count, city.report.part_count) == (1, 1)


def test_template_stands_where_its_matrix_and_point_put_it(tmp_path):
    # a quarter turn, twice as high, then a step
    matrix = [
        0,
        -1,
        0,
        10,
        1,
        0,
        0,
        20,
        0,
        0,
        2,
        30,
        0,
        0,
        0,
        1,
    ]
    templates = {"templates": [solid(lod=2.2)], "vertices-templates": CUBE}
    document = model(
        {"b": house(instance(matrix=matrix))},
        [[100, 200, 300]],
        **{"geometry-templates": templates},
    )
    city = read(tmp_path, document)
    assert city.report.lods_chosen == {"2.2": 6}
    face = [CUBE[corner] for corner in FACES[0]]
    assert city.rings(0)[0].tolist() == [[110 - y, 220 + x, 330 + 2 * z] for x, y, z in face]


def test_installations_shade_and_rooms_do_not(tmp_path):
    objects = {
        "b": house(solid(), children=["i", "r"]),
        "i": house(at(1), kind="BuildingInstallation", parents=["b"]),
        "r": house(solid(), kind="BuildingRoom", parents=["b"]),
    }
    city = read(tmp_path, model(objects, row(2)))
    assert city.thematic.count("BuildingInstallation") == 6
    assert len(city) == 12
    assert "1 BuildingRoom left out: not a building." in city.report.notes


@pytest.mark.parametrize(
    ("metadata", "crs", "said"),
    [
        ({"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25833"}, "EPSG:25833", ""),
        ({"crs": {"epsg": 25833}}, "EPSG:25833", ""),
        ([{"title": "campus", "referenceSystem": "EPSG:25833"}], "EPSG:25833", "system was read"),
        ("EPSG:25833", None, "it was not used"),
    ],
)
def test_the_system_in_metadata_and_those_that_are_not_an_object(tmp_path, metadata, crs, said):
    """A widely used script that extrudes OpenStreetMap's buildings wraps them into a list."""
    vertices = [[390000 + x, 5810000 + y, z] for x, y, z in CUBE]
    city = read(
        tmp_path,
        model({"b": house(solid())}, vertices, metadata=metadata, transform=None, version="1.0"),
    )
    assert city.crs == crs
    noted = [note for note in city.report.notes if "metadata that is not an object" in note]
    assert len(noted) == bool(said) and all(said in note for note in noted)


@pytest.mark.parametrize(
    ("encoding", "indent"), [("utf-8-sig", None), ("utf-16", 1), ("utf-32", None)]
)
def test_encodings_and_layouts(tmp_path, encoding, indent):
    document = json.dumps(model({"b": house(solid())}), indent=indent)
    (tmp_path / "city.json").write_bytes(document.encode(encoding))
    assert len(read_city(tmp_path / "city.json")) == 6
    (tmp_path / "city.json.gz").write_bytes(gzip.compress(document.encode(encoding)))
    assert len(read_city(tmp_path / "city.json.gz")) == 6
