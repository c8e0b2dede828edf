"""The troubleshooting page lists every message of the source, and what is raised is what it lists."""

import importlib.util
import re
from pathlib import Path

import pytest

from citypv.core.commands.command_line import main
from citypv.core.settings.errors import InputError

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tool():
    """tools/list_messages.py as a module."""
    spec = importlib.util.spec_from_file_location("list_messages", ROOT / "tools/list_messages.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.once
def test_every_message_of_the_source_is_listed(tool):
    text = (ROOT / "docs/troubleshooting.md").read_text("utf-8")
    listed = text.partition(tool.START)[2].partition(tool.END)[0]
    missing = set(tool.write_list().splitlines()) ^ set(listed.splitlines())
    assert not missing, f"type: python tools/list_messages.py ({sorted(missing)[:3]})"


@pytest.mark.once
def test_few_messages_escape_the_list(tool):
    """Nearly every place that raises one is found; the others pass on a message that is listed elsewhere."""
    sources = [path.read_text("utf-8") for room in tool.ROOMS for path in (ROOT / room).rglob("*.py")]
    raised = sum(len(re.findall(r"(?:raise|return) InputError\(", source)) for source in sources)
    assert len(tool.collect_messages()) > 0.95 * raised > 200


def test_what_commands_say_is_in_the_list(tool, tmp_path, capsys):
    commands = (
        *("simulate nowhere.gml OUT", "simulate empty.gml OUT --seed -1", "inspect empty.gml", "inspect broken.gml"),
        *("effects empty.gml --effects nothing=on", "plot folder", "yield empty.gml OUT", "simulate broken.gml OUT"),
        *("world nowhere.nc OUT", "simulate broken.gml OUT --module nothing", "inspect folder"),
    )
    (tmp_path / "empty.gml").touch()
    (tmp_path / "broken.gml").write_text("<a><b></a>")
    (tmp_path / "folder").mkdir()
    patterns = [".*".join(re.escape(part) for part in problem.split("…")) for _, problem, _ in tool.collect_messages()]
    patterns = [pattern for pattern in patterns if len(pattern) > 12]
    for command in commands:
        words = [str(tmp_path / word) if "." in word or word == "folder" else word for word in command.split()]
        words = [part for word in words for part in (["--out", str(tmp_path / "out")] if word == "OUT" else [word])]
        assert main(words) == 2, command
        told = capsys.readouterr().err.strip().splitlines()[-1].removeprefix("citypv: error: ")
        assert any(re.search(f": {pattern}; ", told) for pattern in patterns), told


def test_an_error_knows_its_parts():
    with pytest.raises(InputError, match="a: b; c") as told:
        raise InputError("a", "b", "c")
    assert (told.value.source, told.value.problem, told.value.cure) == ("a", "b", "c")
