"""Cures that name an option with a value: taken out of what was said of a city, run, and right."""

import re

import pytest
from citygml_text import building, model, solid
from sheds import CLOSED, stand, write_shed
from test_levels import box, faces

from citypv.__main__ import main
from citypv.core.settings.request import Request
from citypv.core.study import read_buildings

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
        assert main(["inspect", str(path), "--unit", value]) == 0
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
