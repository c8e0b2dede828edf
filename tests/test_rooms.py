"""The rooms and what may pass between them."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("core", "operators", "citypv_addon")
SCRIPTS = [ROOT / "__init__.py", ROOT / "__main__.py"]
SCRIPTS += [path for room in (*ROOMS, "tests", "tools", "benchmarks") for path in sorted((ROOT / room).rglob("*.py"))]
BLENDER = {"bpy", "bmesh", "mathutils", "bpy_extras", "gpu", "gpu_extras", "blf", "addon_utils"}
FORBIDDEN = {"core": BLENDER | {"operators", "citypv_addon", "citypv"}}
ALLOWED = {
    "operators": BLENDER | {"numpy", "core", "operators", "__main__"},
    "citypv_addon": BLENDER | {"operators", "citypv_addon"},
}

# The rooms of core in the order in which they build on each other: each imports from those before it, never from those
# after it. Files of core itself stand between the rooms.
LAYERS = (
    *(
        "version",
        "errors",
        "progress",
        "threads",
        "check_arrays",
        "settings",
        "city_settings",
        "system_settings",
        "methods",
        "presets",
        "request",
        "interruption",
    ),
    *("rays", "sampling", "compiling", "city", "trees", "ground", "files", "scene", "racks", "materials", "patches"),
    *(
        "sun",
        "horizon",
        "climate",
        "sky",
        "effects",
        "transfer",
        "form_factors",
        "radiosity",
        "photons",
        "weather",
        "energy",
        "accuracy",
        "timeline",
        "results",
        "world",
        "plots",
        "study",
        "cluster",
        "selfcheck",
        "commands",
    ),
)


def read_imports(path):
    """Yield (level, dotted target seen from the root) of each import anywhere in the file."""
    package = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((0, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield 0, node.module
        elif isinstance(node, ast.ImportFrom):
            base = [*package[: len(package) - node.level + 1], *([node.module] if node.module else [])]
            yield from ((node.level, ".".join([*base, name.name])) for name in node.names)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_it_may(room):
    files = sorted((ROOT / room).rglob("*.py"))
    assert files
    for path in files:
        for level, target in read_imports(path):
            first = target.split(".")[0]
            assert level <= 2, f"{path}: {target} reaches deeper than '..'"
            assert first not in FORBIDDEN.get(room, set()), f"{path} imports {target}"
            if room in ALLOWED:
                assert first in ALLOWED[room] | sys.stdlib_module_names, f"{path} imports {target}"


def test_imports_inside_core_run_one_way():
    for path in sorted((ROOT / "core").rglob("*.py")):
        own = path.relative_to(ROOT / "core").with_suffix("").parts[0]
        if own == "__init__":
            continue
        for level, target in read_imports(path):
            room = target.split(".")[1] if level and target.startswith("core.") else own
            assert LAYERS.index(room) <= LAYERS.index(own), f"{path}: {own} imports {target}"
            loose = (ROOT / "core" / f"{own}.py").exists()
            assert room != own or not loose or not level, f"{path} imports itself"


def test_a_room_says_what_it_is_for_and_can_be_taken_in():
    for folder in sorted({path.parent for path in (ROOT / "core").rglob("*.py")}):
        text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8")))
        assert folder.name == "core" or ("In:" in text and "Out:" in text and "Read first:" in text), folder
        if folder.name != "files":
            assert len(list(folder.glob("*.py"))) <= 21, f"{folder}: more than 20 files beside __init__.py"


def test_reading_the_package_imports_nothing():
    """Blender, pytest and pip all import the root; core's folders are imported for single files."""
    for path in [ROOT / "__init__.py", *(ROOT / "core").rglob("__init__.py")]:
        top = ast.parse(path.read_text("utf-8")).body
        assert not [node for node in top if isinstance(node, ast.Import | ast.ImportFrom)], path


def test_no_room_is_deeper_than_one_folder_and_pip_knows_each():
    packages = {path.parent.relative_to(ROOT) for room in ROOMS for path in (ROOT / room).rglob("*.py")}
    assert max(len(package.parts) for package in packages) <= 2
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]["packages"]
    assert set(listed) == {"citypv", *(".".join(["citypv", *package.parts]) for package in packages)}


def test_versions_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text("utf-8"))
    version = (ROOT / "core" / "settings" / "version.py").read_text("utf-8")
    stated = re.search(r'^__version__ = "(.+)"$', version, re.MULTILINE)
    changes = re.search(r"^## (.+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert project["version"] == manifest["version"] == stated[1] == changes[1]


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_is_one_finished_idea(path):
    text = path.read_text("utf-8")
    assert text.count("\n") <= 350
    assert not re.search(r"/(?:home|root|work|Users)/|\b(?:TO" r"DO|FIX" r"ME|XX" r"X)\b", text)
