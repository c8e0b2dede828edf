"""Helpers beside the tests can be imported by their names; a small city and a year that many tests
begin with.
"""

import sys
from functools import cache, partial
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def city(tmp_path_factory):
    """A file of three houses."""
    from small_city import write_small_city

    return write_small_city(tmp_path_factory.mktemp("city") / "small.gml")


@pytest.fixture(scope="session")
def small_results(traced_once):
    """Folder of a quick run of three houses, with all exports and a report; ../city.gml is what it
    read.
    """
    from small_city import FAST, write_small_city

    from citypv.core.commands.command_line import main

    def simulate(folder):
        city, out = write_small_city(folder / "city.gml"), folder / "Tom & Co"
        exports = ["--cityjson", "--gltf", "--geopackage"]
        assert main(["simulate", str(city), "--out", str(out), *exports, *FAST]) == 0
        assert main(["plot", str(out), "--quiet"]) == 0
        return out

    return traced_once("small_results", simulate)


@pytest.fixture
def small_blocks(monkeypatch):
    """Suns are traced and kept sixteen by sixteen."""
    from citypv.core.light import sun_blocks

    monkeypatch.setattr(sun_blocks, "SUNS_PER_BLOCK", 16)


@pytest.fixture
def refused(capfd):
    """Run a command that must fail with one line, which is returned."""
    from citypv.core.commands.command_line import main

    def run(*arguments):
        capfd.readouterr()
        assert main([*map(str, arguments)]) == 2
        said = capfd.readouterr().err
        assert said.startswith("citypv") and ": error: " in said and said.count("\n") == 1
        return said

    return run


@pytest.fixture(scope="module")
def chromium():
    """A page of a browser, for all tests of a file."""
    from browser import start_browser

    browser = start_browser()
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def base_of(tmp_path_factory):
    """Cities of the tests of edits and their bases, by name; each is traced once."""
    from test_edit_light import make_base

    return cache(partial(make_base, folder=tmp_path_factory.mktemp("bases")))


@pytest.fixture(scope="module")
def berlin():
    """The weather of 2017 in Berlin."""
    from weathers import BERLIN, ERA5

    from citypv.core.weather.read_weather import read_weather

    return read_weather(ERA5, *BERLIN)
