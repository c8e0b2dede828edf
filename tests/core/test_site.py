"""A city's solar map, its tiles read by a reader of our own from the specifications, and in a real
Chromium.
"""

import gzip
import json
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pandas as pd
import pyproj
import pytest
from read_glb import Glb, visit_tiles
from report_page import (
    Picture,
    check_slider,
    numbers,
    on_counted_area,
    shown,
    shown_parts,
    simulate_houses,
)

from citypv.core.commands.command_line import main
from citypv.core.results import tile_tree
from citypv.core.results.read_results import read_results

pytestmark = pytest.mark.slow
HOSTILE = [
    "</script><script>document.title='bad'</script>",
    "\"'><img src=x onerror=document.title='bad'>",
    "дом 🏠",
]
EAST = (0.0, 400.0)  # [m] of the two folders


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Results of two quarters of nine houses each."""
    place, rng = tmp_path_factory.mktemp("quarters"), np.random.default_rng(4)
    names = [f"House {k}" for k in range(9, 18)], [*HOSTILE, *(f"house {k}" for k in range(6))]
    return [
        simulate_houses(place / f"quarter{k}", names[k], rng, 3, east=east)
        for k, east in enumerate(EAST)
    ]


@pytest.fixture(scope="module")
def web(folders, tmp_path_factory):
    """The map of both."""
    out = tmp_path_factory.mktemp("map") / "web"
    assert (
        main(
            [
                "site",
                *map(str, folders),
                "--out",
                str(out),
                "--attribution",
                "<b>City & Co</b>",
                "--quiet",
            ]
        )
        == 0
    )
    return out


@pytest.fixture(scope="module")
def faces(folders):
    return pd.concat([pd.read_csv(folder / "faces.csv") for folder in folders]).set_index(
        "surface_id"
    )


def tiles_of(web):
    """Of each tile with all of its surfaces: table, triangles (t, 3, 3) and their features."""
    for _, path, matrix in visit_tiles(web / "tiles"):
        glb = Glb(path.read_bytes())
        if "surface_id" in glb.table():
            yield glb.table(), *glb.features(), matrix


def test_each_surface_stands_once_in_the_tiles_with_the_numbers_of_faces_csv(web, folders, faces):
    months = np.concatenate([read_results(folder).months for folder in folders])
    months = pd.DataFrame(months, index=faces.index)
    seen = []
    for table, *_ in tiles_of(web):
        own = faces.loc[table["surface_id"]]
        seen += table["surface_id"]
        for name, column in (
            ("building_id", "building_id"),
            ("kind", "kind"),
            ("orientation", "orientation"),
        ):
            assert table[name] == own[column].tolist()
        for name, column in (
            ("area", "area"),
            ("tilt", "surface_tilt"),
            ("sky", "sky_view_factor"),
        ):
            assert table[name] == pytest.approx(own[column].to_numpy(), rel=1e-5)
        counts = own["eligible"].to_numpy()
        assert [reason == "counts" for reason in table["reason"]] == counts.tolist()
        own = own[counts]
        expected = {
            "counted": own["open_area"],
            "kwp": own["kwp"],
            "hours": on_counted_area(own, "full_load_hours"),
            "error": on_counted_area(own, "full_load_hours_standard_error"),
        }
        share = (own["area"] / own["open_area"]).to_numpy()
        expected |= {
            f"month_{k + 1:02d}": months.loc[own.index, k].to_numpy() * share for k in range(12)
        }
        for name, values in expected.items():
            assert table[name][counts] == pytest.approx(np.asarray(values), rel=1e-5)
    assert sorted(seen) == sorted(faces.index) and len(faces) == 2 * 9 * 7


def test_modules_lie_before_their_surfaces_in_tiles_of_their_own(web, folders, faces):
    """As many on each surface as faces.csv says, of one size, 5 cm before the plane of that."""
    planes = {}
    for table, corners, feature, _ in tiles_of(web):
        for row, name in enumerate(table["surface_id"]):
            planes[table["hours"][row], table["kwp"][row]] = name, corners[feature == row]
    seen = dict.fromkeys(faces.index, 0)
    for tile, path, _ in visit_tiles(web / "tiles"):
        if "_modules" not in path.stem:
            continue
        assert tile["geometricError"] == 0
        glb = Glb(path.read_bytes())
        table, (corners, feature) = glb.table(), glb.features()
        edges = np.diff(corners, axis=1)
        area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        assert area == pytest.approx(np.full(len(area), area[0]), rel=1e-3)
        for row in range(len(table["hours"])):
            if not (feature == row).any():
                continue
            name, surface = planes[table["hours"][row], table["kwp"][row]]
            seen[name] += (feature == row).sum() / 2
            normal = np.cross(surface[0, 1] - surface[0, 0], surface[0, 2] - surface[0, 0])
            normal /= np.linalg.norm(normal)
            away = (corners[feature == row] - surface[0, 0]) @ normal
            assert away == pytest.approx(np.full(away.shape, 0.05), abs=3e-3)
    assert seen == faces["module_count"].to_dict() and sum(seen.values()) > 500


def test_triangles_lie_on_the_earth_where_the_city_stands(web, folders, faces):
    """From the Earth's centre to the files' grid by PROJ: area, plane and middle of each
    surface.
    """
    globe = pyproj.Transformer.from_crs(
        "EPSG:4978", pyproj.CRS("EPSG:25833").to_3d(), always_xy=True
    )
    middles = {}
    for quarter, folder in enumerate(folders):
        outlines = read_results(folder).outlines
        for row, name in enumerate(pd.read_csv(folder / "faces.csv")["surface_id"]):
            middles[name] = outlines.rings(row)[0].mean(axis=0)[2], quarter
    low = [
        json.loads((folder / "summary.json").read_text("utf-8"))["input"]["site"]["origin"][2]
        for folder in folders
    ]
    for table, corners, feature, matrix in tiles_of(web):
        there = np.column_stack([corners.reshape(-1, 3), np.ones(3 * len(corners))]) @ matrix
        grid = np.column_stack(globe.transform(*there[:, :3].T)).reshape(-1, 3, 3)
        area = 0.5 * np.linalg.norm(
            np.cross(grid[:, 1] - grid[:, 0], grid[:, 2] - grid[:, 0]), axis=1
        )
        own = faces.loc[table["surface_id"]]
        assert np.bincount(feature, area) == pytest.approx(own["area"].to_numpy(), rel=1e-4)
        for number, name in enumerate(table["surface_id"]):
            height, quarter = middles[name]
            points = grid[feature == number].reshape(-1, 3)
            assert points[:, 2].min() - 1e-3 <= height + low[quarter] <= points[:, 2].max() + 1e-3
            east, north = points[:, 0] - 390_000 - EAST[quarter], points[:, 1] - 5_818_000
            assert min(east.min(), north.min()) > -1e-3 and max(east.max(), north.max()) < 70


def test_tiles_lie_in_their_boxes_and_are_small(web):
    seen, levels = 0, set()
    for tile, path, _ in visit_tiles(web / "tiles"):
        data = path.read_bytes()
        corners, _ = Glb(data).features()
        box = tile["boundingVolume"]["box"]
        centre, half = np.array(box[:3]), np.diag(np.reshape(box[3:], (3, 3)))
        assert (np.abs(corners.reshape(-1, 3) - centre) <= half + 1e-3).all()
        assert len(gzip.compress(data)) <= 500_000
        assert Glb(data).json["asset"]["copyright"] == "<b>City & Co</b>"
        seen, levels = seen + 1, levels | {tile["geometricError"]}
    assert seen == len(list((web / "tiles").glob("*.glb"))) and len(levels) >= 4


def test_roofs_without_walls_are_off_by_the_tallest_building(web):
    """And whatever stands above them by no less: a page draws walls wherever they are large enough
    to be seen.
    """
    heights, errors = {}, {}
    for tile, path, _ in visit_tiles(web / "tiles"):
        square = path.stem.rpartition("_")[0]
        if path.stem.endswith("_roofs"):
            errors[square] = tile["geometricError"]
        elif "building" in Glb(path.read_bytes()).table():
            glb = Glb(path.read_bytes())
            building, (corners, feature) = np.array(glb.table()["building"]), glb.features()
            for one in np.unique(building[feature]):
                z = corners[building[feature] == one][..., 2]
                heights.setdefault(square, []).append(z.max() - z.min())
    assert errors and heights.keys() == errors.keys()
    for square, own in heights.items():
        assert errors[square] == pytest.approx(max(own), abs=0.01)


def test_from_afar_the_roofs_have_their_means(web, faces):
    """The mosaic for the whole: the mean over its pixels is that of the roofs by their area in
    plan.
    """
    top = max(visit_tiles(web / "tiles"), key=lambda one: one[0]["geometricError"])
    glb = Glb(top[1].read_bytes())
    table, (corners, feature) = glb.table(), glb.features()
    area = np.bincount(
        feature, 0.5 * np.abs(np.cross(*(corners[:, k] - corners[:, 0] for k in (1, 2)))[:, 2])
    )
    roofs = faces[faces["kind"] == "roof"]
    plan = roofs["area"] * np.cos(np.radians(roofs["surface_tilt"]))
    assert area.sum() == pytest.approx(plan.sum(), rel=0.02)
    mean = np.average(on_counted_area(roofs, "full_load_hours"), weights=plan)
    assert np.average(table["hours"], weights=area) == pytest.approx(mean, rel=0.01)


def test_tiles_that_are_too_large_are_cut(folders, tmp_path, monkeypatch):
    monkeypatch.setattr(tile_tree, "MOST_BYTES", 6000)
    assert main(["site", str(folders[0]), "--out", str(tmp_path / "web"), "--quiet"]) == 0
    seen = []
    for table, *_ in tiles_of(tmp_path / "web"):
        assert len(set(table["building_id"])) < 9
        seen += table["surface_id"]
    assert sorted(seen) == sorted(pd.read_csv(folders[0] / "faces.csv")["surface_id"])


def test_a_private_map_names_nothing(folders, tmp_path):
    out = tmp_path / "web"
    assert main(["site", *map(str, folders), "--out", str(out), "--private", "--quiet"]) == 0
    whole = b"".join(
        path.read_bytes() for path in out.rglob("*") if path.suffix in (".glb", ".json", ".html")
    )
    assert b"ouse" not in whole and "дом".encode() not in whole
    rows = json.loads((out / "buildings" / "largest.json").read_text("utf-8"))
    assert len(rows) == 18 and {tuple(row[:2]) for row in rows} == {("", None)}
    names = sorted(path.name for path in (out / "buildings").iterdir())
    assert names == ["largest.json", "page_0.json"]


def test_what_does_not_belong_together_is_refused(folders, tmp_path, refused):
    other = tmp_path / "other"
    again = [
        "yield",
        str(folders[1] / "transfer.nc"),
        "--losses",
        "0",
        "--out",
        str(other),
        "--quiet",
    ]
    assert main(again) == 0
    cases = {
        ("--losses",): [folders[0], other],
        ("House 10", "in another folder too"): [folders[0], folders[0]],
        ("summary.json", "there is no such file"): [tmp_path / "none"],
    }
    for words, given in cases.items():
        said = refused("site", *given, "--out", tmp_path / "web", "--quiet")
        assert all(word in said for word in words)
        assert not (tmp_path / "web").exists()
    refused("site", other, "--out", other, "--overwrite")


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def address(web):
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=web))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


def whole_map(page):
    page.wait("document.querySelector('#city-buildings tbody tr') !== null")
    page.wait(
        "tiles.stats.downloading + tiles.stats.parsing + tiles.stats.queued === 0 && "
        "tiles.visibleTiles.size > 0"
    )
    page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


@pytest.fixture
def page(chromium, address):
    """The map as it opens; nothing else may be asked for, and nothing go wrong."""
    chromium.call("Page.navigate", url=f"{address}index.html")
    whole_map(chromium)
    yield chromium
    assert chromium.complaints == [] and all(url.startswith(address) for url in chromium.requests)
    assert chromium.run("document.title") == "Solar map"


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (390, 844)])
def test_the_first_view_has_walls_on_any_screen(chromium, address, web, width, height):
    """What is drawn without walls is less than five pixels high: at its nearest to the camera, and
    if it stood along the height of the view.
    """
    chromium.resize(width, height)
    chromium.call("Page.navigate", url=f"{address}index.html")
    whole_map(chromium)
    seen = chromium.run(
        "[...tiles.visibleTiles].map((tile) => [tile.content.uri.split('/').pop(), "
        "tile.traversal.distanceFromCamera])"
    )
    angle, rows = chromium.run(
        "[tiles.cameras[0].fov, document.querySelector('canvas').clientHeight]"
    )
    chromium.resize(1200, 900)
    # What has all walls may lack modules alone.
    tall = {path.name: tile["geometricError"] for tile, path, _ in visit_tiles(web / "tiles")}
    tall |= {name: 0 for name, error in tall.items() if error == 2}
    assert seen and {name for name, _ in seen} <= tall.keys()
    for name, distance in seen:
        assert tall[name] < 5 * 2 * distance * np.tan(np.radians(angle / 2)) / rows


def test_clicks_show_what_faces_csv_says(page, web, folders, faces):
    """Near the second quarter; places as the files have them, brought to the map's frame
    by PROJ.
    """
    page.run("chooseBuilding(found.find((row) => row.id === 'house 4').building, true)")
    page.wait(
        "[...loaded.values()].some(({ columns }) => columns.building?.includes(chosen.building))"
    )
    page.run("new Promise((done) => setTimeout(done, 700))")
    whole_map(page)
    assert shown_parts(page)["Together"]
    frame = np.array(json.loads((web / "page" / "map.json").read_text("utf-8"))["frame"]).reshape(
        4, 4
    )
    site = json.loads((folders[1] / "summary.json").read_text("utf-8"))["input"]["site"]
    globe = pyproj.Transformer.from_crs(
        pyproj.CRS("EPSG:25833").to_3d(), "EPSG:4978", always_xy=True
    )

    def place(corners):
        turn = np.radians(site["convergence"])
        east, north = (corners[..., 0], corners[..., 1])
        grid = np.stack(
            [
                np.cos(turn) * east - np.sin(turn) * north,
                np.sin(turn) * east + np.cos(turn) * north,
            ],
            -1,
        )
        x, y, z = (
            *np.moveaxis(grid + site["origin"][:2], -1, 0),
            corners[..., 2] + site["origin"][2],
        )
        return (np.stack(globe.transform(x, y, z), axis=-1) - frame[3, :3]) @ frame[:3, :3].T

    names = pd.read_csv(folders[1] / "faces.csv")["surface_id"]
    checked = 0
    for x, y, surface in Picture(page, folders[1], place).places(60, seed=5):
        page.click(x, y)
        if surface < 0:
            continue
        row, told = faces.loc[names[surface]], shown(page)
        assert told["Surface"] == names[surface]
        assert numbers(told["Area"])[0] == pytest.approx(row.area, abs=0.006)
        if row.eligible:
            hours = [
                on_counted_area(row, f"full_load_hours{end}") for end in ("", "_standard_error")
            ]
            assert numbers(told["Full load hours"]) == pytest.approx(hours, abs=0.06)
            assert page.run("document.querySelectorAll('#city-chosen .months i').length") == 12
            checked += 1
    assert checked > 15


def test_buildings_are_found_and_have_the_totals_of_buildings_csv(page, folders):
    buildings = pd.concat([pd.read_csv(folder / "buildings.csv") for folder in folders]).set_index(
        "building_id"
    )
    assert page.run("byId('found').textContent") == "18 buildings"
    for name in [*HOSTILE, "House 12", "HOUSE 3"]:
        page.run(f"byId('search').value = {json.dumps(name)}")
        page.run("searchBuildings()")
        (row,) = page.run(
            "findRows().map(({ id, area, kwp, mwh, hours }) => [id, area, kwp, mwh, hours])"
        )
        one = buildings.loc[row[0]]
        assert row[0].lower() == name.lower()
        assert row[1:] == pytest.approx(
            [one.eligible_area, one.kwp, one.mwh_per_year, one.full_load_hours], rel=1e-4
        )
        page.run("document.querySelector('#city-buildings td button').click()")
        assert page.run("document.querySelector('#city-chosen p button').textContent") == row[0]
    assert page.run("document.querySelectorAll('#city img, #city script').length") == 0


def test_the_slider_sums_both_quarters(page, faces):
    check_slider(page, faces)


def test_cards_and_table_sum_both_quarters(page, folders):
    totals = [json.loads((one / "summary.json").read_text("utf-8"))["totals"] for one in folders]
    figures = page.run("[...document.querySelectorAll('.figure')].map((one) => one.innerText)")
    count, kwp, mwh = (
        sum(one[name] for one in totals) for name in ("module_count", "kwp", "mwh_per_year")
    )
    assert [numbers(text)[0] for text in figures[:2]] == [round(count), round(kwp)]
    assert numbers(figures[2])[0] == pytest.approx(mwh, abs=0.006)
    rows = page.run("[...document.querySelectorAll('section table')][0].innerText.split('\\n')")
    table = {row.split("\t")[0]: numbers(row.partition("\t")[2]) for row in rows}
    for title, part in (("All", None), ("Facades", "facade"), ("Pitched roofs", "roof")):
        own = [one if part is None else one["kinds"][part] for one in totals]
        area, power, energy = (
            sum(one[name] for one in own) for name in ("module_area", "kwp", "mwh_per_year")
        )
        told = [round(area), round(power), round(energy), round(1000 * energy / power)]
        assert table[title][:4] == told


def test_it_says_what_it_rests_on_and_fits_a_phone(page):
    text = page.run("document.body.innerText")
    for words in (
        "<b>City & Co</b>",
        "climatology",
        "Weather",
        "Results of",
        "root mean square",
        "Building law",
    ):
        assert words in text
    page.resize(375, 812)
    assert page.run("document.documentElement.scrollWidth") == 375
