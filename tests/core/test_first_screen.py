"""What report and map show before anyone scrolls: how much, how sure, where; and the search."""

import json
import re
import shutil
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pandas as pd
import pytest
from lxml import html

from citypv.core.commands.command_line import main
from citypv.core.results import words
from citypv.core.results.headline import compose_headline, describe_certainty
from citypv.core.results.read_results import read_results, town_of
from citypv.core.results.site_store import search_keys

TOTALS = {
    "layout": "rows",
    "module_count": 12345.4,
    "module_area": 20000.6,
    "kwp": 4000.0,
    "area_per_kwp": 5.0,
    "mwh_per_year": 3200.0,
    "kinds": {"facade": {"mwh_per_year": 800.0}},
}
SUMMARY = {
    "totals": TOTALS,
    "settings": {"losses": 14.0, "inverter": None},
    "weather": {"label": "ERA5", "years": 1.0},
    "error_budget": {"sampling_total": 0.3, "sun_sampling": {"bias": -0.4}},
}
ACCENTS = ("Große Straße", "GROSSE STRASSE 12", "große straße 12, halle", "straße", "old MILL")


def cards(summary):
    """Title, figure and words of each card: list of list of str."""
    tree = html.fragment_fromstring(compose_headline(summary), create_parent="div")
    return [[part.text_content().strip() for part in card] for card in tree.find_class("card")]


def test_four_numbers_are_those_of_the_totals():
    modules, power, energy, shares = cards(SUMMARY)
    assert modules[1:] == ["12,345", "20,001 m² on roofs and facades"]
    assert power[1:] == ["4,000 kWp", "5.00 m² for each kWp"]
    assert energy[1:] == ["3.20 GWh", "800 kWh for each kWp"]
    assert shares[1] == "75 : 25 %" and shares[-1] == "2,400 MWh and 800 MWh"
    with words.speaking("de"):
        assert [card[1] for card in cards(SUMMARY)] == [
            "12.345",
            "4.000 kWp",
            "3,20 GWh",
            "75 : 25 %",
        ]
    nothing = TOTALS | {"kwp": 0.0, "mwh_per_year": 0.0, "module_count": 0.0, "kinds": {}}
    assert [card[1] for card in cards(SUMMARY | {"totals": nothing})][2:] == ["0.00 MWh", "–"]


def test_how_sure_says_what_the_weather_does():
    """0.3 and 0.4 % together are 0.5 %; 8 % of 3.2 GWh less and more are 2.9 and 3.5 GWh."""
    told = describe_certainty(SUMMARY)
    assert "up to 8 %: a dull year may bring 2.9 GWh, a sunny one 3.5 GWh." in told
    assert "known to ± 0.50 %." in told
    years = {"p90_mwh_per_year": 900.04, "p50_mwh_per_year": 1000.0}
    weather = {"label": "PVGIS", "years": 19.0}
    told = describe_certainty(SUMMARY | {"totals": TOTALS | years, "weather": weather})
    assert "Of the 19 years of the weather, nine of ten bring at least 900.0 MWh." in told
    told = describe_certainty(SUMMARY | {"weather": {"label": "climatology"}, "error_budget": {}})
    assert "not a measurement" in told and "this run does not tell" in told


def test_the_town_is_that_of_most_addresses():
    assert town_of(["A 1, Halle; B 2, Ulm", "B 1, Halle", "C 3, Ulm", "", "D 4, Halle"]) == "Halle"
    assert town_of(["A 1, Halle", "B 2", "C 3"]) == town_of([]) == town_of([""]) == ""


def test_a_building_is_found_by_each_word_but_the_town():
    assert search_keys(
        "B_1", "Große Straße 12, Halle; Am Öhr 3", "", "Büro-Haus (1120)", "1904"
    ) == {
        *("b_1", "grosse strasse 12, halle", "strasse 12, halle", "am ohr 3", "ohr 3"),
        *("buro-haus (1120)", "haus (1120)", "1904"),
    }


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def pages(small_results, tmp_path_factory):
    """Addresses of the report and of the map of three houses, one of which has an address."""
    out = tmp_path_factory.mktemp("pages") / "web"
    assert main(["site", str(small_results), "--out", str(out), "--quiet"]) == 0
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=out))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield {
        "report": (small_results / "report.html").as_uri(),
        "map": f"http://127.0.0.1:{server.server_port}/index.html",
    }
    server.shutdown()
    server.server_close()


def look_at(chromium, address):
    chromium.requests.clear()
    chromium.complaints.clear()
    chromium.call("Page.navigate", url=address)
    chromium.wait("document.querySelector('#city-buildings tbody tr') !== null")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report", "map"])
def test_a_street_leads_to_its_building_whatever_the_accents(chromium, pages, small_results, name):
    look_at(chromium, pages[name])
    assert chromium.run("document.querySelector('h1').textContent").endswith("Halle")
    for text in ACCENTS:
        chromium.run("byId('search').value = ''; byId('search').focus()")
        chromium.call("Input.insertText", text=text)
        chromium.wait("byId('hits').children.length === 1")
        assert chromium.run("byId('hits').querySelector('b').textContent") == "Große Straße 12"
    chromium.press("Enter")
    chromium.wait("chosen.building >= 0")
    told = chromium.run("byId('chosen').innerText")
    assert "Große Straße 12" in told and "Old mill" in told and "1904" in told
    assert chromium.run("document.querySelector('#city-chosen p button').textContent") == "a"
    # The camera flies to the house, which lies within 12 m of the origin's corner of the city.
    chromium.wait("view.camera.position.distanceTo(view.controls.target) < 120")
    # Energy and power are those of buildings.csv to the last digit that is shown.
    one = pd.read_csv(small_results / "buildings.csv", index_col="building_id").loc["a"]
    row = "rowOf(chosen.building)"
    shown = chromium.run(f"[format({row}.kwp, 1), format({row}.mwh, 2)]")
    assert shown == [f"{one.kwp:,.1f}", f"{one.mwh_per_year:,.2f}"]
    assert chromium.complaints == []
    # Without accents in the way, what nobody is called finds nothing, and that is said.
    chromium.run("byId('search').value = ''; byId('search').focus()")
    chromium.call("Input.insertText", text="nowhere")
    chromium.wait("byId('hits').children.length === 0")
    assert chromium.run("[chosen.building, byId('best-title').textContent]") == [
        -1,
        "Nothing is called so.",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report", "map"])
def test_the_first_screen_fits_and_sums_are_the_tables(chromium, pages, small_results, name):
    """The three answers stand on one screen, and cards, table and curve tell the same sums."""
    totals = json.loads((small_results / "summary.json").read_text("utf-8"))["totals"]
    for width, height in ((1400, 900), (768, 1024), (375, 812)):
        chromium.resize(width, height)
        look_at(chromium, pages[name])
        assert chromium.run("document.documentElement.scrollWidth") == width
        bottom = "(part) => part.getBoundingClientRect().bottom"
        for part in ("document.querySelector('.cards')", "document.querySelector('.sure')"):
            assert chromium.run(f"({bottom})({part})") < height
        assert chromium.run(f"({bottom})(byId('search'))") < height
        assert chromium.run("byId('view').getBoundingClientRect().top") < height - 100
    chromium.resize(1200, 900)
    figures = chromium.run("[...document.querySelectorAll('.figure')].map((one) => one.innerText)")
    whole = [f"{totals['kwp']:,.0f}"]
    assert re.sub(r"\D", "", figures[0]) == f"{totals['module_count']:.0f}"
    assert figures[1].split()[0] == whole[0]
    assert chromium.run("byId('sums').tBodies[0].rows[2].innerText").split("\t")[1:2] == whole[:1]
    text = chromium.run("document.body.innerText")
    left = re.search(r"([\d,]+) kWp and ([\d,.]+) MWh a year are left, 100 %", text).groups()
    assert left[0] == whole[0]
    assert float(left[1].replace(",", "")) == pytest.approx(totals["mwh_per_year"], rel=0.005)
    assert f"{totals['mwh_per_year']:,.2f} MWh" in text


@pytest.mark.slow
def test_a_page_has_its_language_and_private_results_no_addresses(small_results, tmp_path):
    folder = tmp_path / "de"
    shutil.copytree(small_results, folder)
    assert main(["plot", str(folder), "--language", "de", "--quiet"]) == 0
    page = (folder / "report.html").read_text("utf-8")
    assert '<html lang="de">' in page and "Content-Security-Policy" in page
    change = tmp_path / "change"
    command = ["compare", str(folder), str(folder), "--language", "de", "--out", str(change)]
    assert main(command) == 0
    page = html.document_fromstring((change / "report.html").read_text("utf-8"))
    assert page.get("lang") == "de" and page.xpath("//h1")[0].text == "Vergleich: de und de"
    mwh = json.loads((folder / "summary.json").read_text("utf-8"))["totals"]["mwh_per_year"]
    row = [cell.text_content() for cell in page.xpath("(//table)[1]/tbody/tr[last()]/td")]
    assert row[:5] == ["Alle", "3", *2 * [f"{mwh:.2f}".replace(".", ",")], "0,00"]
    out = tmp_path / "web"
    assert main(["site", str(folder), "--out", str(out), "--private", "--quiet"]) == 0
    whole = b"".join(path.read_bytes() for path in out.rglob("*.json"))
    whole += (out / "index.html").read_bytes()
    assert not any(text.encode() in whole for text in ("Straße", "strasse", "Old mill", "Halle"))


def test_a_folder_of_an_earlier_version_has_sums_and_no_texts(small_results, tmp_path):
    folder = tmp_path / "earlier"
    shutil.copytree(small_results, folder)
    table = pd.read_csv(folder / "buildings.csv")
    table.drop(columns=["address", "name", "function", "year"]).to_csv(
        folder / "buildings.csv", index=False
    )
    buildings = read_results(folder).buildings
    assert (buildings[["address", "name", "function", "year"]] == "").all(axis=None)
    assert buildings["kwp"].tolist() == table.sort_values("building_id")["kwp"].tolist()
