"""The page of a building in report and map, in a real Chromium: by its link alone, with the numbers
of the tables, and printed on one page.
"""

import base64
import re
import shutil
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, quote, urlsplit

import h5netcdf
import numpy as np
import pandas as pd
import pytest
from browser import start_browser
from report_page import numbers, on_counted_area, simulate_houses

from citypv.core.commands.command_line import main
from citypv.core.results.describe_buildings import describe_buildings
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.slow
NAMES = ["a/b+c %25 & <i>d</i>", "long house"]
OPEN = "document.body.classList.contains('of-building')"
TEXT = "document.getElementById('building-{}').textContent"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of two houses, cut into cells so that each has many surfaces."""
    out = simulate_houses(
        tmp_path_factory.mktemp("page") / "out", NAMES, np.random.default_rng(1), 2,
        "--grid-size", "5", "--monthly",
    )  # fmt: skip
    assert main(["plot", str(out), "--quiet"]) == 0
    return out


@pytest.fixture(scope="module")
def buildings(folder):
    return pd.read_csv(folder / "buildings.csv", index_col="building_id")


@pytest.fixture(scope="module")
def browser():
    browser = start_browser()
    yield browser
    browser.close()


@pytest.fixture
def page(browser, folder):
    """The report at the link of the first house."""
    browser.call("Page.navigate", url="about:blank")  # so that the page is read anew
    browser.open(folder / "report.html", "#building=" + quote(NAMES[0], safe=""))
    browser.wait(OPEN)
    yield browser
    assert browser.complaints == []
    assert {urlsplit(url).scheme for url in browser.requests} <= {"file", "data"}


def rows_of(page, table):
    """Cells of a table's rows: list of list of str."""
    return page.run(
        f"[...document.querySelectorAll('#building-{table} tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent))"
    )


def assert_shown(text, value, error):
    """A number and its error, rounded to the decimals that are shown, of which the error has two
    digits.
    """
    shown = text.split(" ± ")
    decimals = len(shown[0].partition(".")[2])
    assert shown == [f"{value:,.{decimals}f}", f"{error:,.{decimals}f}"]
    assert decimals == 3 or 9.5 <= error * 10**decimals < 99.5


def check_sums(page, row):
    """Sums of the page against a row of buildings.csv."""
    sums = {cells[0]: cells[1:] for cells in rows_of(page, "sums")}
    assert list(sums) == ["Facades", "Pitched roofs", "Together"]
    for title, part in (("Facades", "facade_"), ("Pitched roofs", "roof_"), ("Together", "")):
        area, kwp, energy, hours = sums[title]
        assert area == f"{row[f'{part}module_area']:,.1f}" and kwp == f"{row[f'{part}kwp']:,.2f}"
        value, error = row[f"{part}mwh_per_year"], row[f"{part}mwh_standard_error"]
        decimals = len(sums["Together"][2].split(" ")[0].partition(".")[2])
        assert energy == f"{value:.{decimals}f} ± {error:.{decimals}f}"
        over = 1000 / row[f"{part}kwp"]
        assert numbers(hours) == pytest.approx([value * over, error * over], abs=0.0501)
    assert_shown(sums["Together"][2], row["mwh_per_year"], row["mwh_standard_error"])


def test_a_link_opens_the_page_with_the_sums_of_buildings_csv(page, buildings):
    assert page.run(TEXT.format("title")) == NAMES[0] == page.run("document.title")
    check_sums(page, buildings.loc[NAMES[0]])
    seen = "[...document.querySelectorAll('main > *')].filter((part) => part.checkVisibility())"
    assert page.run(f"{seen}.map((part) => part.id)") == ["building"]


def test_surfaces_are_those_of_faces_csv_and_ask_pvgis(page, folder, buildings):
    faces = pd.read_csv(folder / "faces.csv")
    own = faces[(faces["building_id"] == NAMES[0]) & (faces["kwp"] > 0)]
    hours = on_counted_area(own, "full_load_hours")
    error = on_counted_area(own, "full_load_hours_standard_error")
    own = own.assign(hours=hours, error=error, energy=own["kwp"] * hours)
    own = own.sort_values("energy", ascending=False, kind="stable")
    *lines, rest = rows_of(page, "surfaces")
    links = page.run(
        "[...document.querySelectorAll('#building-surfaces a')].map((link) => link.href)"
    )
    assert len(lines) == len(own) == len(links) > 12
    row, azimuths = buildings.loc[NAMES[0]], set()
    for line, link, face in zip(lines, links, own.itertuples(), strict=True):
        area, tilt, azimuth, modules, kwp, energy, full_load_hours, _ = map(numbers, line[1:])
        assert [*area, *kwp, *modules] == pytest.approx(
            [face.area, face.kwp, face.module_count], abs=0.0501
        )
        assert [*tilt, *azimuth] == pytest.approx(
            [face.surface_tilt, face.surface_azimuth], abs=0.501
        )
        assert energy == pytest.approx([face.energy, face.kwp * face.error], abs=0.51)
        assert full_load_hours == pytest.approx([face.hours, face.error], abs=0.051)
        # PVGIS: 0 is south, −90 east, 90 west; losses are all between the modules and the grid.
        assert link.startswith("https://re.jrc.ec.europa.eu/api/v5_3/PVcalc?")
        asked = {name: value[0] for name, value in parse_qs(urlsplit(link).query).items()}
        assert float(asked["lat"]) == pytest.approx(row["latitude"], abs=1e-5)
        assert float(asked["lon"]) == pytest.approx(row["longitude"], abs=1e-5)
        assert float(asked["peakpower"]) == pytest.approx(face.kwp, abs=0.0051)
        assert float(asked["angle"]) == pytest.approx(face.surface_tilt, abs=0.051)
        assert float(asked["loss"]) == pytest.approx(
            100 * (1 - row["mwh_per_year"] / row["mwh_dc_per_year"]), abs=0.051
        )
        side = {"south": 0, "west": 90, "north": 180, "east": -90}[face.orientation]
        away = (float(asked["aspect"]) - side + 180) % 360 - 180
        assert abs(away) < 3 and -180 <= float(asked["aspect"]) <= 180
        azimuths.add(face.orientation)
    assert azimuths == {"south", "west", "north", "east"}
    # On paper the last ones are one line, of their sum.
    assert rest[0] == f"and {len(own) - 12} more"
    assert numbers(rest[6])[0] == pytest.approx(own["energy"].iloc[12:].sum(), abs=0.51)
    hidden = "document.querySelectorAll('#building-surfaces .beyond').length"
    assert page.run(hidden) == len(own) - 12


def test_months_and_hours_add_up_to_the_year(page, folder, buildings):
    row = buildings.loc[NAMES[0]]
    told = page.run("document.querySelector('#building-months svg').ariaLabel")
    months = [numbers(text) for text in told.split(", ")]
    unit = 1 if "MWh" in told else 1000
    monthly = [row[f"full_load_hours_{k:02d}"] * row["kwp"] / 1000 for k in range(1, 13)]
    assert [value for value, _ in months] == pytest.approx(np.multiply(monthly, unit), abs=0.6)
    assert np.hypot.reduce([error for _, error in months]) == pytest.approx(
        unit * row["mwh_standard_error"], abs=1.5
    )
    # Hours: kW in 255ths of the highest, of days of each month, are the energy of the year.
    own = dict(describe_buildings(folder))[NAMES[0]]
    share = np.frombuffer(base64.b64decode(own["hours"]), np.uint8).reshape(12, 24)
    days = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]
    power = own["peak"] * share / 255
    assert days @ power.sum(axis=1) == pytest.approx(1000 * row["mwh_per_year"], rel=0.01)
    with h5netcdf.File(folder / "surfaces.nc") as file:
        stored = file["building_power"][sorted(NAMES).index(NAMES[0])]
    assert share.max() == 255 and np.abs(power - stored).max() < 0.0023 * own["peak"]
    drawn = page.run("document.querySelectorAll('#building-hours rect').length")
    assert drawn == np.count_nonzero(share) + 60  # cells, and the scale below them
    assert "UTC+01:00" in page.run(TEXT.format("day"))


def test_a_comparison_has_the_pages_of_the_later_state(browser, folder, buildings, tmp_path):
    assert main(["compare", str(folder), str(folder), "--out", str(tmp_path / "change")]) == 0
    browser.open(tmp_path / "change" / "report.html", "#building=" + quote(NAMES[1]))
    browser.wait(OPEN)
    check_sums(browser, buildings.loc[NAMES[1]])
    assert browser.complaints == []


def test_tables_of_another_run_are_refused(folder, tmp_path):
    for name in ("surfaces.nc", "buildings.csv"):
        shutil.copy(folder / name, tmp_path)
    table = pd.read_csv(tmp_path / "buildings.csv").iloc[::-1]
    table.to_csv(tmp_path / "buildings.csv", index=False)
    with pytest.raises(InputError, match="does not belong to the tables beside it"):
        list(describe_buildings(tmp_path))
    (tmp_path / "buildings.csv").unlink()
    assert list(describe_buildings(tmp_path)) == []


def test_the_page_follows_the_address(page, buildings):
    page.run(f"location.hash = '#building=' + encodeURIComponent({NAMES[1]!r})")
    page.wait(f"{TEXT.format('title')} === {NAMES[1]!r}")
    check_sums(page, buildings.loc[NAMES[1]])
    picture = "byId('picture').closest('#city') === null"
    assert page.run(f"{picture} && view.canvas.width > 300")
    page.run("document.querySelector('#building-tools a').click()")
    page.wait(f"!{OPEN}")
    assert not page.run(picture) and page.run("document.title !== '' && chosen.building >= 0")
    assert page.run("!document.getElementById('building').checkVisibility()")
    page.run("document.querySelector('#city-chosen a[href^=\"#building=\"]').click()")
    page.wait(f"{OPEN} && {TEXT.format('title')} === {NAMES[1]!r}")
    # A click on another building in the picture leads to its page.
    page.run(f"chooseSurface(city.building.indexOf(city.buildings.indexOf({NAMES[0]!r})))")
    page.wait(f"{TEXT.format('title')} === {NAMES[0]!r}")
    page.run("location.hash = '#building=nowhere%'")
    page.wait(f"!{OPEN}")
    assert "nowhere%" in page.run("byId('note').textContent")


def test_facts_are_told_and_a_private_report_holds_none(browser, folder, tmp_path):
    """Of a house with an address, use and year, as its file would tell them."""
    own = tmp_path / "told"
    shutil.copytree(folder, own)
    table = pd.read_csv(own / "buildings.csv", dtype=str, keep_default_na=False)
    facts = {"address": "Am Döbelner Ring 5, Leipzig; Rue 2, Leipzig", "name": "Kita Spatz"}
    facts |= {"function": "day care (2040)", "year": "1974"}
    for name, text in facts.items():
        table.loc[table["building_id"] == NAMES[1], name] = text
    table.to_csv(own / "buildings.csv", index=False)
    whole = "JSON.stringify([city, rows.map((row) => ({ ...row, surfaces: 0, shape: 0 }))])"
    for options in ([], ["--private"]):
        assert main(["plot", str(own), "--quiet", *options]) == 0
        browser.call("Page.navigate", url="about:blank")
        browser.open(own / "report.html", "#building=" + quote(NAMES[1]))
        browser.wait(OPEN)
        told = browser.run(TEXT.format("title")) + browser.run(TEXT.format("facts"))
        held = browser.run(whole) + (own / "report.html").read_text("utf-8")
        for name, text in facts.items():
            known = not options or name in ("function", "year")
            assert (text in told) is known and (text in held) is known


def count_pages(pdf):
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf))


def test_a_building_is_printed_on_one_page_with_a_picture(page):
    pdf = page.print()
    assert count_pages(pdf) == 1 and b"/Subtype /Image" in pdf
    assert page.run("document.querySelectorAll('img.printed').length") == 0  # afterwards


def test_without_webgl_the_page_has_all_but_the_picture(folder, buildings):
    browser = start_browser(webgl=False)
    try:
        browser.open(folder / "report.html", "#building=" + quote(NAMES[1]))
        browser.wait(OPEN)
        check_sums(browser, buildings.loc[NAMES[1]])
        seen = [f"document.getElementById('building-{name}')" for name in ("picture", "surfaces")]
        assert browser.run(f"[{', '.join(seen)}].map((part) => part.checkVisibility())") == [
            False,
            True,
        ]
    finally:
        browser.close()


def test_the_report_is_printed_with_a_picture_and_all_tables(page):
    page.run("location.hash = ''")
    page.wait(f"!{OPEN}")
    folded = page.run("document.querySelectorAll('details').length")
    page.run("window.dispatchEvent(new Event('beforeprint'))")
    assert page.run("document.querySelectorAll('details[open]').length") == folded > 0
    page.call("Emulation.setEmulatedMedia", media="print")
    seen = "document.querySelector('{}').checkVisibility()"
    assert page.run(seen.format("img.printed")) and page.run(seen.format("#city-buildings"))
    assert not page.run(seen.format("#city-view")) and not page.run(seen.format("#city-tools"))
    # The copy is no empty picture.
    page.wait("document.querySelector('img.printed').complete")
    pixels = (
        "(() => { const copy = document.createElement('canvas').getContext('2d');"
        "copy.drawImage(document.querySelector('img.printed'), 0, 0, 300, 150);"
        "return new Set(copy.getImageData(0, 0, 300, 150).data).size; })()"
    )
    assert page.run(pixels) > 5
    titles = "[...document.querySelectorAll('h2, h3, summary')]"
    assert set(page.run(f"{titles}.map((title) => getComputedStyle(title).breakAfter)")) == {
        "avoid"
    }
    page.call("Emulation.setEmulatedMedia", media="")
    page.run("window.dispatchEvent(new Event('afterprint'))")
    assert page.run("document.querySelectorAll('details[open]').length") < folded
    assert count_pages(page.print()) > 1


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        """Say nothing."""


@pytest.mark.parametrize("private", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_a_map_loads_the_tile_of_the_building(browser, folder, buildings, private, tmp_path):
    options = ["--private"] * private
    assert main(["site", str(folder), "--out", str(tmp_path / "web"), "--quiet", *options]) == 0
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=tmp_path / "web"))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        name = "Building 2" if private else NAMES[1]
        address = f"http://127.0.0.1:{server.server_port}/index.html#building="
        browser.complaints.clear()
        browser.call("Page.navigate", url=address + quote(name, safe=""))
        browser.wait("document.querySelectorAll('#building-surfaces a').length > 12")
        title = browser.run(TEXT.format("title"))
        assert title == name
        check_sums(browser, buildings.loc[NAMES[1]])
        texts = " ".join(path.read_text() for path in (tmp_path / "web" / "buildings").iterdir())
        assert (NAMES[1] in texts) is not private and browser.complaints == []
        assert count_pages(browser.print()) == 1
    finally:
        server.shutdown()
        server.server_close()
