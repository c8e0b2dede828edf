"""Ground in one mesh with the houses on it, with corners in common: it carries no modules; roofs,
decks and yards of podiums do."""

import numpy as np
import pytest

from citypv.core.city.build_scene import build_scene
from citypv.core.read.read_city import read_city

CELL = 10.0  # [m]
TOWN = [
    "............",
    ".8..........",
    "....6.......",
    "..........9.",
    "............",
    "............",
]
YARD = [
    "............",
    "..44444.....",
    "..4...4.....",
    "..4...4..9..",
    "..44444.....",
    "............",
]
PODIUM = ["44444", "49944", "49944", "44444", "44444"]


def read_blocks(tmp_path, rows, *, name=lambda x: "", slope=0.0):
    """A scene of blocks on cells, heights in m by digit, walls where a neighbour is the ground or
    lower, all corners shared; `name` gives the object of a face at an easting."""
    heights = np.array([[0.0 if sign == "." else float(sign) for sign in row] for row in rows])
    faces = {}
    for (row, column), height in np.ndenumerate(heights):
        x, y = CELL * column, -CELL * row
        corners = [(x, y), (x + CELL, y), (x + CELL, y + CELL), (x, y + CELL)]
        drawn = [[(*place, slope * place[0] + height) for place in corners]]
        for side, (up, right) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
            there = row + up, column + right
            inside = 0 <= there[0] < heights.shape[0] and 0 <= there[1] < heights.shape[1]
            low = heights[there] if inside else 0.0
            if low < height:
                a, b = corners[side], corners[(side + 1) % 4]
                ends = (*a, slope * a[0] + low), (*b, slope * b[0] + low)
                drawn.append([*ends, *((*end, slope * end[0] + height) for end in (b, a))])
        faces.setdefault(name(x), []).extend(drawn)
    lines, count = [], 0
    for called, drawn in faces.items():
        lines += [f"o {called}"] if called else []
        for face in drawn:
            lines += ["v {:.3f} {:.3f} {:.3f}".format(*corner) for corner in face]
            lines.append("f " + " ".join(str(count + k + 1) for k in range(len(face))))
            count += len(face)
    (tmp_path / "joined.obj").write_text("\n".join(lines))
    return build_scene(
        read_city(tmp_path / "joined.obj"), latitude=50, longitude=8, patch_size=None
    )


def areas_of(scene):
    """Area of each kind [m²]."""
    return {
        kind: scene.surfaces.area[scene.surfaces.kind == kind].sum()
        for kind in ("ground", "flat", "facade")
    }


@pytest.mark.parametrize(
    "tiles", [lambda x: "", lambda x: f"tile{int(x >= 60)}"], ids=["one mesh", "two tiles"]
)
def test_ground_welded_to_houses_is_no_roof(tmp_path, tiles):
    scene = read_blocks(tmp_path, TOWN, name=tiles)
    # Three houses of 100 m² on 72 cells, each with four walls.
    assert areas_of(scene) == pytest.approx(
        {"ground": 6900, "flat": 300, "facade": 4 * 10 * (8 + 6 + 9)}
    )
    assert scene.surfaces.area[scene.surfaces.eligible].sum() == pytest.approx(300 + 920)


def test_ground_on_a_slope_is_found_too(tmp_path):
    areas = areas_of(read_blocks(tmp_path, TOWN, slope=0.1))
    assert areas["ground"] == pytest.approx(6900 * np.hypot(1, 0.1))
    assert areas["facade"] == pytest.approx(920)


def test_a_yard_is_ground_and_wide_low_roofs_around_it_are_not(tmp_path):
    scene = read_blocks(tmp_path, YARD)
    # 14 cells of roof at 4 m around a yard of 6, walls of 5 × 4 cells outside and 3 × 2 inside; a
    # tower of one cell.
    right = {"ground": 5700, "flat": 1500, "facade": 4 * 10 * (18 + 10) + 9 * 40}
    assert areas_of(scene) == pytest.approx(right)


def test_the_deck_of_a_podium_with_a_tower_is_a_roof(tmp_path):
    assert areas_of(read_blocks(tmp_path, PODIUM))["ground"] == 0
