"""CityGML written by hand: references, twins, orientation and repairs; what cannot be used ends in
one clear line.
"""

import copyreg
import gzip
import pickle

import citygml_text as text
import numpy as np
import pytest
import shapely

from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

SQUARE = text.SQUARE  # in the plane y = 0, 12 m², faces south
FURTHER = [(x, y + 5, z) for x, y, z in SQUARE]


def read(tmp_path, *buildings, **options):
    path = tmp_path / "city.gml"
    path.write_text(text.model(*buildings), encoding="utf-8")
    return read_city(path, **options)


WALL = text.surface(text.members(text.polygon("a", SQUARE)))
DRAWINGS = {  # parts of a building: ids, classes, what is left out
    "a solid names its boundary surface": (
        (WALL, text.solid(text.links("a"))),
        ["a"],
        ["WallSurface"],
        [],
    ),
    "a boundary surface names a polygon of the solid": (
        (
            text.solid(text.members(text.polygon("a", SQUARE))),
            text.surface(text.links("a"), kind="RoofSurface"),
        ),
        ["a"],
        ["RoofSurface"],
        [],
    ),
    "a solid drawn again beside its surfaces": (
        (WALL, text.solid(text.members(text.polygon("b", SQUARE)))),
        ["a"],
        ["WallSurface"],
        ["b"],
    ),
    "only in the solid": (
        (text.solid(text.members(text.polygon("a", SQUARE), text.polygon("b", FURTHER))),),
        ["a", "b"],
        ["", ""],
        [],
    ),
    "no target": (
        (WALL, text.solid(text.links("a", "nowhere"))),
        ["a"],
        ["WallSurface"],
        ["nowhere"],
    ),
}


@pytest.mark.parametrize("name", DRAWINGS)
def test_surfaces_and_solids_of_one_building(tmp_path, name):
    parts, ids, classes, left_out = DRAWINGS[name]
    city = read(tmp_path, text.building(*parts))
    assert (city.surface_id, city.thematic) == (ids, classes)
    assert [name for names in city.report.skipped.values() for name in names] == left_out


@pytest.mark.parametrize(("sign", "north"), [("+", -1), ("-", 1)])
def test_an_orientable_surface_turns_its_polygon_and_a_solid_says_which_side_is_outside(
    tmp_path, sign, north
):
    for inside, beside in (
        (f">{text.polygon('a', SQUARE)}</gml:baseSurface>", ""),
        (' xlink:href="#a"/>', WALL),
    ):
        turned = (
            "<gml:OrientableSurface "
            f'orientation="{sign}"><gml:baseSurface{inside}</gml:OrientableSurface>'
        )
        city = read(tmp_path, text.building(beside, text.solid(text.members(turned))))
        _, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
        assert normal[0] == pytest.approx([0, north, 0])


def test_nested_composite_surface_named_as_a_whole(tmp_path):
    group = (
        "<gml:CompositeSurface "
        f'gml:id="group">{text.members(text.polygon("a", SQUARE))}</gml:CompositeSurface>'
    )
    solid = text.solid(text.members(group) + text.members(text.polygon("b", FURTHER)))
    city = read(
        tmp_path,
        text.building(
            solid,
            text.surface(text.links("group"), kind="RoofSurface"),
            text.surface(text.links("b")),
        ),
    )
    assert dict(zip(city.surface_id, city.thematic, strict=True)) == {
        "a": "RoofSurface",
        "b": "WallSurface",
    }


def test_names_are_made_where_missing_and_numbered_where_repeated(tmp_path):
    third = [(x, y + 9, z) for x, y, z in SQUARE]
    walls = text.surface(
        text.members(text.polygon("", SQUARE), text.polygon("a", FURTHER), text.polygon("a", third))
    )
    city = read(tmp_path, text.building(walls), text.building(walls, name=""))
    assert len(set(city.surface_id)) == 6
    assert city.surface_id[0] == "house_1"
    assert city.surface_id[1:3] == ["a", "a~2"]
    assert city.building_id[3] == "building_2"
    assert city.report.repaired["duplicate identifier, number appended"] == ["a~2", "a~3", "a~4"]


def test_unclosed_and_repeated_points_are_mended_and_reported(tmp_path):
    doubled = [FURTHER[0], FURTHER[0], *FURTHER[1:]]
    walls = text.surface(
        text.members(text.polygon("open", SQUARE, closed=False), text.polygon("twice", doubled))
    )
    city = read(tmp_path, text.building(walls))
    assert [len(city.rings(k)[0]) for k in range(2)] == [4, 4]
    assert city.report.repaired == {
        "ring was not closed": ["open"],
        "repeated point removed": ["twice"],
    }


def test_polygon_drawn_twice_in_its_building_counts_once(tmp_path):
    again = [*SQUARE[2:], *SQUARE[:2]]  # begins at another corner
    other_side, larger = SQUARE[::-1], [(2 * x, y, z) for x, y, z in SQUARE]
    drawn = {"once": SQUARE, "again": again, "other_side": other_side, "larger": larger}
    city = read(
        tmp_path,
        text.building(
            text.surface(text.members(*[text.polygon(name, ring) for name, ring in drawn.items()]))
        ),
        text.building(text.surface(text.members(text.polygon("neighbour", SQUARE))), name="next"),
    )
    assert city.surface_id == ["once", "other_side", "larger", "neighbour"]
    assert city.report.skipped == {"duplicate polygon in its building": ["again"]}
    assert city.report.skipped_area == {"duplicate polygon in its building": pytest.approx(12)}


def test_polygons_that_cannot_be_used_are_left_out_with_reason_and_name(tmp_path):
    flat = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    bad = text.polygon("word", [("0 0 x", 0, 0), *SQUARE])
    drawn = (
        text.polygon("good", SQUARE),
        text.polygon("flat", flat),
        text.polygon("two", flat[:2]),
        bad,
    )
    city = read(tmp_path, text.building(text.surface(text.members(*drawn))))
    assert city.surface_id == ["good"]
    assert city.report.skipped == {
        "coordinates that are not numeric": ["word"],
        "no area": ["flat"],
        "fewer than three points": ["two"],
    }


def test_interiors_are_never_read(tmp_path):
    inner = text.polygon("inner", FURTHER)
    room = text.wrap(
        text.members(inner), "bldg:interiorRoom", "bldg:Room", "bldg:lod4Solid", "gml:Solid"
    )
    city = read(
        tmp_path, text.building(text.surface(text.members(text.polygon("a", SQUARE)), lod=4), room)
    )
    assert city.surface_id == ["a"]


@pytest.mark.parametrize("value", ["nan", "inf", "1e308"])
def test_coordinates_beyond_earth_are_refused(tmp_path, value):
    with pytest.raises(InputError, match=r"city.gml: line 4: a coordinate is not finite"):
        read(
            tmp_path,
            "\n",
            text.building(text.surface(text.members(text.polygon("a", [(value, 0, 0), *SQUARE])))),
        )


def test_installation_shades_and_other_objects_are_named(tmp_path):
    shell = text.wrap(
        text.members(text.polygon("i", FURTHER)), "bldg:lod2Geometry", "gml:MultiSurface"
    )
    balcony = text.wrap(shell, "bldg:outerBuildingInstallation", "bldg:BuildingInstallation")
    city = read(
        tmp_path,
        text.building(text.surface(text.members(text.polygon("a", SQUARE))), balcony),
        "<cityObjectMember><Bridge/></cityObjectMember>",
    )
    assert city.thematic == ["WallSurface", "BuildingInstallation"]
    assert city.report.notes == ["1 Bridge left out: not a building."]


# a quarter turn to the left, twice as high, then a step
TURN = "0 -1 0 10 1 0 0 20 0 0 2 30 0 0 0 1"


def installation(shape, matrix=TURN, point="100 200 300"):
    parts = f"<core:transformationMatrix>{matrix}</core:transformationMatrix>" if matrix else ""
    parts += f"<core:relativeGMLGeometry{shape}</core:relativeGMLGeometry>"
    parts += text.wrap(point, "core:referencePoint", "gml:Point", "gml:pos") if point else ""
    tags = (
        "bldg:outerBuildingInstallation",
        "bldg:BuildingInstallation",
        "bldg:lod2ImplicitRepresentation",
    )
    return text.wrap(parts, *tags, "core:ImplicitGeometry").replace("core:", "")


def shape(name="s", ring="m"):
    return (
        "><gml:MultiSurface "
        f'gml:id="{name}">{text.members(text.polygon(ring, SQUARE))}</gml:MultiSurface>'
    )


def test_implicit_geometry_stands_where_its_matrix_and_point_put_it(tmp_path):
    wall = text.surface(text.members(text.polygon("w", FURTHER)))
    city = read(
        tmp_path,
        text.building(wall, installation(shape()), installation(' xlink:href="#s">', "", "1 2 3")),
    )
    assert city.surface_id == ["w", "m", "m~2"]
    assert city.thematic == ["WallSurface", "BuildingInstallation", "BuildingInstallation"]
    # (x, y, z) becomes (-y + 10, x + 20, 2z + 30), then the point is added.
    assert city.rings(1)[0].tolist() == [[110 - y, 220 + x, 330 + 2 * z] for x, y, z in SQUARE]
    assert city.rings(2)[0].tolist() == [[1 + x, 2 + y, 3 + z] for x, y, z in SQUARE]
    assert not city.report.skipped


@pytest.mark.parametrize(
    ("drawn", "reason"),
    [
        (installation(' xlink:href="#nowhere">'), "whose prototype is not in the file"),
        (
            installation(shape(), point=""),
            "without a shape, a reference point or a level of detail",
        ),
        (
            installation(shape(), point="1 nan 3"),
            "without a shape, a reference point or a level of detail",
        ),
    ],
)
def test_implicit_geometry_that_cannot_be_placed_is_reported(tmp_path, drawn, reason):
    city = read(
        tmp_path, text.building(text.surface(text.members(text.polygon("w", FURTHER))), drawn)
    )
    assert city.surface_id == ["w"]
    assert list(city.report.skipped) == [f"implicit geometry {reason}"]


def square(west, south, side):
    return [
        (west, south, 5),
        (west + side, south, 5),
        (west + side, south + side, 5),
        (west, south + side, 5),
    ]


def test_a_court_written_as_the_outline_of_its_house(tmp_path):
    """As a producer in Saxony does: area by shapely, direction that of the larger ring."""
    court, well, house = square(3, 3, 4), square(1, 1, 1), square(0, 0, 10)
    roof = text.surface(
        text.members(text.polygon("roof", court[::-1], house, well[::-1])), "RoofSurface"
    )
    plain = text.surface(
        text.members(text.polygon("plain", house, court[::-1], well[::-1])), "RoofSurface"
    )
    city = read(tmp_path, text.building(roof), text.building(plain, name="other"))
    area, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    assert area == pytest.approx(shapely.Polygon(house, [court, well]).area) and np.all(
        normal[:, 2] == 1
    )
    assert (
        city.report.repaired == {"outline and hole exchanged": ["roof"]} and not city.report.skipped
    )


def test_a_hole_beside_its_outline_is_named(tmp_path):
    """Larger than the outline, and not around it: nothing tells what was meant."""
    roof = text.surface(
        text.members(text.polygon("roof", square(0, 0, 4), square(20, 0, 9))), "RoofSurface"
    )
    city = read(
        tmp_path, text.building(roof, text.surface(text.members(text.polygon("wall", SQUARE))))
    )
    assert city.surface_id == ["wall"]
    assert city.report.skipped == {"holes larger than their outline, beside it": ["roof"]}
    assert city.report.skipped_area == {"holes larger than their outline, beside it": 0.0}


HOUSE = text.building(WALL)
GOOD = text.model(HOUSE).encode()
LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9))
    + ']><CityModel xmlns="http://www.opengis.net/citygml/2.0">&j;</CityModel>'
)
OUTSIDE = '<!DOCTYPE x SYSTEM "http://localhost:1/x.dtd"><CityModel xmlns="http://www.opengis.net/citygml/2.0"/>'
FILES = {
    "empty": (b"", "empty"),
    "cut": (GOOD[: len(GOOD) // 2], r"line \d+: invalid XML"),
    "cut in the head": (GOOD[:60], r"line \d+: "),
    "no xml": (b"hello", "line 1"),
    "binary": (bytes(range(1, 200)), "line 1"),
    "html": (b"<html><body>404</body></html>", r"line 1: <html> is not CityGML"),
    "no buildings": (text.model().encode(), "no buildings"),
    "building without a shape": (
        text.model(text.building()).encode(),
        "no building has a usable shape",
    ),
    "laughs": (LAUGHS.encode(), "line 1: document types"),
    "external document type": (OUTSIDE.encode(), "line 1: document types"),
    "entity of an attribute": (
        GOOD.replace(b"<CityModel", b'<!DOCTYPE m [<!ENTITY e "x">]><CityModel').replace(
            b"house", b"&e;"
        ),
        "document type",
    ),
    "zip": (b"PK\x03\x04....", "zip archive"),
    "long namespace": (
        GOOD.replace(b"<CityModel ", b'<CityModel xmlns:p="' + b"a b " * 200 + b'" ', 1),
        "invalid XML",
    ),
    "cut gzip": (gzip.compress(GOOD)[:-40], "decompression fails"),
    "long attribute": (
        GOOD.replace(b'"house"', b'"' + b"x" * 11_000_000 + b'"'),
        r"line \d+: too much text or nested",
    ),
}


def assert_refused(path, problem, longest=500):
    """One short line: file, place and cure."""
    with pytest.raises(InputError, match=problem) as caught:
        read_city(path)
    message = str(caught.value)
    assert (
        message.startswith(str(path))
        and "; " in message
        and "\n" not in message
        and len(message) < longest
    )


@pytest.mark.parametrize("name", FILES)
def test_refused_with_file_place_and_cure(tmp_path, name):
    data, problem = FILES[name]
    path = tmp_path / "city.gml"
    path.write_bytes(data)
    assert_refused(path, problem)


def test_missing_file_and_folder_without_files_of_buildings(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.gml: no such file; check the path"):
        read_city(tmp_path / "nowhere.gml")
    with pytest.raises(InputError, match="folder without building files"):
        read_city(tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "iso-8859-1"])
def test_encodings_and_byte_order_marks(tmp_path, encoding):
    written = GOOD.decode().replace("UTF-8", {"utf-8-sig": "UTF-8"}.get(encoding, encoding.upper()))
    (tmp_path / "city.gml").write_bytes(written.encode(encoding))
    assert read_city(tmp_path / "city.gml").surface_id == ["a"]


@pytest.mark.slow
def test_one_huge_line(tmp_path):
    many = "".join(
        HOUSE.replace('"house"', f'"h{k}"').replace('"a"', f'"a{k}"').strip() for k in range(3000)
    )
    (tmp_path / "city.gml").write_text(
        text.HEAD.replace("\n", "") + many + "</CityModel>", encoding="utf-8"
    )
    assert len(read_city(tmp_path / "city.gml")) == 3000


@pytest.mark.parametrize("comment", ["", "<!-- <CityModel> -->"])
def test_undeclared_prefixes_are_declared_and_noted(tmp_path, comment):
    written = GOOD.decode().replace(
        "<gml:surfaceMember>", '<gml:surfaceMember xlink:show="new"><uro:x/><bad:y/>'
    )
    written = written.replace(' xmlns:xlink="http://www.w3.org/1999/xlink"', "")
    written = written.replace("<CityModel", f"{comment}<CityModel")
    (tmp_path / "city.gml").write_text(written, encoding="utf-8")
    city = read_city(tmp_path / "city.gml")
    assert city.surface_id == ["a"]
    assert [note.split("prefix ")[1].split()[0] for note in city.report.notes] == [
        "'xlink'",
        "'uro'",
        "'bad'",
    ]


def test_undeclared_prefix_of_the_building_itself(tmp_path):
    written = GOOD.decode().replace(' xmlns:bldg="http://www.opengis.net/citygml/building/2.0"', "")
    (tmp_path / "city.gml").write_text(written, encoding="utf-8")
    assert read_city(tmp_path / "city.gml").thematic == ["WallSurface"]


def test_undeclared_prefix_that_cannot_be_mended_is_named(tmp_path, monkeypatch):
    written = (
        GOOD.decode()
        .replace("<gml:surfaceMember>", "<gml:surfaceMember><uro:x/>")
        .replace("UTF-8", "UTF-16")
    )
    (tmp_path / "city.gml").write_bytes(written.encode("utf-16"))
    with pytest.raises(
        InputError, match=r"line 3: the prefix 'uro' is not declared; declare it"
    ) as caught:
        read_city(tmp_path / "city.gml")
    # Dask's, if tests of it ran before
    monkeypatch.delitem(copyreg.dispatch_table, type(caught.value), raising=False)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    many = "".join(f"<p{k}:x/>" for k in range(17))
    (tmp_path / "many.gml").write_text(
        GOOD.decode().replace("<gml:surfaceMember>", "<gml:surfaceMember>" + many)
    )
    with pytest.raises(InputError, match="the prefix 'p16'"):
        read_city(tmp_path / "many.gml")
