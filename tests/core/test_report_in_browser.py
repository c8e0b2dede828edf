"""report.html in a real Chromium: what a click shows is what the files say, whatever the ids are.

Where no Chromium is installed these tests are skipped; `.ci/run` installs one, and fails without.
"""

import numpy as np
import pandas as pd
import pytest
from browser import start_browser
from matplotlib import colormaps
from matplotlib.image import imread
from report_page import (
    Picture,
    check_slider,
    numbers,
    on_counted_area,
    shown,
    shown_parts,
    simulate_houses,
    slide,
)

from citypv.core.commands.command_line import main
from citypv.core.energy.counted_area import REASONS
from citypv.core.results.read_results import read_results

pytestmark = pytest.mark.slow
HOSTILE = [
    "</script><script>document.title='bad'</script>",
    "\"'><img src=x onerror=document.title='bad'>",
    "&lt;b&gt;&amp;",
    "${document.title='bad'}",
    "__proto__",
    "дом № 7",
    "建筑物",
    "\u202ehouse 🏠",
    "long_" * 60,
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of sixteen houses, whose ids want to do harm."""
    names = [*HOSTILE, *(f"house {k}" for k in range(len(HOSTILE), 16))]
    out = simulate_houses(
        tmp_path_factory.mktemp("browser") / "out", names, np.random.default_rng(3), 4, "--monthly"
    )
    assert main(["plot", str(out), "--quiet"]) == 0
    return out


@pytest.fixture(scope="module")
def faces(folder):
    return pd.read_csv(
        folder / "faces.csv", index_col="surface_id", keep_default_na=False, na_values=[""]
    )


@pytest.fixture
def page(chromium, folder):
    """The page as it opens; nothing else may be asked for, and nothing go wrong."""
    chromium.resize(1200, 900)
    chromium.open(folder / "report.html")
    chromium.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    yield chromium
    assert chromium.complaints == []
    assert [url for url in chromium.requests if not url.startswith("data:")] == [
        (folder / "report.html").as_uri()
    ]
    assert chromium.run("document.title") == "Solar potential: out"


def test_a_hundred_clicks_show_what_faces_csv_says(page, folder, faces):
    places, kinds = Picture(page, folder).places(100, seed=5), set()
    hours = on_counted_area(faces, "full_load_hours")
    error = on_counted_area(faces, "full_load_hours_standard_error")
    months = [on_counted_area(faces, f"full_load_hours_{month:02d}") for month in range(1, 13)]
    for x, y, surface in places:
        page.click(x, y)
        if surface < 0:
            assert page.run("chosen.surface") == -1
            continue
        name, row = faces.index[surface], faces.iloc[surface]
        told = shown(page)
        assert told["Surface"] == name
        assert (
            page.run("document.querySelector('#city-chosen p button').textContent")
            == row["building_id"]
        )
        plane = [row.surface_tilt, row.surface_azimuth]
        assert numbers(told["Tilt"] + told["Azimuth"]) == pytest.approx(plane, abs=0.06)
        assert numbers(told["Area"])[0] == pytest.approx(row.area, abs=0.006)
        assert numbers(told["Sky view factor"])[0] == pytest.approx(row.sky_view_factor, abs=0.0006)
        kinds.add(row.kind)
        if not row.kwp:
            assert told["Does not count"] == REASONS[row.reason]
            continue
        kwp = row.kwp
        assert numbers(told["Power"])[0] == pytest.approx(kwp, abs=0.006)
        assert numbers(told["Full load hours"]) == pytest.approx(
            [hours[name], error[name]], abs=0.06
        )
        assert numbers(told["Energy in a year"]) == pytest.approx(
            [kwp * hours[name], kwp * error[name]], abs=1
        )
        bars = page.run("document.querySelector('#city-chosen .months').ariaLabel")
        assert numbers(bars) == pytest.approx([month[name] for month in months], abs=0.06)
    assert kinds == {"facade", "roof"}


def test_totals_are_those_of_buildings_csv(page, folder, faces):
    buildings = pd.read_csv(folder / "buildings.csv", index_col="building_id")
    worn = faces[faces["kwp"] > 0].groupby("building_id")["open_area"].sum()
    page.run("byId('more').hidden || byId('more').click()")
    cells = (
        "[...byId('buildings').tBodies[0].rows].map((row) => [...row.cells].map((cell) => "
        "cell.textContent))"
    )
    table = page.run(cells)
    assert sorted(row[0] for row in table) == sorted(buildings.index)
    assert [numbers(row[3])[0] for row in table] == sorted(
        (numbers(row[3])[0] for row in table), reverse=True
    )
    for place, (name, *texts) in enumerate(table):
        one = buildings.loc[name]
        area, kwp, mwh, hours = (numbers(text)[0] for text in texts)
        assert [area, kwp, mwh] == pytest.approx(
            [worn[name], one.kwp, one.mwh_per_year], rel=0.001, abs=0.51
        )
        assert hours == pytest.approx(one.full_load_hours, abs=0.06) and one.flat_roof_kwp == 0
        assert mwh == pytest.approx(one.mwh_per_year, abs=0.006)
        page.run(f"document.querySelectorAll('#city-buildings td button')[{place}].click()")
        parts = shown_parts(page)
        assert parts["Together"][:4] == pytest.approx([area, kwp, mwh, hours], abs=0.06)
        for title, kind in (("Facades", "facade"), ("Pitched roofs", "roof")):
            own = faces[
                (faces["building_id"] == name) & (faces["kwp"] > 0) & (faces["kind"] == kind)
            ]
            mean = np.average(on_counted_area(own, "full_load_hours"), weights=own["kwp"])
            assert [parts[title][0], parts[title][3]] == pytest.approx(
                [own["open_area"].sum(), mean], abs=0.51
            )


def test_the_city_has_the_colours_of_its_hours(page, folder, faces, tmp_path):
    """Pixels of the picture, by matplotlib's viridis; darker by at most the shade."""
    picture = Picture(page, folder)
    low, high = page.run("[currentLayer().low, currentLayer().high]")
    page.picture(tmp_path / "page.png")
    pixels, checked = imread(tmp_path / "page.png")[:, :, :3], 0
    for x, y, surface in picture.places(60, seed=9):
        if surface >= 0 and faces["kwp"].iloc[surface] > 0:
            hours = on_counted_area(faces, "full_load_hours").iloc[surface]
            colour = np.array(colormaps["viridis"](np.clip((hours - low) / (high - low), 0, 1))[:3])
            seen = pixels[int(y), int(x)]
            shade = seen @ colour / (colour @ colour)
            assert 0.55 < shade < 1.01 and seen == pytest.approx(shade * colour, abs=0.02)
            checked += 1
    assert checked > 15


def test_the_slider_sums_and_greys_which_faces_pay(page, faces):
    check_slider(page, faces)
    hours = on_counted_area(faces, "full_load_hours").to_numpy()
    least = 10 * round(np.nanmedian(hours[faces["kwp"] > 0]) / 10)
    slide(page, least)
    stops = "currentLayer().stops.map(readColour)"
    grey = page.run(
        f"city.surface_id.map((_, k) => colourOf(k, currentLayer(), {stops}, [-1, -1, -1])[0] < 0)"
    )
    pays = (faces["kwp"] > 0).to_numpy() & (hours >= least)
    assert grey == (~pays).tolist() and 0 < pays.sum() < len(faces)
    assert f"or has less than {least} h" in page.run("byId('grey-words').textContent")
    # Keys move it by a step, and the line in both charts follows.
    page.run("byId('least').focus()")
    page.press("ArrowLeft")
    assert page.run("[least, Number(byId('least').value)]") == [least - 10] * 2
    places = page.run("markers.map(({ marker, place }) => marker.x1.baseVal.value - place(least))")
    assert places == pytest.approx([0, 0], abs=1e-3)
    slide(page, 0)


def test_modules_are_drawn_where_they_pay(page, folder, faces, tmp_path):
    """A box shows them; a mesh of two triangles each, dark before the faces, as the slider says."""
    for name in ("bare", "worn"):
        page.run(
            f"byId('modules').checked === {str(name == 'worn').lower()} || byId('modules').click()"
        )
        page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        page.picture(tmp_path / f"{name}.png")
    count = "view.modules.geometry.index.count / 6"
    assert page.run(count) == faces["module_count"].sum() == page.run("city.module_surface.length")
    least = 10 * round(on_counted_area(faces, "full_load_hours")[faces["kwp"] > 0].median() / 10)
    slide(page, least)
    pays = (faces["kwp"] > 0) & (on_counted_area(faces, "full_load_hours") >= least)
    assert 0 < page.run(count) == faces["module_count"][pays].sum()
    slide(page, 0)
    # Pixels are as before, or darker by the look of a module over the colour of the face.
    bare, worn = (imread(tmp_path / f"{name}.png")[:, :, :3] for name in ("bare", "worn"))
    look = np.array([0x14, 0x21, 0x3D]) / 255
    same = np.abs(worn - bare).max(axis=2) < 0.02
    dark = np.abs(worn - (0.4 * bare + 0.6 * look)).max(axis=2) < 0.02
    assert (dark & ~same).sum() > 2000 and (same | dark).mean() > 0.9
    page.run("byId('modules').click()")


def test_names_do_nothing_but_stand_there(page):
    for name in HOSTILE:
        page.run("byId('search').value = ''")
        page.run("byId('search').focus()")
        page.call("Input.insertText", text=name)
        found = page.run(
            "[...byId('buildings').tBodies[0].rows].map((row) => row.cells[0].textContent)"
        )
        assert found == [name]
        page.run("document.querySelector('#city-buildings td button').click()")
        assert page.run("document.querySelector('#city-chosen p button').textContent") == name
        assert page.run("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.run("document.querySelectorAll('#city img, #city script').length") == 0


def test_other_scripts_do_not_run(chromium, folder):
    chromium.open(folder / "report.html")
    chromium.run(
        "document.body.append(Object.assign(document.createElement('script'), { textContent: "
        "'window.ran = 1' }))"
    )
    chromium.run(
        "document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.ran = 2\">')"
    )
    chromium.run("fetch('http://127.0.0.1:9/').catch(() => 0)")
    assert chromium.run("window.ran === undefined")
    assert sum("Content Security Policy" in complaint for complaint in chromium.complaints) >= 3


def test_keys_alone_do_all(page, folder):
    distance = "view.camera.position.distanceTo(view.controls.target)"
    page.run("byId('view').focus()")
    before, target = page.run(distance), page.run("view.controls.target.toArray()")
    page.press("+")
    assert page.run(distance) == pytest.approx(0.8 * before)
    page.press("ArrowLeft")
    assert page.run("view.controls.target.toArray()") != target
    direction = page.run("view.controls.getAzimuthalAngle()")
    page.press("ArrowLeft", shift=True)
    assert page.run("view.controls.getAzimuthalAngle()") != direction
    page.press("Home")
    page.wait(f"Math.abs({distance} - {before}) < 1e-6 * {before}")
    page.run("document.querySelector('#city-buildings td button').focus()")
    page.press("Enter")
    outlines, building = read_results(folder).outlines, page.run("chosen.building")
    rows = page.run(f"rows[{building}].surfaces")
    corners = np.concatenate([outlines.rings(row)[0] for row in rows])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    page.wait(
        f"view.controls.target.distanceTo(new THREE.Vector3({','.join(map(str, middle))})) < 0.01"
    )
    page.run("document.querySelector('#city-chosen details').open = true")
    page.wait("document.querySelectorAll('#city-chosen li button').length === 7")
    page.run("document.querySelector('#city-chosen li button').focus()")
    page.press("Enter")
    assert page.run("chosen.surface") == rows[0]
    page.run("byId('view').focus()")
    page.press("Escape")
    assert page.run("chosen.building") == -1


def test_on_a_phone_nothing_hangs_over_and_a_tap_chooses(page, folder):
    page.resize(375, 812)
    page.call("Emulation.setTouchEmulationEnabled", enabled=True)
    page.run("byId('tools').scrollIntoView()")
    page.wait("view.canvas.width === view.canvas.clientWidth")
    x, y, surface = next(
        place for place in Picture(page, folder).places(20, seed=2) if place[2] >= 0
    )
    page.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.call("Emulation.setTouchEmulationEnabled", enabled=False)
    assert page.run("chosen.surface") == surface
    assert page.run("[document.documentElement.scrollWidth, view.canvas.clientWidth <= 375]") == [
        375,
        True,
    ]


def test_a_comparison_shows_the_change(chromium, folder, tmp_path):
    """Of a state with itself: nothing changes, and all that counts has the colour in the middle."""
    assert main(["compare", str(folder), str(folder), "--out", str(tmp_path / "change")]) == 0
    chromium.open(tmp_path / "change" / "report.html")
    assert (
        chromium.run("byId('legend-title').textContent")
        == "Change of the full load hours [h per year]"
    )
    counting = "[...city.surface_id.keys()].filter(carries)"
    stops = "currentLayer().stops.map(readColour)"
    assert chromium.run(
        f"{counting}.every((k) => colourOf(k, currentLayer(), {stops}, [0, 0, 0])[0] === 0xeb)"
    )
    chromium.run(f"chooseSurface({counting}[0])")
    assert shown(chromium)["Change of the hours"] == "0.0 ± 0.0 h" and chromium.complaints == []
    assert "Change of its energy in a year: 0.00 ± 0.00 MWh" in chromium.run(
        "byId('chosen').textContent"
    )
    assert "Change [MWh] ▾" in chromium.run(
        "byId('buildings').tHead.innerText"
    )  # sorted by it; ▴ where some lose
    assert chromium.run("[-0.04, 1234.5, -0.05].map((value) => format(value, 1, '+'))") == [
        "0.0",
        "+1,234.5",
        "−0.1",
    ]


def test_without_webgl_the_table_is_there(folder):
    browser = start_browser(webgl=False)
    try:
        browser.open(folder / "report.html")
        assert "WebGL" in browser.run("byId('note').textContent")
        assert browser.run(
            "[byId('view').checkVisibility(), byId('buildings').tBodies[0].rows.length]"
        ) == [False, 10]
        browser.run("document.querySelector('#city-buildings td button').click()")
        assert len(shown_parts(browser)) == 3
    finally:
        browser.close()
