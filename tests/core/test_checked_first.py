"""Arguments that mean nothing are refused before any file of buildings is read."""

import pytest

from citypv.core.commands.command_line import main


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (None, "cannot be read"),
        ("", "the file is empty"),
        ("some words without meaning\n", "is not in a known weather format"),
    ],
)
def test_a_bad_weather_file_is_refused_before_the_city_is_read(tmp_path, capsys, content, problem):
    """The city is not even there: what is said is said of the weather."""
    path = tmp_path / "year.epw"
    if content is not None:
        path.write_text(content)
    given = ["simulate", str(tmp_path / "nowhere.gml"), "--weather", str(path), "--out", str(tmp_path / "out")]
    assert main(given) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"citypv: error: {path}: {problem}")
    assert "nowhere.gml" not in told
    assert not (tmp_path / "out").exists()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with files that mean nothing as a horizon."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "albedo.csv").write_text("surface,material\nroof,mirror\n", encoding="utf-8")
    grid = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n"
    (tmp_path / "heights.asc").write_text(grid, encoding="utf-8")
    for name in ("mesh.obj", "city.gml"):
        (tmp_path / name).write_text("v 0 0 0\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("command", ["simulate", "effects", "accuracy"])
@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        (["--estimator", "forward", "--effects", "sky-rays=off"], "--effects: sky-rays=off is for gather only"),
        (["--effects", "terrain-horizon=on"], "--effects: terrain-horizon needs a horizon; give --horizon FILE"),
        (["--albedo-file", "albedo.csv"], "albedo.csv: line 2: mirror needs an albedo; give one"),
        (["--horizon", "nowhere.tif"], "nowhere.tif: no such file"),
        (["--horizon", "albedo.csv"], "albedo.csv: has neither two columns nor one"),
        (["--horizon", "heights.asc"], "heights.asc: names no coordinate reference system"),
        (["--horizon", "mesh.obj"], "mesh.obj: is a mesh or a city, from which no horizon is read; give heights"),
    ],
)
def test_what_tracing_lacks_is_told_before_the_city_is_read(folder, capsys, command, settings, problem):
    given = [command, "nowhere.gml", *settings, *(["--out", "out"] if command == "simulate" else [])]
    assert main(given) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"citypv: error: {problem}")
    assert "nowhere.gml" not in told
    assert len(told.splitlines()) == 1
    assert not (folder / "out").exists()
