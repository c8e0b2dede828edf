"""Which way polygons face: sheets that only look up, closed shells whose volume misleads, houses
inside out.
"""

from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from own_rays import BACK, SKY, OwnRays
from towns import SIDES, box

from citypv.core.city.build_scene import build_scene
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.run.study import read_buildings
from citypv.core.settings.request import Request

DATA = Path(__file__).parents[1] / "data"


def valley(width=100.0, length=100.0, slope=0.1):
    """Two sheets that look up and meet in a line along y at height 0."""
    top = slope * width / 2
    left = [
        (-width / 2, -length / 2, top),
        (0, -length / 2, 0),
        (0, length / 2, 0),
        (-width / 2, length / 2, top),
    ]
    return [np.array(left), np.array([(-x, y, z) for x, y, z in left[::-1]])]


def bowl(radius=30.0, depth=15.0, rings=6, sectors=16):
    """A round sheet that looks up, lowest in the middle, of quadrilaterals and triangles."""
    angle = 2 * np.pi * np.arange(sectors + 1) / sectors
    share = np.linspace(0, 1, rings + 1)
    place = [
        [(r * radius * np.cos(a), r * radius * np.sin(a), depth * r**2) for a in angle[:-1]]
        for r in share
    ]
    place = np.array([[*ring, ring[0]] for ring in place])
    faces = []
    for ring in range(rings):
        for k in range(sectors):
            inner, outer = place[ring, k : k + 2], place[ring + 1, k : k + 2]
            faces.append(np.array([inner[0], outer[0], outer[1], inner[1]][int(ring == 0) :]))
    return faces


def out_of(distance):
    """How far the corners of a rectangle move outwards."""
    return distance * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def parapet(side=20.0, wall=0.3, height=1.0, tray=-0.5):
    """A closed shell: walls around a roof that lies `tray` above the underside of the
    shell, at 0.
    """
    outer = np.array([(0, 0), (side, 0), (side, side), (0, side)])
    places = (
        (outer, 0.0),
        (outer, height),
        (outer + out_of(-wall), height),
        (outer + out_of(-wall), tray),
    )
    rings = [np.column_stack([corners, np.full(4, z)]) for corners, z in places]
    bands = [
        np.array([a[k - 1], a[k], b[k], b[k - 1]]) for k in range(4) for a, b in pairwise(rings)
    ]
    return [rings[0][::-1], rings[-1], *bands]


def write_obj(path, objects, shift=(0.0, 0.0, 0.0)):
    """OBJ file of {name: list of (k, 3) arrays}."""
    lines, count = [], 0
    for name, faces in objects.items():
        lines.append(f"o {name}")
        for face in faces:
            lines += [
                "v " + " ".join(f"{value:.6f}" for value in np.add(corner, shift))
                for corner in face
            ]
            lines.append("f " + " ".join(str(count + k + 1) for k in range(len(face))))
            count += len(face)
    path.write_text("\n".join(lines) + "\n")
    return path


def turned(city):
    """Numbers of the polygons that were turned over."""
    names = [
        name for reason, ids in city.report.repaired.items() if "flipped" in reason for name in ids
    ]
    return sorted(city.surface_id.index(name) for name in names)


def read(folder, faces, **details):
    """City of one object beside a house, so that there are always two."""
    house = box((500, 500, 0), (510, 510, 10))
    path = write_obj(folder / "city.obj", {"it": faces, "house": house}, **details)
    return read_city([path])


SHEETS = {
    "valley with sides of 10 %": valley(),
    "valley with sides of 100 %": valley(slope=1.0),
    "bowl 60 m wide": bowl(),
    "deep bowl": bowl(depth=60.0),
    "pit as deep as wide": box((0, 0, -10), (10, 10, 0), without=["top"], inwards=SIDES),
    "shaft": box((0, 0, -60), (10, 10, 0), without=["top"], inwards=SIDES),
}
OUTER = np.array([(0, 0, 15), (30, 0, 15), (30, 30, 15), (0, 30, 15)], float)
INNER = OUTER / [3, 3, 1] + [10, 10, 0]
LOGGIA = box((0, 0, 0), (30, 30, 15)) + box(
    (10, 0.01, 5), (20, 3, 8), without=["south"], inwards=SIDES
)
DRAWN = {  # faces, and which of them are drawn the wrong way
    **{name: (faces, []) for name, faces in SHEETS.items()},
    "valley of which one side is drawn downwards": (
        [valley()[0], valley()[1][::-1], *(np.add(face, (0, 100, 0)) for face in valley())],
        [1],
    ),
    "bowl of which one face is drawn downwards": (
        [face[::-1] if k == 1 else face for k, face in enumerate(bowl())],
        [1],
    ),
    "parapet inside out": ([face[::-1] for face in parapet(tray=0.2)], list(range(len(parapet())))),
    # A house around an open court: the walls of the court in the same object, and a floor.
    "courtyard": (
        box((0, 0, 0), (30, 30, 15), without=["top"])
        + box((10, 10, 0.5), (20, 20, 15), without=["top"], inwards=SIDES)
        + [np.array([OUTER[k - 1], OUTER[k], INNER[k], INNER[k - 1]]) for k in range(4)],
        [],
    ),
    "atrium": (box((0, 0, 0), (30, 30, 15)) + box((10, 10, 1), (20, 20, 14), inwards=SIDES), []),
    "separate loggia": (LOGGIA, []),
    "house inside out beside a right one": (
        box((0, 0, 0), (30, 30, 15), inwards=SIDES) + box((60, 0, 0), (70, 10, 8)),
        list(range(6)),
    ),
}


@pytest.mark.parametrize("name", DRAWN)
def test_what_is_drawn_the_wrong_way_is_turned_and_nothing_else(tmp_path, name):
    """Sheets that only look up, rooms drawn inwards on purpose, shells."""
    faces, wrong = DRAWN[name]
    if name in SHEETS:
        starts = np.cumsum([0, *map(len, faces)])
        assert (
            measure_polygons(np.concatenate(faces), starts, np.arange(len(faces) + 1))[1][
                :, 2
            ].min()
            > -1e-9
        )
    assert turned(read(tmp_path, faces)) == wrong


@pytest.mark.parametrize(
    ("side", "tray"), [(8.0, -0.01), (8.0, -2.0), (20.0, -0.8), (100.0, -0.01), (100.0, -2.0)]
)
def test_a_closed_parapet_shell_whose_tray_lies_below_its_underside_stays(tmp_path, side, tray):
    faces = parapet(side, tray=tray)
    points, starts = np.concatenate(faces), np.cumsum([0, *map(len, faces)])
    area, normal = measure_polygons(points, starts, np.arange(len(faces) + 1))
    volume = sum(a * n @ face[0] for a, n, face in zip(area, normal, faces, strict=True)) / 3
    assert volume == pytest.approx(
        side**2 - (side - 0.6) ** 2 * (1 - tray)
    )  # of what is drawn right, and negative
    assert volume < 0 or tray > -0.5
    assert turned(read(tmp_path, faces)) == []


HOUSES = {
    "tower": (10, 12, 40),
    "house": (10, 12, 8),
    "hall": (60, 100, 8),
    "pavilion": (20, 20, 3),
}
WRONG = {
    "all": SIDES,
    "walls": SIDES[2:],
    "half": ["top", "south", "west"],
    "roof": ["top"],
    "one wall": ["east"],
}


@pytest.mark.parametrize(("size", "wrong"), list(product(HOUSES, WRONG))[::2])
def test_houses_drawn_inside_out_are_turned(tmp_path, size, wrong):
    """Closed, without a floor or without a wall."""
    for missing in ([], ["bottom"], ["south"]):
        faces = box((0, 0, 0), HOUSES[size], without=missing, inwards=WRONG[wrong])
        kept = [side for side in SIDES if side not in missing]
        assert turned(read(tmp_path, faces)) == [
            k for k, side in enumerate(kept) if side in WRONG[wrong]
        ]


@pytest.mark.parametrize("wrong", [[], *WRONG.values()])
def test_a_row_of_houses_in_one_object_is_turned_house_by_house(tmp_path, wrong):
    faces = (
        box((0, 0, 0), (10, 10, 9))
        + box((10, 0, 0), (20, 10, 12), inwards=wrong)
        + box((20, 0, 0), (30, 10, 6))
    )
    assert turned(read(tmp_path, faces)) == [
        6 + SIDES.index(side) for side in SIDES if side in wrong
    ]


def test_what_is_turned_does_not_depend_on_the_place(tmp_path):
    """UTM, Gauss-Krüger, and ten thousand kilometres out."""
    faces = box((0, 0, 0), HOUSES["house"], without=["south"], inwards=WRONG["half"]) + LOGGIA
    expected = turned(read(tmp_path, faces))
    assert expected
    for shift in (
        (389_123.25, 5_819_456.5, 34.0),
        (3_500_000.125, 5_500_000.0, 800.0),
        (-1e7, 1e7, 3000.0),
    ):
        assert turned(read(tmp_path, faces, shift=shift)) == expected


def test_as_drawn_leaves_all_as_drawn(tmp_path):
    path = write_obj(
        tmp_path / "city.obj", {"a": box((0, 0, 0), (9, 9, 9), inwards=SIDES), "b": valley()}
    )
    city = read_buildings([path], Request(orient="as-drawn"))
    assert turned(city) == []
    _, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    assert normal[SIDES.index("top"), 2] == -1
    assert turned(read_city([path])) == list(range(6))


@pytest.mark.slow
def test_no_ray_is_cast_where_nothing_is_in_doubt(tmp_path, monkeypatch):
    def refuse(*_):
        raise AssertionError("a ray was cast")

    monkeypatch.setattr("citypv.core.city.judge_turning._trace_both_sides", refuse)
    read_city([DATA / "citygml" / "berlin_opendata_part_v1.gml.gz"])
    read_city(
        [
            write_obj(
                tmp_path / "city.obj",
                {"a": valley(), "b": box((0, 0, 20), (9, 9, 29)), "c": bowl()},
            )
        ]
    )
    with pytest.raises(AssertionError, match="a ray was cast"):
        read(tmp_path, box((0, 0, 0), (9, 9, 9), inwards=["top"]))


@pytest.mark.thorough
def test_no_lit_face_of_manhattan_is_turned_to_the_dark():
    """By the rays of another caster; by the volumes of shells alone 51 triangles, 1,180 m², would
    be.
    """
    name = DATA / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
    drawn, rows = read_city([name], orient="as-drawn"), np.array(turned(read_city([name])))
    scene = build_scene(drawn, 40.757, -73.97, ground="none", patch_size=None)
    assert (scene.triangle_surface == np.arange(len(drawn))).all()  # a polygon is a triangle
    own = OwnRays(scene, np.full(len(drawn), 2e-3))
    front = own.shares(rows, 32, 32, np.random.default_rng(3)).mean(axis=1)
    own.normal = -own.normal
    back = own.shares(rows, 32, 32, np.random.default_rng(4)).mean(axis=1)
    gain = back[:, SKY] - front[:, SKY]
    assert gain.min() >= -0.02
    assert (gain > 0.02).sum() > 60 and scene.surfaces.area[rows[gain > 0.02]].sum() > 900
    # Seen from the back as drawn, what is turned is no inside: there it sees the sky or what others
    # see.
    assert not ((front[:, SKY] > 0.125) & (front[:, BACK] < 0.5)).any()
