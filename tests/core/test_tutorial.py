"""Every command of the tutorial runs, on a small city in place of Berlin; what it links to and shows is there."""

import re
import shlex
from pathlib import Path

from small_city import write_small_city
from weathers import ERA5

from citypv.core.commands.command_line import main

ROOT = Path(__file__).parents[2]
TUTORIAL = ROOT / "docs/tutorial.md"
CITY, WEATHER = "examples/berlin/berlin_3910_5817.gml", "examples/berlin/era5_berlin_2017.nc"


def test_its_commands_run_one_after_the_other(tmp_path, monkeypatch, capsys):
    blocks = re.findall(r"```sh\n(.*?)```", TUTORIAL.read_text("utf-8"), re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    assert len(lines) >= 4 and all(line.startswith("citypv ") for line in lines)
    assert (ROOT / CITY).is_file() and ERA5.samefile(ROOT / WEATHER)
    write_small_city(tmp_path / "city.gml")
    monkeypatch.chdir(tmp_path)
    for line in lines:
        words = shlex.split(line.replace(CITY, "city.gml").replace(WEATHER, str(ERA5)))[1:]
        cheap = ["--samples", "16", "--shadow-samples", "1", "--suns", "days:1"] if words[0] == "simulate" else []
        assert main([*words, *cheap]) == 0, line
    capsys.readouterr()
    assert (tmp_path / "results/tutorial/report.html").is_file()
    assert (tmp_path / "results/tutorial_climate/summary.json").is_file()


def test_its_pictures_and_links_are_there():
    for name in ("tutorial.md", "troubleshooting.md", "installation.md"):
        places = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", (ROOT / "docs" / name).read_text("utf-8"))
        assert places
        for place in places:
            assert (ROOT / "docs" / place).is_file(), place
