"""Shapes with faults that public files have: holes, faces inside out, heights of nowhere, what no
longer stands.
"""

import json
from datetime import date

import numpy as np
import pytest
import shapely
from citygml_text import building, members, model, polygon, solid, surface, wrap
from cityjson_text import at as cube_at
from cityjson_text import house, row
from cityjson_text import model as json_model
from test_levels import box, faces, part

from citypv.core.city.polygons import measure_polygons
from citypv.core.city.tangled_rings import is_tangled
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python


def read(tmp_path, *buildings, **options):
    (tmp_path / "city.gml").write_text(model(*buildings), "utf-8")
    return read_city(tmp_path / "city.gml", **options)


def rectangle(*bounds, z=8):
    x0, y0, x1, y1 = bounds
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


ROOF = rectangle(0, 0, 20, 20)
HOLES = {  # holes of a roof of 20 m x 20 m: rectangles
    "one": [(5, 5, 15, 15)],
    "twice": [(5, 5, 15, 15)] * 2,
    "overlapping": [(5, 5, 15, 15), (10, 5, 18, 15)],
    "beyond the outline": [(15, 5, 25, 15)],
    "outside": [(30, 5, 35, 15), (5, 5, 15, 15)],
    "one in another": [(5, 5, 15, 15), (7, 7, 9, 9)],
    "side by side": [(2, 2, 6, 6), (6, 2, 10, 6)],
    "around a corner": [(-5, -5, 5, 5)],
}


@pytest.mark.parametrize("name", HOLES)
@pytest.mark.parametrize("tilt", ["flat", "wall"])
def test_the_union_of_holes_within_the_outline_is_missing(tmp_path, name, tilt):
    holes = [rectangle(*bounds)[::-1] for bounds in HOLES[name]]
    if tilt == "wall":  # x, y, 8 -> x, 8, y
        drawn, holes = (
            [(x, z, y) for x, y, z in ROOF],
            [[(x, z, y) for x, y, z in hole] for hole in holes],
        )
    city = read(
        tmp_path,
        building(surface(members(polygon("roof", drawn if tilt == "wall" else ROOF, *holes)))),
    )
    right = shapely.box(0, 0, 20, 20).difference(
        shapely.union_all([shapely.box(*bounds) for bounds in HOLES[name]])
    )
    area, normal = measure_polygons(*city.shape)
    assert area.sum() == pytest.approx(right.area, abs=1e-6) and len(city) == 1
    assert normal[0] == pytest.approx([0, -1, 0] if tilt == "wall" else [0, 0, 1])
    assert bool(city.report.repaired) == (name not in ("one", "side by side"))


def test_a_roof_that_holes_cut_in_two_becomes_two(tmp_path):
    hole = rectangle(8, -5, 12, 25)[::-1]
    roof = surface(
        members(polygon("roof", ROOF, hole), polygon("other", rectangle(30, 0, 40, 10))),
        "RoofSurface",
    )
    city = read(tmp_path, building(roof))
    assert city.surface_id == ["roof", "roof~2", "other"] and city.thematic == ["RoofSurface"] * 3
    assert measure_polygons(*city.shape)[0] == pytest.approx([160, 160, 100])


SHED = {  # of 10 m x 8 m, without ground: the roof faces south
    "roof": [(0, 0, 4), (10, 0, 4), (10, 8, 10), (0, 8, 10)],
    "south": [(0, 0, 0), (10, 0, 0), (10, 0, 4), (0, 0, 4)],
    "north": [(10, 8, 0), (0, 8, 0), (0, 8, 10), (10, 8, 10)],
    "east": [(10, 0, 0), (10, 8, 0), (10, 8, 10), (10, 0, 4)],
    "west": [(0, 8, 0), (0, 0, 0), (0, 0, 4), (0, 8, 10)],
}
GROUND = {"ground": [(0, 0, 0), (0, 8, 0), (10, 8, 0), (10, 0, 0)]}
KINDS = {"roof": "RoofSurface", "ground": "GroundSurface"}


def shed(inverted, *, ground=False, classes=True, gap=0.0):
    """A shed some of whose faces are drawn inside out; with a gap, corners of no two faces meet."""
    drawn = SHED | (GROUND if ground else {})
    middle, shown = np.array([5, 4, 5]), []
    for number, (name, rings) in enumerate(drawn.items()):
        corners = np.array(rings, float)
        corners += gap * np.sign(corners.mean(axis=0) - middle) * (1 + 0.1 * number)
        face = polygon(name, corners[::-1].tolist() if name in inverted else corners.tolist())
        shown.append(
            surface(members(face), KINDS.get(name, "WallSurface")) if classes else members(face)
        )
    text = "".join(shown)
    return building(text if classes else wrap(text, "bldg:lod2MultiSurface", "gml:MultiSurface"))


@pytest.mark.parametrize("gap", [0.0, 0.02])
@pytest.mark.parametrize("classes", [True, False])
@pytest.mark.parametrize("ground", [True, False])
@pytest.mark.parametrize(
    "inverted", [(), ("roof",), ("south",), ("roof", "north"), (*SHED, *GROUND)]
)
def test_faces_inside_out_are_turned_with_and_without_classes(
    tmp_path, inverted, ground, classes, gap
):
    """The shed as drawn rightly: roof south, 100 m²; every face turns away from its middle."""
    city = read(tmp_path, shed(inverted, ground=ground, classes=classes, gap=gap))
    area, normal = measure_polygons(*city.shape)
    middles = np.array([city.rings(k)[0].mean(axis=0) for k in range(len(city))])
    outward = np.einsum("ij,ij->i", normal, middles - [5, 4, 5]) > 0
    assert outward.all(), city.names_of(~outward)
    assert sum(map(len, city.report.repaired.values())) == len(
        set(inverted) & {*SHED, *(GROUND if ground else ())}
    )
    assert area.sum() == pytest.approx(352 + 80 * ground)


def test_a_class_against_what_a_face_shows_is_named(tmp_path):
    """A roof drawn as ground in a closed box: it stays, and is named."""
    kinds = "RoofSurface", "GroundSurface", *["WallSurface"] * 4
    text = "".join(
        surface(faces(face), kind) for face, kind in zip(box(0, 0, 0, 9, 9, 9), kinds, strict=True)
    )
    city = read(tmp_path, building(text))
    assert not city.report.repaired
    assert city.report.notes[-1].startswith("2 surfaces face against their class")


def row_of_houses(bases):
    """Boxes of 10 m side, 20 m apart."""
    drawn = (box(20 * k, 0, z, 20 * k + 10, 10, z + 10) for k, z in enumerate(bases))
    return [building(solid(faces(*shape)), name=f"h{k}") for k, shape in enumerate(drawn)]


BASES = {  # heights of the bases of houses in a row -> those that are believed
    "no data": ([100, 101, -9999, 102, 103, 104], [0, 1, 3, 4, 5]),
    "two without data": ([100, 101, -9999, -9999, 103, 104, 105], [0, 1, 4, 5, 6]),
    "zero in the mountains": ([1500, 1501, 0, 1502], [0, 1, 3]),
    "too high": ([1, 1, 32767, 1], [0, 1, 3]),
    "a cliff": ([0, 0, 90, 90, 90], [0, 1, 2, 3, 4]),
    "a cellar": ([0, 0, -60, 0], [0, 1, 2, 3]),
    "all of them": ([-9999, -9999, -9999], [0, 1, 2]),
    "two": ([0, -9999], [0, 1]),
}


@pytest.mark.parametrize("name", BASES)
def test_a_base_far_from_all_others_is_left_out(tmp_path, name):
    bases, kept = BASES[name]
    city = read(tmp_path, *row_of_houses(bases))
    assert list(dict.fromkeys(city.building_id)) == [f"h{k}" for k in kept]
    assert city.report.building_count == len(kept)
    gone = [f"h{k}" for k in range(len(bases)) if k not in kept]
    assert [name for names in city.report.skipped.values() for name in names] == gone


@pytest.mark.parametrize("height, told", [(1400.0, True), (1100.0, True), (800.0, False)])
def test_a_house_over_a_thousand_metres_high_is_named_with_a_unit_that_would_do(
    tmp_path, height, told
):
    shapes = [box(20 * k, 0, 0, 20 * k + 10, 10, height if k == 1 else 10) for k in range(4)]
    drawn = [building(solid(faces(*shape)), name=f"h{k}") for k, shape in enumerate(shapes)]
    city = read(tmp_path, *drawn)
    assert city.report.building_count == 4 and city.points[:, 2].max() == height  # read as drawn
    notes = [note for note in city.report.notes if "over 1,000 m high" in note]
    assert len(notes) == told and all("h1" in note and "centimetres" in note for note in notes)


ENDS = {  # child elements of a building, and whether it is gone on the first day of 2026
    "": False,
    "<core:terminationDate>2010-01-01</core:terminationDate>": True,
    "<core:terminationDate>2010-01-01T00:00:00+01:00</core:terminationDate>": True,
    "<core:terminationDate>2999-01-01</core:terminationDate>": False,
    "<bldg:yearOfDemolition>2010</bldg:yearOfDemolition>": True,
    "<bldg:yearOfDemolition>2026</bldg:yearOfDemolition>": False,
    "<con:dateOfDemolition>2025-12-31</con:dateOfDemolition>": True,
    "<con:dateOfDemolition>2026-01-02</con:dateOfDemolition>": False,
    "<core:terminationDate>unknown</core:terminationDate><bldg:yearOfDemolition>2010</bldg:yearOfDemolition>": True,
    "<bldg:yearOfDemolition></bldg:yearOfDemolition>": False,
}


@pytest.mark.parametrize("told", ENDS)
def test_dates_of_ends(tmp_path, monkeypatch, told):
    class Today(date):
        @classmethod
        def today(cls):
            return cls(2026, 1, 1)

    monkeypatch.setattr("citypv.core.read.lifetimes.date", Today)
    told_apart = told.replace("core:", "bldg:").replace("con:", "bldg:")
    old = building(told_apart, solid(faces(*box(20, 0, 0, 30, 8, 8))), name="old")
    city = read(tmp_path, building(solid(faces(*box(0, 0, 0, 10, 8, 8)))), old)
    assert ("old" in city.building_id) != ENDS[told]


def test_years_of_demolition_far_ahead_are_assumed_lifetimes(tmp_path):
    """As in a file of 100 made-up houses, demolished from 2021 to 2099."""
    told, shape = (
        "<bldg:yearOfDemolition>{}</bldg:yearOfDemolition>",
        solid(faces(*box(0, 0, 0, 9, 9, 9))),
    )
    houses = [building(told.format(year), shape, name=f"h{year}") for year in (2021, 2999)]
    city = read(tmp_path, *houses)
    assert city.report.building_count == 2 and "assumed lifetimes" in city.report.notes[0]


def test_what_no_longer_stands_is_left_out_and_listed(tmp_path):
    gone = "<bldg:yearOfDemolition>2010</bldg:yearOfDemolition>"
    old = building(gone, solid(faces(*box(20, 0, 0, 30, 8, 8))), name="old")
    parts = (
        part(solid(faces(*box(0, 0, 0, 10, 8, 8)))),
        part(gone, solid(faces(*box(10, 0, 0, 14, 8, 4)))),
    )
    city = read(tmp_path, building(*parts), old)
    assert set(city.building_id) == {"house"} and len(city) == 6 and city.report.building_count == 1
    (names,) = city.report.skipped.values()
    assert names == ["house part 2", "old"]


UNREADABLE = {  # points of a wall in the file -> what is said
    "<gml:posList>0,0 0,0 0,0 4,0 0,0 0,0 4,0 0,0 3,0</gml:posList>": (
        "coordinates with a decimal comma"
    ),
    '<gml:posList srsDimension="2">0 0 4 0 4 3</gml:posList>': "2D coordinates without heights",
    "<gml:posList>0 0 0 4 x 0</gml:posList>": "coordinates that are not numeric",
}


@pytest.mark.parametrize("points", UNREADABLE)
def test_the_commonest_reason_is_told(tmp_path, points):
    walls = [wrap(points, "gml:Polygon", "gml:exterior", "gml:LinearRing")] * 3
    with pytest.raises(
        InputError, match=rf"city\.gml: .*: {UNREADABLE[points]}.* \(3, for example"
    ):
        read(tmp_path, building(surface(members(*walls))))


def test_a_link_into_another_file_is_told_and_one_into_its_own_is_followed(tmp_path):
    link = '<gml:surfaceMember xlink:href="{}#wall"/>'
    with pytest.raises(
        InputError, match=r"reference to a polygon in another file.*'other\.gml#wall'"
    ):
        read(tmp_path, building(solid(link.format("other.gml"))))
    wall = surface(members(polygon("wall", SHED["south"])))
    assert len(read(tmp_path, building(wall, solid(link.format("city.gml"))))) == 1


def test_what_no_longer_stands_of_cityjson(tmp_path):
    end = {"attributes": {"terminationDate": "2010-01-01"}}
    objects = {
        "house": house(cube_at(0)),
        "old": house(cube_at(1), children=["annex"], **end),
        "annex": house(cube_at(2), kind="BuildingPart", parents=["old"]),
        "tree": {"type": "SolitaryVegetationObject", "geometry": [cube_at(3)], **end},
    }
    (tmp_path / "city.json").write_text(json.dumps(json_model(objects, row(4))), "utf-8")
    city = read_city(tmp_path / "city.json")
    assert set(city.building_id) == {"house"} and not city.trees
    assert list(city.report.skipped.values()) == [["old", "tree"]]


@pytest.mark.slow
def test_a_ring_that_crosses_itself_very_often_is_left_out(tmp_path):
    """60,000 corners at random have 600 million crossings. A star of 25 points has 25 · 11 = 275
    and stays.
    """
    places = np.random.default_rng(0).random((60_000, 2)) * 100
    turn = 2 * np.pi * 12 * np.arange(25) / 25
    star = np.c_[200 + 10 * np.cos(turn), 10 * np.sin(turn)]
    lines = []
    for name, corners in (("noise", places), ("star", star)):
        lines += [f"o {name}", *(f"v {x:.6f} {y:.6f} 10" for x, y in corners)]
        lines += ["f " + " ".join(str(k - len(corners)) for k in range(len(corners)))]
    (tmp_path / "noise.obj").write_text("\n".join(lines), "utf-8")
    city = read_city(tmp_path / "noise.obj")
    assert list(city.building_id) == ["star"]
    assert any("crosses itself more than 1,000 times" in reason for reason in city.report.skipped)


@pytest.mark.parametrize(("points", "tangled"), [(91, False), (101, True)])
def test_crossings_are_counted(points, tangled):
    """The star polygon {n/k} crosses itself n (k - 1) times: 910 and 1,010."""
    turn = 2 * np.pi * 11 * np.arange(points) / points
    assert is_tangled(np.c_[np.cos(turn), np.sin(turn)]) == tangled
