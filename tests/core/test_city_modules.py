"""The modules of a city: windows that files draw or do not, gables, party walls, cells, racks, and
what is covered, each counted by hand.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from cities import box, make_city
from scenes import run_gather, suns_towards
from small_city import FAST, house, write_gml
from test_paying import numbers, weigh

from citypv.core.city.grid_cells import Outlines, split_into_cells
from citypv.core.commands.command_line import main
from citypv.core.energy.counted_area import find_counted_area, note_other_layout
from citypv.core.energy.pv_system import build_system, pick_module
from citypv.core.modules.lay_city import FacadeRow, LayoutRules, lay_city
from citypv.core.modules.read_facades import check_facades, read_facades
from citypv.core.read.read_city import read_city
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.run.study import make_located_scene
from citypv.core.run.write_run import note_windows
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

CITYGML = Path(__file__).parent.parent / "data" / "citygml"
RULES = LayoutRules((1.6, 1.0))
PLACE = {"latitude": 52.0, "longitude": 13.0, "weather": ["clear-sky"]}


def lay(polygons, rules=RULES, hidden=0.0, grid_size=None):
    """Modules of each surface of a city, and their layout."""
    city = make_city(polygons)
    scene = make_located_scene(city, Request(grid_size=grid_size, ground="none", **PLACE))
    cells = split_into_cells(city, grid_size)[0] if grid_size else city
    outlines = Outlines.of(cells, scene.surfaces, scene.site)
    share = np.full(len(scene.surfaces), hidden)
    layout, count = lay_city(scene.surfaces, outlines, scene.surfaces.eligible, rules, hidden=share)
    assert count.sum() == pytest.approx(len(layout))
    return count, layout, scene.surfaces


def wall(width, height, *, holes=(), thematic="WallSurface", foot=0.0):
    """A wall that faces south, with holes (x0, z0, x1, z1)."""
    rings = [[(0, 0, foot), (width, 0, foot), (width, 0, height), (0, 0, height)]]
    rings += [[(x0, 0, z0), (x0, 0, z1), (x1, 0, z1), (x1, 0, z0)] for x0, z0, x1, z1 in holes]
    return "a", thematic, rings


def window(x0, z0, x1, z1):
    """A window 0.1 m behind that wall."""
    return "a", "Window", [[(x0, 0.1, z0), (x1, 0.1, z0), (x1, 0.1, z1), (x0, 0.1, z1)]]


# Of 10 m width a wall holds within 9.8 m 9 modules upright (of 1.02 m in 9.82 m), 6 lying (of
# 1.62 m). Upright modules of 1.6 m fit exactly between windows of 1.4 m in storeys of 3 m.
WINDOWS = [(1.5, 0.9, 2.7, 2.3), (6.3, 0.9, 7.5, 2.3)]
BY_HAND = {
    # Three storeys of which the lowest carries none: two rows.
    "three storeys": ([wall(10, 9)], {}, 18),
    # The fourth storey is cut off below its windows.
    "a storey begun": ([wall(10, 10.7)], {}, 27),
    # 1.0 m of windows leave 2.0 m for one upright row each; 1.8 m leave 1.2 m for a lying one.
    "small windows": ([wall(10, 9)], {"window_band": 1.0}, 18),
    "large windows": ([wall(10, 9)], {"window_band": 1.8}, 12),
    # No windows: the whole wall, lying 6 × 8 (of 1.02 m in 8.82 m), upright 9 × 5.
    "without windows": ([wall(10, 9)], {"window_band": 0.0}, 48),
    # Storeys of 4 m: two, and one that is begun; free from 4 to 6.6 m: two lying rows of 6 (2.02 m)
    # or one upright of 9; and 0.9 m above 8 m, which hold none.
    "high storeys": ([wall(10, 9)], {"storey": 4.0}, 12),
    # The lowest storey: 1.5 m above the edge, one lying row of 6; upright rows stay at 18.
    "ground floor": ([wall(10, 6)], {"ground_floor": True}, 12),
    # Below one storey there are no windows: two lying rows of 6.
    "a low wall": ([wall(10, 2.5)], {}, 12),
    # Its foot stands 3 m above its building's lowest point, on the second storey: 1.5 m above the
    # edge, one lying row of 6; the third: another. Upright rows fit into the third alone.
    "above others": (
        [wall(10, 9, foot=3.0), ("a", "", [[(0, 9, 0), (9, 9, 0), (0, 8, 0)]])],
        {},
        12,
    ),
    # 9 × 3 m, two windows 0.1 m away: upright 1 + 3 + 1 in one row, lying 2 in two rows.
    "drawn windows": ([wall(9, 3, holes=WINDOWS), wall(0.5, 0.5, thematic="Window")], {}, 5),
    # The same windows, not cut out of the wall, and 0.1 m behind it.
    "windows behind a whole wall": (
        [wall(9, 3), *[window(*bounds) for bounds in WINDOWS]],
        {},
        5,
    ),
    # Eaves at 6 m, ridge at 10 m: one row of 7 in the second storey (7.82 m), none in the windows
    # up to 6 m; above, blind, 4.52 and 1.28 m are left at the tops of two rows: 4 + 1.
    "a gable": (
        [("a", "WallSurface", [[(0, 0, 0), (8, 0, 0), (8, 0, 6), (4, 0, 10), (0, 0, 6)]])],
        {},
        12,
    ),
}


@pytest.mark.parametrize("name", BY_HAND)
def test_facades_by_hand(name):
    polygons, rules, expected = BY_HAND[name]
    count, layout, _ = lay(polygons, replace(RULES, **rules))
    assert count.tolist() == [expected, *[0] * (len(polygons) - 1)]
    assert (layout.surface == 0).all()


def test_party_walls_have_no_windows():
    assert [lay([wall(10, 9)], hidden=share)[0][0] for share in (0.1, 0.11)] == [18, 48]


def test_modules_lie_in_the_walls_they_are_on_and_know_their_storey():
    count, layout, surfaces = lay(box("a", 5, 7, 10, 10, 0, 9))
    walls = np.flatnonzero(surfaces.kind == "facade")
    assert count[walls].tolist() == [18] * 4
    # Roof of 10 × 10 m, 0.5 m from its edges: 9 m hold 8 upright (of 1.02 m), and with paths two
    # rows, 0.6 m, and two rows: 7.04 m; or 5 lying (of 1.62 m), in three pairs with two paths: 7.26 m,
    # and a seventh row behind a path ends at 8.86 m.
    assert count[surfaces.kind == "flat"].tolist() == [35]
    for row in walls:
        own = layout.take(layout.surface == row)
        normal = surfaces.normal[row]
        np.testing.assert_allclose(own.along @ normal, 0, atol=1e-9)
        assert (np.cross(own.along, own.up) @ normal > 0).all()  # seen from outside
        np.testing.assert_allclose(np.unique(own.corner[:, 2]), [3, 6], atol=1e-5)
        assert own.row.tolist() == [1] * 9 + [2] * 9
        steps = np.einsum("ij,ij->i", np.diff(own.corner, axis=0), own.along[:-1])
        assert (steps[own.row[1:] == own.row[:-1]] > 1).all()  # from left to right


def test_cells_of_a_grid_share_their_polygon_by_area():
    whole, _, _ = lay([wall(10, 9)])
    count, layout, surfaces = lay([wall(10, 9)], grid_size=4.0)
    assert len(surfaces) == 9 and count.sum() == pytest.approx(whole[0])
    np.testing.assert_allclose(count, 18 * surfaces.area / 90, rtol=1e-6)
    middle = layout.corner + 0.5 * (layout.along + layout.up)
    columns = [int(name.split("#")[1]) for name in np.array(surfaces.surface_id)[layout.surface]]
    low = middle[:, 0] - middle[:, 0].min()
    assert np.corrcoef(columns, low + 10 * (middle[:, 2] > 4))[0, 1] > 0.5


def test_roofs_by_hand():
    """Half of a hip roof: a trapezoid of 12 to 4 m, 4 m up its slope, and a triangle of 12 m, 8 m
    up its slope; 0.3 m from their edges.
    """
    up = np.array([0, np.cos(np.radians(30)), np.sin(np.radians(30))])
    shapes = {
        # 45° sides are 0.3·√2 m further in. Upright rows end 1.6 and 3.22 m above the eaves'
        # distance: 7.35 and 4.11 m hold 7 + 4; lying ones 8.55, 6.51 and 4.47 m: 5 + 4 + 2.
        11: [(0, 0), (12, 0), (8, 4), (4, 4)],
        # Within: a triangle of 10.8 m and 7.2 m, upright 8 + 5 + 3 + 1, lying 5 + 4 + 3 + 2 + 1 + 1.
        17: [(0, 0), (12, 0), (6, 8)],
        # An L of 10.6 × 10.6 m with 5.6 m in each arm, within 10 and 5 m: lying rows hold 6 and 3:
        # four below 5 m, five above: 24 + 15; upright 9 and 4: three below, three above: 27 + 12.
        39: [(0, 0), (10.6, 0), (10.6, 5.6), (5.6, 5.6), (5.6, 10.6), (0, 10.6)],
    }
    for expected, corners in shapes.items():
        ring = [x * np.array([1.0, 0, 0]) + y * up for x, y in corners]
        count, layout, _ = lay([("a", "RoofSurface", [ring])])
        assert count.tolist() == [expected]
        plane = shapely.Polygon(corners)
        low = np.column_stack([layout.corner[:, 0], layout.corner @ up])
        low -= low.min(axis=0) - shapely.bounds(plane.buffer(-0.3, join_style="mitre"))[:2]
        assert len(np.unique(layout.row)) == len(np.unique(np.round(low[:, 1], 4)))


@pytest.mark.slow
def test_what_is_covered_carries_none_and_comes_back_from_its_file(tmp_path):
    """A wall of 20 × 15 m beside a neighbour that covers 9 m of it: it has no windows, and its other
    11 m hold 10 upright modules of 1.02 m in each of 9 rows (14.82 m).
    """
    city = make_city(box("a", 0, 0, 20, 10, 0, 15) + box("b", 11, -8, 15, 8, 0, 15))
    scene = make_located_scene(city, Request(patch_size=2.5, **PLACE))
    suns = suns_towards([[0.2, -0.5, 1]])
    transfer = run_gather(scene, suns, samples=64, shadow_samples=4, patch_size=2.5, max_bounces=0)
    (row,) = np.flatnonzero(
        (np.array(scene.surfaces.building_id) == "a") & (scene.surfaces.normal[:, 1] < -0.9)
    )
    assert transfer.taken_at(0.3)[row].area == pytest.approx(135, rel=0.02)
    outlines = Outlines.of(city, scene.surfaces, scene.site)
    transfer = replace(transfer, outlines=outlines)
    write_transfer(tmp_path / "transfer.nc", transfer)
    again = read_transfer(tmp_path / "transfer.nc")
    system = build_system(Request(module_size="1,1.6"))
    for one in (transfer, again):
        counted = find_counted_area(one, system)
        own = counted.layout.take(counted.layout.surface == row)
        assert counted.module_count[row] == len(own) == 90
        assert (own.corner + own.along)[:, 0].max() < outlines.rings(row)[0][:, 0].min() + 11.3
    assert counted.kwp[row] == pytest.approx(90 * 0.3003, rel=1e-4)
    # Tiles and edits take rows of it.
    some = again.take(np.array([row, 0]))
    assert shapely.equals(some.taken_at(0.3)[0], again.taken_at(0.3)[row])
    # Without shapes all open area carries modules; so it does where it is asked for.
    by_area = [
        find_counted_area(replace(again, taken_parts=None), system),
        find_counted_area(again, build_system(Request(layout="area"))),
    ]
    notes = [
        note_other_layout(replace(again, taken_parts=None), Request(layout=name))
        for name in ("rows", "area")
    ]
    assert "counted by area" in notes[0] and not notes[1] + note_other_layout(again, Request())
    for one in by_area:
        assert one.layout is None and one.module_area[row] == pytest.approx(165, rel=0.02)


def test_parts_with_holes_and_apart_come_back():
    from citypv.core.results.taken_rings import parts_of_rings, rings_of_parts

    ring = shapely.box(0, 0, 10, 10) - shapely.box(2, 2, 8, 8)
    apart = shapely.union(shapely.box(0, 0, 1, 1), shapely.box(3, 0, 4, 1))
    parts = np.array([[None, ring], [apart, ring | shapely.box(20, 0, 21, 1)], [None, None]])
    again = parts_of_rings(rings_of_parts(parts), 2)
    assert again.shape == parts.shape
    for one, other in zip(parts.flat, again.flat, strict=True):
        assert (one is None) == (other is None)
        assert one is None or shapely.equals(one, other)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("SunPower_SPR_300E_WHT_D", (1.559, 1.046)),  # the CEC's own
        ("SunPower_SPR_300_WHT__2007__E__", (1.5642, 1.0428)),  # 96 cells, 1.631 m² at 1.5 : 1
        ("Canadian_Solar_CS5P_220M___2009_", (1.5973, 1.0649)),  # 96 cells, 1.701 m²
        ("Kyocera_Solar_KD205GX_LP__2008__E__", (1.5653, 0.9487)),  # 54 cells, 1.485 m² at 1.65 : 1
    ],
)
def test_modules_are_as_large_as_their_product(name, size):
    assert pick_module(name).size == pytest.approx(size, abs=2e-4)


@pytest.mark.parametrize("text", ["1.7", "1.7,x", "1.7,0", "1,2,3", "30,1"])
def test_sizes_that_are_none_are_refused(text):
    with pytest.raises(InputError, match="--module-size"):
        build_system(Request(module_size=text))


def test_a_file_of_facades(tmp_path):
    path = tmp_path / "facades.csv"
    path.write_text("surface,storey,window_band,usable\nfacade,3.5,,0.5\ns3,,0,\n")
    rows = read_facades(path)
    assert rows == {"facade": FacadeRow(3.5, None, 0.5), "s3": FacadeRow(None, 0.0, None)}
    _, _, surfaces = lay(box("a", 0, 0, 10, 10, 0, 9))
    rules = replace(RULES, facades=rows)
    assert rules.of_surfaces(surfaces, "storey", 3.0)[1:5].tolist() == [3.5] * 4
    assert rules.of_surfaces(surfaces, "window_band", 1.4).tolist() == [1.4] * 3 + [0] + [1.4] * 2
    usable = build_system(Request(facades=str(path), usable={"flat": 0.8})).share_usable(surfaces)
    assert usable.tolist() == [1, 0.5, 0.5, 0.5, 0.5, 0.8]
    check_facades(surfaces, path)
    path.write_text("surface,usable\ns9,1\n")
    with pytest.raises(InputError, match="'s9' is neither a surface nor a kind"):
        check_facades(surfaces, path)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("id,usable\ns1,1\n", "line 1 is not a header"),
        ("surface\ns1\n", "line 1 is not a header"),
        ("surface,usable\ns1,1.2\n", "line 2: usable '1.2'"),
        ("surface,storey\ns1,nan\n", "line 2: storey 'nan'"),
        ("surface,usable\ns1,1\ns1,1\n", "line 3 names 's1' again"),
        ("surface,usable\ns1\n", "line 2 has 1 cells, the header 2"),
    ],
)
def test_files_of_facades_that_are_none(tmp_path, text, problem):
    path = tmp_path / "facades.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_facades(path)


@pytest.fixture(scope="module")
def both_layouts(tmp_path_factory):
    """A house of 12 × 10 × 9 m, weighed with modules in rows and on every square metre: its folder,
    and of both the rows of faces.csv and the summary.
    """
    folder = tmp_path_factory.mktemp("house")
    city, out = write_gml(folder / "city.gml", house("a", (0, 0), (12, 10, 9))), folder / "traced"
    assert main(["simulate", str(city), "--out", str(out), *FAST, "--weather", "clear-sky"]) == 0
    rows = weigh(out, folder / "rows", "--weather", "clear-sky")
    return folder, rows, weigh(out, folder / "area", "--weather", "clear-sky", "--layout", "area")


@pytest.mark.slow
def test_totals_say_both_and_windows_are_in_the_budget(both_layouts, tmp_path):
    """kWp are modules times their power, energy is power times hours; area, hours and groups are the
    same in both layouts.
    """
    folder, (rows, found), (area, other) = both_layouts
    out = folder / "traced"
    totals, every = found["totals"], other["totals"]
    count = numbers(rows, "module_count")
    np.testing.assert_allclose(numbers(rows, "kwp"), 0.300303 * count, rtol=1e-5)
    # South and north walls of 12 m: 11 upright (1.0628 m in 11.82 m) in two storeys.
    by_name = {row["surface_id"]: row for row in rows}
    assert by_name["a_south"]["module_count"] == by_name["a_north"]["module_count"] == "22"
    for name in ("kwp", "mwh_per_year"):
        assert totals["every_square_metre"][name] == pytest.approx(every[name], rel=1e-6)
        assert every["every_square_metre"][name] == pytest.approx(every[name], rel=1e-9)
    assert (totals["layout"], every["layout"]) == ("rows", "area")
    assert totals["module_count"] == pytest.approx(count.sum(), rel=1e-5)
    hours = numbers(rows, "full_load_hours") * numbers(rows, "area") / numbers(rows, "open_area")
    mwh = np.nansum(numbers(rows, "kwp") * hours) / 1000
    assert totals["mwh_per_year"] == pytest.approx(mwh, rel=1e-4)
    of_modules = ("kwp", "module_count", "module_area", "reason")
    same = [name for name in rows[0] if name not in of_modules]
    assert [[row[key] for key in same] for row in rows] == [
        [row[key] for key in same] for row in area
    ]
    groups = [(folder / name / "groups.csv").read_bytes() for name in ("rows", "area")]
    assert groups[0] == groups[1]
    # Smaller windows leave 2.0 m, where upright rows of 1.564 m are all that fits; larger ones
    # 1.2 m, where lying ones fit, 7 in 11.82 m.
    small, large = found["error_budget"]["windows"]
    assert small["window_band"] == 1.0 and small["percent"] == pytest.approx(0, abs=1e-9)
    run, _ = weigh(out, tmp_path / "large", "--window-band", "1.8")
    assert large["kwp"] == pytest.approx(numbers(run, "kwp").sum(), rel=1e-5)
    assert large["kwp"] < totals["kwp"]
    assert {row["surface_id"]: row for row in run}["a_south"]["module_count"] == "14"
    assert other["error_budget"]["windows"] == []
    # A share of facades takes the place of windows, or is taken of what they leave.
    half, _ = weigh(out, tmp_path / "half", "--usable", "facade=0.5")
    both, _ = weigh(out, tmp_path / "both", "--usable", "facade=0.5", "--window-band", "1.4")
    counts = [
        {row["surface_id"]: float(row["module_count"]) for row in one} for one in (half, both)
    ]
    # 11.8 × 8.8 m without windows: 7 lying of 1.584 m, 8 rows of 1.0628 m; 11 upright, 5 rows.
    assert [one["a_south"] for one in counts] == [28, 11]
    assert "no bands of windows" in note_windows(Request(usable={"facade": 0.5}))
    assert "both given" in note_windows(Request(usable={"facade": 0.5}, window_band=1.4))
    assert not note_windows(Request(usable={"flat": 0.5}))


@pytest.mark.slow
def test_folders_of_both_layouts_are_compared_on_area(both_layouts, tmp_path, capsys):
    folder, (_, rows), (_, area) = both_layouts
    command = ["compare", str(folder / "rows"), str(folder / "area"), "--out", str(tmp_path / "to")]
    assert main(command) == 0
    assert "modules on every square metre" in capsys.readouterr().err
    sums = json.loads((tmp_path / "to" / "summary.json").read_text("utf-8"))["sums"]["all"]
    assert sums["mwh_before"] == pytest.approx(area["totals"]["mwh_per_year"], rel=1e-4)
    assert sums["mwh_change"] == pytest.approx(0, abs=1e-4 * sums["mwh_before"])
    assert sums["mwh_before"] > 1.2 * rows["totals"]["mwh_per_year"]


def test_modules_stay_off_the_windows_of_a_real_file():
    """A house of LoD3, whose walls are drawn around their windows: every module lies in its wall."""
    city = read_city([CITYGML / "ingolstadt_lod3_4018148.xml.gz"])
    scene = make_located_scene(city, Request(ground="none"))
    surfaces, outlines = scene.surfaces, Outlines.of(city, scene.surfaces, scene.site)
    hidden = np.zeros(len(surfaces))
    layout, count = lay_city(surfaces, outlines, surfaces.eligible, RULES, hidden=hidden)
    walls = np.flatnonzero((surfaces.kind == "facade") & (count > 0))
    openings = np.flatnonzero(np.isin(surfaces.thematic, ["Window", "Door"]))
    assert len(walls) > 3 and count[openings].sum() == 0
    for wall in walls:
        own = layout.take(layout.surface == wall)
        right, up = (
            own.along[0] / np.linalg.norm(own.along[0]),
            own.up[0] / np.linalg.norm(own.up[0]),
        )
        low = np.column_stack([own.corner @ right, own.corner @ up])
        size = np.column_stack([own.along @ right, own.up @ up])
        modules = shapely.box(*low.T, *(low + size).T)
        outline = shapely.Polygon(outlines.rings(wall)[0] @ np.stack([right, up], 1))
        assert shapely.covers(outline.buffer(1e-4), modules).all()


def test_triangles_whose_edges_cross_are_joined():
    """GEOS refuses them as a coverage: of 5 m² and 1 m², the second almost wholly in the first."""
    from citypv.core.city.plan_geometry import join_triangles

    corners = [[(2, 0), (4, 2), (0, 3)], [(4, 2), (1, 1), (3, 1)]]
    triangles = shapely.polygons(corners)
    joined = join_triangles(triangles, np.zeros(len(triangles), int))[1][0]
    # Beyond the edge from (2, 0) to (0, 3) lies nothing but a tip at (1, 1), of 1/66 m².
    assert joined.area == pytest.approx(5 + 1 / 66, abs=1e-3)
