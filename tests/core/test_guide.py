"""Commands and blocks of Python in the guide run, on a small city in place of Berlin; what pages
link to is there.
"""

import re
import shlex
from pathlib import Path

import pytest
from small_city import write_small_city
from weathers import ERA5

import citypv
from citypv.core.commands.command_line import build_parser, main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted((DOCS / "guide").glob("*.md"))
CITY, WEATHER = "examples/berlin/berlin_3910_5817.gml", "examples/berlin/era5_berlin_2017.nc"
OF_BERLIN = "BLDG_000300000023ee16"
QUICK = {"samples": 16, "shadow_samples": 1, "suns": "days:1"}
BLOCK = re.compile(r"(<!-- (.*?) -->\n)?```(\w+)\n(.*?)```", re.DOTALL)


def blocks(page, language):
    """Blocks of a page that are not marked as not run, or as run elsewhere."""
    found = BLOCK.findall(page.read_text("utf-8"))
    return [
        text
        for _, mark, name, text in found
        if name == language and not mark.startswith(("not run", "run in"))
    ]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a small city, whose first building takes the place of the one in Berlin."""
    write_small_city(tmp_path / "city.gml")
    monkeypatch.chdir(tmp_path)
    assert (
        (ROOT / CITY).is_file()
        and ERA5.samefile(ROOT / WEATHER)
        and OF_BERLIN in (ROOT / CITY).read_text("utf-8")
    )
    building = (
        citypv.simulate("city.gml", weather="climate", **QUICK).buildings["building_id"].iloc[0]
    )
    return {CITY: "city.gml", WEATHER: str(ERA5), OF_BERLIN: building}


def replaced(text, places):
    for old, new in places.items():
        text = text.replace(old, new)
    return text


def run_commands(page, places):
    """Run the commands of a page."""
    ran = 0
    for text in blocks(page, "sh"):
        for line in replaced(text.replace("\\\n", " "), places).splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] != ["citypv"]:
                continue
            costly = words[1] in ("simulate", "effects", "accuracy")
            cheap = (
                [f"--{name.replace('_', '-')}={value}" for name, value in QUICK.items()]
                if costly
                else []
            )
            # Rays follow from a target, and one day of suns leaves more than any target asks for.
            cheap = [] if "--target-error" in words else cheap
            assert main([*words[1:], *cheap]) == 0, line
            ran += 1
    return ran


@pytest.mark.slow
@pytest.mark.parametrize("names", [("tutorial", "your_plant", "variants"), ("command_line",)])
def test_commands_run_one_after_the_other(names, folder, capsys):
    for name in names:  # two pages go on from the tutorial
        assert run_commands(DOCS / f"guide/{name}.md", folder) >= 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.slow
def test_blocks_of_python_run(folder):
    text = "".join(blocks(DOCS / "guide/python.md", "python"))
    cheap = ", ".join(f"{name}={value!r}" for name, value in QUICK.items())
    space = {}
    exec(replaced(text, folder).replace('preset="draft"', cheap), space)
    assert len(space["change"].buildings) == len(space["result"].buildings)


def test_every_block_is_run_or_marked():
    """Blocks of other pages than those above are marked, with the reason."""
    for page in PAGES:
        if page.stem not in (
            "tutorial",
            "command_line",
            "your_plant",
            "variants",
            "python",
            "install",
        ):
            assert not blocks(page, "sh") + blocks(page, "python"), page


def test_pages_name_no_option_that_is_not_there():
    words = set()
    for command in next(
        one for one in build_parser()._actions if one.dest == "==SUPPRESS=="
    ).choices.values():
        words.update(command._option_string_actions)
    for page in [*DOCS.rglob("*.md"), ROOT / "README.md"]:
        text = re.sub(r"```.*?```|\]\([^)]*\)", "", page.read_text("utf-8"), flags=re.DOTALL)
        for line in text.splitlines():
            if (
                "blender" not in line
                and "dask" not in line
                and "python " not in line
                and "pytest" not in line
            ):
                for option in re.findall(r"`[^`]*?(--[a-z][a-z-]+)", line):
                    assert option in words | {"--version", "--target-eror"}, (page.name, option)


def test_pictures_and_links_are_there():
    for page in [*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        for place in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text("utf-8")):
            assert place.startswith("https://") or (page.parent / place).is_file(), (
                page.name,
                place,
            )
