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
