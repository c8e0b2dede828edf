"""Report and map in German: every text that the code says has its German, and what a browser shows
has no English left.
"""

import ast
import importlib
import re

import pandas as pd
import pytest
from browser import start_browser
from small_city import FAST, write_small_city
from test_districts import EASTERN, WEST, write_map

from citypv.__main__ import main
from citypv.core.city.classify import SMALLEST_ELIGIBLE_AREA
from citypv.core.energy.counted_area import REASONS
from citypv.core.results import words

RESULTS = words.WEB.parent


def flatten(value):
    """Texts of a value, of the values of a table, or of what a list holds."""
    if isinstance(value, str):
        return {value} - {""}
    values = value.values() if isinstance(value, dict) else value
    return {text for own in values if not callable(own) for text in flatten(own)}


def said_by(path):
    """Texts that a Python file says: literals, and those of constants of its module."""
    module = importlib.import_module(f"citypv.core.results.{path.stem}")
    said = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
            continue
        chosen = {"say": node.args[:1], "say_count": node.args[1:3]}.get(node.func.id, [])
        while chosen:
            own = chosen.pop()
            if isinstance(own, ast.Constant):
                said.add(own.value)
            elif isinstance(own, ast.IfExp):
                chosen += [own.body, own.orelse]
            elif isinstance(own, ast.Subscript):
                chosen.append(own.value)
            elif isinstance(own, ast.Name) and own.id.isupper():
                said |= flatten(getattr(module, own.id))
    return said


@pytest.mark.parametrize("code", words.list_languages()[1:])
def test_every_text_that_is_said_has_a_line(code):
    said = set().union(*map(said_by, RESULTS.glob("*.py")))
    for path in words.WEB.glob("[!t]*.js"):
        said |= set(re.findall(r'\bsay\("([^"]+)"', path.read_text("utf-8")))
    for path in words.WEB.glob("*.html"):
        parts = re.findall(r"\{\{(.+?)\}\}", path.read_text("utf-8"), re.DOTALL)
        said |= {" ".join(part.split()) for part in parts}
    said |= flatten(REASONS)
    assert len(said) > 250 and said <= set(words.read_language(code))
    assert f"than {SMALLEST_ELIGIBLE_AREA:g} m²" in REASONS["small"]


@pytest.fixture(scope="module")
def traced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("german") / "stadt"
    city = write_small_city(folder.with_suffix(".gml"))
    districts = write_map(folder.with_suffix(".geojson"), [WEST, EASTERN], ["Mitte", "Neustadt"])
    command = ["simulate", str(city), "--out", str(folder), *FAST]
    assert main([*command, "--districts", str(districts)]) == 0
    return folder


def words_of(texts, least=1):
    """Words of at least so many letters in some texts: set of str."""
    pattern = rf"[^\W\d_]{{{least},}}"
    return {word for text in texts for word in re.findall(pattern, text)}


class Recording(dict):
    """A table that keeps what it was asked for and lacks."""

    missed = ()

    def get(self, text, default=None):
        if text not in self:
            self.missed = {*self.missed, text}
        return super().get(text, default)


@pytest.mark.slow
def test_all_that_pages_say_is_in_the_table(traced, tmp_path, monkeypatch):
    """Texts that are not literals, too: kinds, reasons, choices of settings."""
    table = Recording(words.read_language("de"))
    monkeypatch.setattr(words, "read_language", {"en": {}, "de": table}.get)
    assert main(["plot", str(traced), "--language", "de", "--quiet"]) == 0
    assert main(["site", str(traced), "--out", str(tmp_path), "--language", "de", "--quiet"]) == 0
    # What was said already is German.
    german = words_of(table.values())
    assert [text for text in table.missed if not words_of([text]) <= german] == []
    for page in (traced / "report.html", tmp_path / "index.html"):
        assert '<html lang="de"' in page.read_text("utf-8")


SHOWN = """[...document.querySelectorAll("body *")].filter((one) => !one.closest("script, style, [lang=en]"))
  .flatMap((one) => [...one.childNodes].filter((part) => part.nodeType === 3).map((part) => part.data)
    .concat(["aria-label", "alt", "title", "placeholder", "aria-valuetext"].map((name) => one.getAttribute(name))))
  .filter((text) => text && /\\p{L}{3}/u.test(text)).map((text) => text.replace(/\\s+/g, " ").trim())"""


def shown(browser, page):
    """All texts of a page, of a building and a surface that are chosen, and of a building's page."""
    browser.open(page)
    texts = set(browser.run(SHOWN))
    acts = (
        "chooseBuilding(0)",
        "chooseSurface(1)",
        "chooseBuilding(-1)",
        "location.hash = '#building=a'",
    )
    for act in acts:
        browser.run(act)
        browser.run("new Promise((done) => setTimeout(done, 100))")
        texts |= set(browser.run(SHOWN))
    assert browser.complaints == []
    return texts


@pytest.mark.slow
def test_no_english_is_left_in_a_browser(traced):
    """What both languages show alike consists of names and of words that German has."""
    browser, pages = start_browser(webgl=False), {}
    try:
        for code in ("en", "de"):
            assert main(["plot", str(traced), "--language", code, "--quiet"]) == 0
            pages[code] = shown(browser, traced / "report.html")
        zoom = browser.run("getComputedStyle(document.documentElement).display")
        assert browser.run("document.documentElement.lang") == "de" and zoom == "block"
        figures = browser.run(
            "[...document.querySelectorAll('.figure')].map((one) => one.innerText)"
        )
    finally:
        browser.close()
    table = words.read_language("de")
    names = {
        traced.name,
        "CityPV",
        "SunPower",
        "SPR",
        "WHT",
        "EPSG",
        "kWp",
        "MWh",
        "Mitte",
        "Neustadt",
    }
    told = pd.read_csv(traced / "buildings.csv", dtype=str, keep_default_na=False)
    named = [*told[["building_id", "address", "name", "function"]].to_numpy().ravel()]
    named += pd.read_csv(traced / "faces.csv", dtype=str)["surface_id"].tolist()
    left = words_of(pages["en"] & pages["de"], 3) - words_of([*table.values(), *names, *named])
    assert len(pages["de"]) > 150 and left == set()
    assert any(re.search(r"\d,\d", text) for text in figures)
