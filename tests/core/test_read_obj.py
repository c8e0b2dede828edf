"""OBJ of five producers against counts and areas that independent scripts found, and its traps one
by one.
"""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from cities import make_city
from test_citygml_rules import assert_refused
from thorough import mark_cases

from citypv.core.city.build_scene import build_scene
from citypv.core.city.classify import measure_tilt
from citypv.core.city.orient_shells import orient_shells
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.parse_obj import parse_obj
from citypv.core.read.read_city import read_city
from citypv.core.read.read_obj import read_obj

pytestmark = pytest.mark.every_python

DATA = Path(__file__).parents[1] / "data" / "obj"
EXPECTED = json.loads((DATA / "expected.json").read_text(encoding="utf-8"))
US_FOOT = 1200 / 3937  # [m]
BANDS = {
    "up<1": (0, 1),
    "roof1-15": (1, 15),
    "roof15-60": (15, 60),
    "steep60-89": (60, 89),
    "wall89-91": (89, 91),
}
CUBE = "\n".join(f"v {x} {y} {z}" for z in (0, 3) for y in (0, 2) for x in (0, 1))
FACES = ["f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 2 4 8 6", "f 4 3 7 8", "f 3 1 5 7"]


def find(name):
    return DATA / name if (DATA / name).exists() else DATA / f"{name}.gz"


def write(folder, text, name="city.obj"):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def measure(city):
    area, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    return area, normal, measure_tilt(normal)[0]


def signed_volume(city):
    area, normal, _ = measure(city)
    first = city.points[city.ring_start[city.polygon_start[:-1]]]
    return float((area * (normal * (first - first.mean(axis=0))).sum(axis=1)).sum() / 3)


def count_doubles(parts):
    """Triangles that their object has already, corner for corner and the same way round."""
    seen, doubles = set(), 0
    for face, number in zip(parts.faces, parts.objects, strict=True):
        corners = [tuple(parts.vertices[k]) for k in face]
        start = corners.index(min(corners))
        key = number, *corners[start:], *corners[:start]
        doubles += len(set(corners)) == 3 and key in seen
        seen.add(key)
    return doubles


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(EXPECTED, kept=2))
def test_counts_bounds_and_volumes(name):
    expected = EXPECTED[name]
    parts = parse_obj(find(name))
    assert len(parts.vertices) == expected["vertices"]
    assert len(parts.faces) == expected["triangles"]
    assert parts.vertices.min(axis=0) == pytest.approx(expected["min"], abs=6e-4)
    assert parts.vertices.max(axis=0) == pytest.approx(expected["max"], abs=6e-4)
    city = read_city(find(name))
    assert city.report.building_count == max(expected["objects"], 1)
    assert sum(city.report.lods_met.values()) == expected["triangles"]
    doubles = len(city.report.skipped.get("duplicate polygon in its building", []))
    assert doubles == count_doubles(parts)
    lost = sum(len(ids) for reason, ids in city.report.skipped.items())
    assert lost - doubles == expected["degenerate"]
    assert len(city) == expected["triangles"] - lost
    assert city.crs is None


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_areas_by_tilt_as_drawn(name):
    content = read_obj(find(name))
    rings = [polygon.rings[0][:-1] for polygon in content.polygons]
    starts = np.cumsum([0, *[len(ring) for ring in rings]])
    area, normal = measure_polygons(np.concatenate(rings), starts, np.arange(len(rings) + 1))
    tilt = measure_tilt(normal)[0]
    expected = EXPECTED[name]["area_by_tilt_native_units_if_Zup"]
    for word, (low, high) in {**BANDS, "down": (91, 180.1)}.items():
        inside = area[(tilt >= low) & (tilt < high)].sum()
        assert inside == pytest.approx(expected.get(word, 0.0), rel=1e-3, abs=0.1)


@pytest.mark.slow
def test_grounds_of_rockaway_that_face_up_are_turned_and_named():
    city = read_city(find("nyc_rockaway_1km_feet.obj"), unit="us-ft")
    area, _, tilt = measure(city)
    up, down = area[tilt < 1].sum(), area[tilt > 179].sum()
    # Every building is a prism: as much floor as roof. As drawn, seven times as much faced up.
    assert up == pytest.approx(down, rel=1e-4)
    expected = EXPECTED["nyc_rockaway_1km_feet.obj"]["area_by_tilt_native_units_if_Zup"]
    assert up + down == pytest.approx((expected["up<1"] + expected["down"]) * US_FOOT**2, rel=1e-3)
    assert (
        sum(len(ids) for reason, ids in city.report.repaired.items() if "flipped" in reason) > 4000
    )
    assert any("EPSG:2263" in note for note in city.report.notes)


@pytest.mark.slow
@pytest.mark.thorough
def test_midtown_in_metres_keeps_its_volume():
    city = read_city(find("nyc_midtown_citicorp_1km.obj"))
    expected = EXPECTED["nyc_midtown_citicorp_1km.obj"]
    assert signed_volume(city) == pytest.approx(expected["signed_volume"], rel=1e-2)
    assert len(set(city.building_id)) == expected["objects"]


def test_the_tower_stands_upright_with_y_up():
    city = read_city(find("nyc_tower_yup.obj"), unit="us-ft", up="y")
    height = EXPECTED["nyc_tower_yup.obj"]["max"][1] * US_FOOT
    assert np.ptp(city.points[:, 2]) == pytest.approx(height, abs=1e-3)
    area, _, tilt = measure(city)
    # The same tower in CityGML: its walls, and as much roof as floor.
    assert area[np.abs(tilt - 90) < 1].sum() == pytest.approx(34722.7, rel=1e-3)
    assert area[tilt < 1].sum() == pytest.approx(3343.3, rel=1e-3) == area[tilt > 179].sum()
    assert signed_volume(city) == pytest.approx(
        EXPECTED["nyc_tower_yup.obj"]["signed_volume"] * US_FOOT**3, rel=1e-2
    )


def test_the_floors_of_lyon_are_turned_as_the_tower_around_them():
    city = read_city(find("lyon_tour_part_dieu.obj"))
    area, _, tilt = measure(city)
    assert area[tilt > 91].sum() == pytest.approx(
        area[tilt < 1].sum() + area[(tilt > 1) & (tilt < 60)].sum(), rel=0.06
    )
    # Four more, 0.41 m² in all, stick out of the tower: as drawn, 29 to 47 % of 4,096 rays see the
    # sky, and turned, less than half see backs.
    assert len(city.report.repaired["flipped with its open shell"]) == 232
    spared = [note for note in city.report.notes if "not by rays from both sides" in note]
    assert len(spared) == 1
    assert spared[0].startswith("4 surfaces")
    assert (
        area[
            [
                city.surface_id.index(name.removesuffix(" …"))
                for name in spared[0].split(": ")[1].rstrip(".").split(", ")
            ]
        ].sum()
        < 0.45
    )


@pytest.mark.parametrize(
    # "6 5 2 1" of the two cubes crosses itself: no area
    ("name", "faces", "buildings", "left_out"),
    [("cube.obj", 5, 1, 0), ("duplicatevertices.obj", 5, 1, 0), ("nonmanifold.obj", 12, 1, 0),
     ("nonmanifold.gml", 12, 1, 0), ("twocubes.obj", 12, 2, 1)],
)  # fmt: skip
def test_invalid_shells_are_read_and_said(name, faces, buildings, left_out):
    city = read_city(DATA / name)
    assert len(city) == faces - left_out
    assert len(set(city.building_id)) == buildings
    assert sum(len(ids) for ids in city.report.skipped.values()) == left_out


def test_no_place_is_asked_for():
    scene = build_scene(read_city(find("simshady_calibration.obj")))
    assert scene.site.latitude is None
    assert scene.surfaces.area.sum() == pytest.approx(1.0)
    assert build_scene(read_city(find("simshady_calibration.obj")), 50.0, 8.0).site.latitude == 50.0


def test_corners_count_backwards_and_carry_textures(tmp_path):
    text = CUBE + "\nvt 0 0\nvn 0 0 1\n" + "\n".join(FACES)
    plain = read_city(write(tmp_path, text))
    backwards = text.replace("f 5 6 8 7", "f -4/1 -3/1 -1/1 -2/1").replace(
        "f 1 2 6 5", "f 1//1 2//1 6/1/1 \\\n 5"
    )
    for ending in ("", " \\"):  # a file may end where a line should go on
        other = read_city(write(tmp_path, backwards + ending))
        assert np.array_equal(plain.points, other.points)
    assert signed_volume(plain) == pytest.approx(6.0)


def test_groups_are_buildings_where_no_object_is(tmp_path):
    text = (
        f"{CUBE}\ng north wing\n{FACES[0]}\n{FACES[1]}\ng south\n{FACES[2]}\ng north "
        f"wing\n{FACES[3]}"
    )
    assert read_city(write(tmp_path, text)).building_id == [
        "north wing",
        "north wing",
        "south",
        "north wing",
    ]
    objects = text.replace("\ng south", "\no tower\ng south")
    assert read_city(write(tmp_path, objects)).building_id == [
        "building_1",
        "building_1",
        "tower",
        "tower",
    ]


def test_scattered_parts_are_buildings_and_what_stands_on_one_belongs_to_it(tmp_path):
    def cube(x, z, first, side=1.0):
        corners = [
            (x + a * side, b * side, z + c * side) for c in (0, 1) for b in (0, 1) for a in (0, 1)
        ]
        faces = [[int(n) + first for n in face.split()[1:]] for face in FACES]
        vertices = [f"v {a} {b} {c}" for a, b, c in corners]
        return "\n".join([*vertices, *[f"f {' '.join(map(str, face))}" for face in faces]]) + "\n"

    text = cube(0, 0, 0, 10.0) + cube(50, 0, 8) + cube(4, 10.5, 16)
    city = read_city(write(tmp_path, text))
    assert city.building_id == ["part_1"] * 6 + ["part_2"] * 6 + ["part_1"] * 6


def test_a_band_without_an_outside_is_left_alone_and_named():
    angle = np.linspace(0, np.pi, 13)[:-1]
    places = [(np.cos(2 * a), np.sin(2 * a), np.cos(a), np.sin(a)) for a in angle]
    ends = [[((3 + s * c) * x, (3 + s * c) * y, s * d) for s in (-1, 1)] for x, y, c, d in places]
    quads = [[ends[k][0], ends[k + 1][0], ends[k + 1][1], ends[k][1]] for k in range(11)]
    quads.append([ends[11][0], ends[0][1], ends[0][0], ends[11][1]])  # half a turn
    city = make_city([("a", "", [quad]) for quad in quads])
    found = orient_shells(city.points, city.ring_start, city.polygon_start, np.zeros(12, np.int64))
    assert not found.flip.any()
    assert found.doubtful.all()


REFUSED = {
    "no faces": (CUBE, "contains no polygons"),
    "index": (CUBE + "\nf 1 2 9", "line 9: polygon refers to vertex 9, the file has 8"),
    "zero": (CUBE + "\nf 0 1 2", "line 9: polygon with a vertex index before the first vertex"),
    "words": (
        CUBE + "\nf one two three",
        "line 9: polygon with vertex indices that are not integers",
    ),
    "huge": (CUBE + "\nv 0 1e308 0\nf 1 2 3", "line 9: vertex without three numbers"),
    "two numbers": (CUBE + "\nv 0 1\nf 1 2 3", "line 9: vertex without three numbers"),
    "long line": ("f " + "1 " * 600_000, "line 1: longer than"),
    "endless line": ("f 1 \\\n" * 400_000, r"line \d+: longer than"),
    "only points": (CUBE + "\nf 1 2\nf 3", "no building has a usable shape"),
    "binary": ("".join(map(chr, range(256))), "line 1: this is not text"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_line_and_cure(tmp_path, name):
    text, problem = REFUSED[name]
    path = write(tmp_path, text)
    assert_refused(path, problem)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings_and_gzip(tmp_path, encoding):
    text = "o Straße\n" + CUBE + "\n" + "\n".join(FACES)
    with gzip.open(tmp_path / "city.obj.gz", "wb") as packed:
        packed.write(text.encode(encoding))
    city = read_city(tmp_path / "city.obj.gz")
    assert len(city) == 6
    assert city.building_id[0].startswith("Stra")


def house_statements(west, first, base=0.0):
    """A box of 10 m x 8 m x 6 m with corners of its own, as `v` and `f` lines; `first` corners
    stand before it.
    """
    corners = [
        (west + x, y, base + z) for z in (0, 6) for x, y in ((0, 0), (10, 0), (10, 8), (0, 8))
    ]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    return lines + ["f " + " ".join(str(first + k + 1) for k in face) for face in faces]


def sheet_statements(first, *corners):
    return ["v {} {} {}".format(*corner) for corner in corners] + [
        f"f {first + 1} {first + 2} {first + 3} {first + 4}"
    ]


SLOPE = [(-50, -50, -2), (100, -50, -2), (100, 60, 0), (-50, 60, 0)]
LEVEL = [(-50, -50, 0), (100, -50, 0), (100, 60, 0), (-50, 60, 0)]
HALVES = [
    [(-50, -50, 0), (25, -50, 0), (25, 60, 0), (-50, 60, 0)],
    [(25, -50, 0), (100, -50, 0), (100, 60, 0), (25, 60, 0)],
]
UNDER_ONE_NAME = {  # what an object holds beside three houses -> sheets of ground
    "nothing": [],
    "ground": [LEVEL],
    "ground on a slope": [SLOPE],
    "ground in two": HALVES,
}


@pytest.mark.parametrize("statement", ["o City", "g City"])
@pytest.mark.parametrize("name", UNDER_ONE_NAME)
def test_houses_under_one_name_are_buildings_and_their_ground_is_none(tmp_path, name, statement):
    lines, sheets = [statement], UNDER_ONE_NAME[name]
    for k in range(3):
        lines += house_statements(20 * k, 8 * k, base=5.0 * (k == 1 and not sheets))
    for k, sheet in enumerate(sheets):
        lines += sheet_statements(24 + 4 * k, *sheet)
    (tmp_path / "city.obj").write_text("\n".join(lines))
    scene = build_scene(read_city(tmp_path / "city.obj"), latitude=50, longitude=8, patch_size=None)
    surfaces, ground = scene.surfaces, scene.surfaces.kind == "ground"
    assert scene.report.building_count == 3
    assert len(set(np.array(surfaces.building_id)[~ground])) == 3
    assert surfaces.area[~ground].sum() == pytest.approx(3 * (160 + 216))
    assert ground.sum() == len(sheets) and not surfaces.eligible[ground].any()
    assert surfaces.area[surfaces.eligible].sum() == pytest.approx(3 * (80 + 216))


def test_one_house_under_one_name_keeps_it(tmp_path):
    (tmp_path / "city.obj").write_text("\n".join(["o Lone", *house_statements(0, 0)]))
    city = read_city(tmp_path / "city.obj")
    assert set(city.building_id) == {"Lone"} and not city.report.notes
