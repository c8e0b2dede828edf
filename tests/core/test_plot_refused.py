"""What `citypv plot` cannot draw ends in one line, and nothing is written."""

import shutil
import sys

import pytest
from small_city import write_small_city

from citypv.core.commands.command_line import main

FAST = ["--suns", "typical-days:1", "--samples", "16", "--shadow-samples", "4", "--max-bounces", "1", "--quiet"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("refused")
    city = write_small_city(place / "city.gml")
    assert main(["simulate", str(city), "--out", str(place / "out"), *FAST]) == 0
    return place / "out"


SPOIL = {
    "no summary": ("summary.json", None),
    "no faces": ("faces.csv", None),
    "no groups": ("groups.csv", None),
    "no time series": ("timeseries.nc", None),
    "summary cut": ("summary.json", lambda text: text[: len(text) // 2]),
    "summary of something else": ("summary.json", lambda text: '{"weather": {}}'),
    "no place": ("summary.json", lambda text: text.replace('"latitude"', '"breadth"')),
    "a column less": ("groups.csv", lambda text: text.replace("full_load_hours", "hours")),
    "a word for a number": ("groups.csv", lambda text: text.replace("annual,,", "annual,,many")),
    "a row twice": ("groups.csv", lambda text: text + text.splitlines()[-1] + "\n"),
    "an empty table": ("faces.csv", lambda text: ""),
    "a time series that is none": ("timeseries.nc", lambda text: "nothing"),
    "other groups": ("groups.csv", lambda text: text.replace("facade", "fassade")),
    "a Transfer that is none": ("transfer.nc", lambda text: "nothing"),
    "another city": ("faces.csv", lambda text: text.replace("a_south", "z_south")),
}


@pytest.mark.parametrize("name", SPOIL)
def test_a_spoilt_folder_ends_in_one_line(name, folder, tmp_path, capfd):
    shutil.copytree(folder, tmp_path / "bad", ignore=shutil.ignore_patterns("report.html"))
    file, change = SPOIL[name]
    path = tmp_path / "bad" / file
    text = path.read_text(encoding="utf-8", errors="replace")
    path.unlink()
    if change:
        assert change(text) != text
        path.write_text(change(text), encoding="utf-8")
    assert main(["plot", str(tmp_path / "bad")]) == 2
    said = capfd.readouterr().err
    culprit = "timeseries.nc" if name == "other groups" else "transfer.nc" if name == "another city" else file
    assert culprit in said and said.count("\n") == 1
    assert not list((tmp_path / "bad").glob("*report*"))


def test_what_is_no_folder_of_results_ends_in_one_line(folder, tmp_path, capfd):
    for place in (tmp_path / "nowhere", tmp_path, folder / "faces.csv"):
        assert main(["plot", str(place)]) == 2
        said = capfd.readouterr().err
        assert str(place) in said and said.count("\n") == 1


def test_without_matplotlib_one_line_tells_how_to_get_it(folder, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["plot", str(folder)]) == 2
    said = capfd.readouterr().err
    assert "matplotlib" in said and "type: pip install matplotlib" in said and said.count("\n") == 1
