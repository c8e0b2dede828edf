"""Cures that name an option with a value: taken out of what was said of a city, run, and right."""

import math
import re

import numpy as np
import pytest
from citygml_text import building, model, solid
from sheds import CLOSED, stand, write_shed
from test_levels import box, faces

from citypv.__main__ import main
from citypv.core.run.study import read_buildings
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

HOUSE = 10.0, 8.0, 9.0  # [m] width, depth and height: its walls have 324 m²
METRE = {"mm": 1000.0, "cm": 100.0, "in": 1 / 0.0254}  # how many of a unit it is


def write_houses(path, scale):
    """Four boxes side by side as OBJ, whose coordinates are metres times `scale`: path."""
    lines, count = [], 0
    width, depth, height = (scale * length for length in HOUSE)
    for number in range(4):
        west = 2 * number * width
        lines.append(f"o house_{number}")
        for corner in range(8):
            x, y, z = corner & 1, corner >> 1 & 1, corner >> 2
            lines.append(f"v {west + x * width:.3f} {y * depth:.3f} {z * height:.3f}")
        for face in ("1342", "5687", "1265", "2486", "4378", "3157"):
            lines.append("f " + " ".join(str(count + int(one)) for one in face))
        count += 8
    path.write_text("\n".join(lines) + "\n")
    return path


def walls_of(city):
    """Area of all upright faces of boxes, in the unit that was taken for a metre."""
    west, south, bottom = city.points.min(axis=0)
    east, north, top = city.points.max(axis=0)
    return 4 * 2 * ((east - west) / 7 + north - south) * (top - bottom)


def cures_of(notes, option):
    """Values that notes name for an option, in their order."""
    return [value for note in notes for value in re.findall(rf"{option} ([\w.-]*\w)", note)]


@pytest.mark.parametrize("unit", METRE)
def test_a_unit_that_is_named_gives_the_city_its_size(tmp_path, capsys, unit):
    """Millimetres are taken by themselves; of centimetres and inches both are named, as either may
    be meant.
    """
    path = write_houses(tmp_path / "houses.obj", METRE[unit])
    city = read_buildings([path], Request())
    named = cures_of(city.report.notes, "--unit")
    assert named == (["m"] if unit == "mm" else ["in", "cm"])
    for value in named:
        # Without ground, whose patches below houses of kilometres would take ten seconds.
        assert main(["inspect", str(path), "--unit", value, "--ground", "none"]) == 0
        assert f"Coordinates converted from {value}" in capsys.readouterr().out or value == "m"
        size = METRE[unit] / METRE.get(value, 1.0)
        asked = read_buildings([path], Request(unit=value))
        assert walls_of(asked) == pytest.approx(4 * 324 * size**2, rel=1e-4)
        assert value != "m" or not cures_of(asked.report.notes, "--unit")


def test_an_order_that_is_named_puts_the_shed_where_it_stands(tmp_path):
    """Poland's system has the north first: of a file with the east first, nothing tells it."""
    how = {"order": "other", "thematic": False, "envelope": CLOSED}
    path = write_shed(tmp_path / "shed.gml", "EPSG:2180", 52.2, 21.0, **how)
    city = read_buildings([path], Request())
    (named,) = cures_of(city.report.notes, "--axes")
    city, scene = stand(path, axes=named)
    assert (scene.site.latitude, scene.site.longitude) == pytest.approx((52.2, 21.0), abs=2e-4)
    assert sum(scene.surfaces.area) == pytest.approx(80 + 352, rel=2e-3)  # floor, and the rest
    assert not cures_of(city.report.notes, "--axes")


def write_solid(path, corners, faces):
    """Closed or open solids of the same faces, from a list of corners of each, as OBJ: path."""
    lines = []
    for number, points in enumerate(corners):
        first = 1 + number * len(points)
        lines += [f"o hall_{number}", *("v {:.4f} {:.4f} {:.4f}".format(*xyz) for xyz in points)]
        lines += ["f " + " ".join(str(first + corner) for corner in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def boxes(turn):
    """Corners of four boxes of the size of `HOUSE`, 20 m apart, turned by degrees: list."""
    width, depth, height = HOUSE
    cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    plan = [(0, 0), (width, 0), (width, depth), (0, depth)]
    rings = [
        [(x * cos - y * sin + 20 * number, x * sin + y * cos) for x, y in plan]
        for number in range(4)
    ]
    return [[(x, y, z) for z in (0, height) for x, y in ring] for ring in rings]


SIDES = {"floor": (3, 2, 1, 0), "roof": (4, 5, 6, 7), "south": (0, 1, 5, 4)}
SIDES |= {"east": (1, 2, 6, 5), "north": (2, 3, 7, 6), "west": (3, 0, 4, 7)}


def test_an_upward_axis_that_is_named_sets_the_houses_on_their_floors(tmp_path, capsys):
    """Halls without a north wall are taken to lie on their backs; of boxes turned by 30 degrees,
    whose y points up, nothing tells it. With the axis that is named, four floors of 80 m² are below
    and walls of 9 m above them.
    """
    open_north = [face for side, face in SIDES.items() if side != "north"]
    laid = [[(x, z, -y) for x, y, z in points] for points in boxes(30)]
    for name, corners, drawn, up, walls in (
        ("halls", boxes(0), open_north, "z", 4 * 9 * (10 + 2 * 8)),
        ("laid", laid, SIDES.values(), "y", 4 * 9 * 2 * (10 + 8)),
    ):
        path = write_solid(tmp_path / f"{name}.obj", corners, drawn)
        assert np.ptp(read_buildings([path], Request()).points[:, 2]) != pytest.approx(9, abs=0.1)
        assert main(["inspect", str(path)]) == 0
        assert cures_of([capsys.readouterr().out], "--up") == [up]
        assert main(["inspect", str(path), "--up", up]) == 0
        assert "--up" not in capsys.readouterr().out
        city, scene = stand(path, up=up)
        assert np.ptp(city.points[:, 2]) == pytest.approx(9.0)
        areas = {
            kind: scene.surfaces.area[scene.surfaces.kind == kind].sum()
            for kind in ("flat", "facade", "downward", "roof", "steep")
        }
        expected = {"flat": 320.0, "facade": walls, "downward": 320.0, "roof": 0.0, "steep": 0.0}
        assert areas == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_a_place_that_is_asked_for_is_enough(tmp_path, capsys):
    path = write_houses(tmp_path / "houses.obj", 1.0)
    out = ["--preset", "draft", "--suns", "days:1", "--out", str(tmp_path / "out")]
    run = ["simulate", str(path), *out]
    assert main(run) == 2
    words = capsys.readouterr().err
    asked = re.search(r"give its location with (--latitude) D (--longitude) D", words)
    assert main([*run, asked[1], "48"]) == 2
    words = capsys.readouterr().err
    both = re.search(r"give both (--latitude) D (--longitude) D", words)
    assert main([*run, both[1], "48", both[2], "-120.5"]) == 0
    assert "latitude 48.0000°, longitude -120.5000°" in capsys.readouterr().err.replace("−", "-")


def test_a_level_of_detail_that_is_named_is_read(tmp_path, capsys):
    path = tmp_path / "city.gml"
    path.write_text(model(building(solid(faces(*box(0, 0, 0, 10, 8, 9)), lod=1))))
    assert main(["inspect", str(path), "--lod", "3"]) == 2
    words = capsys.readouterr().err
    level = re.search(r"\(LoD met: ([\d.]+)\); choose one of these with --lod", words)[1]
    assert main(["inspect", str(path), "--lod", level]) == 0
    assert "surfaces     6," in capsys.readouterr().out
