"""The rooms and what may pass between them."""

import ast
import re
import sys
import tomllib
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

pytestmark = pytest.mark.law

ROOT = Path(__file__).parent.parent
ROOMS = ("core", "operators", "citypv_addon")
BLENDER = {"bpy", "bmesh", "mathutils", "bpy_extras", "gpu", "gpu_extras", "blf", "addon_utils"}
FORBIDDEN = {"core": BLENDER | {"operators", "citypv_addon", "citypv"}}
ALLOWED = {
    "operators": BLENDER | {"numpy", "core", "operators"},
    "citypv_addon": BLENDER | {"operators", "citypv_addon", "__main__"},
}
# who lacks them is told so
OPTIONAL = {
    "dask",
    "distributed",
    "hdf5plugin",
    "matplotlib",
    "osmium",
    "pyarrow",
    "pyogrio",
    "rasterio",
}

# The rooms of core in the order in which they build on each other: each imports from those before
# it, never from those after it.
LAYERS = (
    *(
        "settings",
        "rays",
        "city",
        "read",
        "patches",
        "modules",
        "sun",
        "weather",
        "sky",
        "effects",
        "light",
        "energy",
    ),
    *("accuracy", "results", "world", "run", "commands"),
)
STEPS = ("city", "show", "run")  # the rooms of operators, likewise
LONGEST_FILE = 480  # lines
UNFINISHED = re.compile(r"/(?:home|root|work|Users)/|\b(?:TO" r"DO|FIX" r"ME|XX" r"X)\b")


def list_scripts(*rooms):
    return [
        path.relative_to(ROOT) for room in rooms for path in sorted((ROOT / room).rglob("*.py"))
    ]


def read_text(path):
    return (ROOT / path).read_text("utf-8")


@cache
def parse(path):
    return ast.parse(read_text(path))


@cache
def read_imports(path):
    """(level, dotted target seen from the root) of each import anywhere in the file."""
    return list(find_imports(path, path.parts[:-1]))


def find_imports(path, package):
    for node in ast.walk(parse(path)):
        if isinstance(node, ast.Import):
            yield from ((0, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield 0, node.module
        elif isinstance(node, ast.ImportFrom):
            base = [
                *package[: len(package) - node.level + 1],
                *([node.module] if node.module else []),
            ]
            yield from ((node.level, ".".join([*base, name.name])) for name in node.names)


@pytest.mark.slow
@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_it_may(room):
    files = list_scripts(room)
    assert files
    for path in files:
        for level, target in read_imports(path):
            first = target.split(".")[0]
            assert level <= len(path.parts) - (room == "core"), f"{path}: {target} reaches too deep"
            assert first not in FORBIDDEN.get(room, set()), f"{path} imports {target}"
            if room in ALLOWED:
                assert first in ALLOWED[room] | sys.stdlib_module_names, f"{path} imports {target}"


def test_core_imports_what_the_wheels_bring():
    """Its declared dependencies; llvmlite comes with numba."""
    project = tomllib.loads(read_text("pyproject.toml"))["project"]
    declared = {re.match(r"[\w-]+", text)[0].replace("-", "_") for text in project["dependencies"]}
    known = declared | OPTIONAL | {"llvmlite"} | sys.stdlib_module_names
    for path in list_scripts("core"):
        for level, target in read_imports(path):
            assert level or target.split(".")[0] in known, f"{path} imports {target}"


def test_imports_inside_core_run_one_way():
    for path in list_scripts("core"):
        own = path.with_suffix("").parts[1]
        for level, target in read_imports(path) if own != "__init__" else ():
            room = target.split(".")[1] if level and target.startswith("core.") else own
            assert LAYERS.index(room) <= LAYERS.index(own), f"{path}: {own} imports {target}"


def test_imports_inside_operators_run_one_way():
    used = set()
    for path in list_scripts("operators"):
        for level, target in read_imports(path):
            if level and target.startswith("operators.") and path.name != "__init__.py":
                user, room = path.parts[1], target.split(".")[1]
                assert STEPS.index(room) <= STEPS.index(user), f"{path}: {user} imports {target}"
                used.add((user, room))
    assert {("run", "show"), ("run", "city"), ("show", "city")} <= used


def find_doors():
    """What other folders take from the files of each room: dict of Path to set of "file.name"."""
    doors = defaultdict(set)
    for path in [Path("__init__.py"), Path("__main__.py"), *list_scripts(*ROOMS)]:
        tree, files = parse(path), {}
        for node in ast.walk(tree):
            if not (isinstance(node, ast.ImportFrom) and node.level):
                continue
            base = [*path.parts[: len(path.parts) - node.level], *(node.module or "").split(".")]
            target = Path(*[part for part in base if part])
            for name in node.names:
                if (ROOT / target / f"{name.name}.py").is_file():
                    files[name.asname or name.name] = target / name.name
                elif len(target.parts) == 3 and target.parent != path.parent:
                    doors[target.parent].add(f"{target.name}.{name.name}")
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                file = files.get(node.value.id)
                if file and len(file.parts) == 3 and file.parent != path.parent:
                    doors[file.parent].add(f"{file.name}.{node.attr}")
    return doors


def test_others_come_in_by_the_doors_of_a_room():
    """`DOORS` of its `__init__` names all that other folders take, and nothing else."""
    taken = find_doors()
    for folder in sorted({path.parent for path in list_scripts("core", "operators")}):
        if len(folder.parts) == 2:
            (doors,) = (
                ast.literal_eval(node.value)
                for node in parse(folder / "__init__.py").body
                if isinstance(node, ast.Assign)
            )
            assert [*doors] == sorted(taken[folder]), folder
            assert not [door for door in doors if re.search(r"\._(?!_)", door)], folder


def test_no_file_imports_itself_by_way_of_others():
    names = {".".join(path.with_suffix("").parts): path for path in list_scripts(*ROOMS)}
    found = {}
    for name, path in names.items():
        targets = {target for level, target in read_imports(path) if level}
        found[name] = {
            one for target in targets for one in (target, target.rpartition(".")[0]) if one in names
        }
    TopologicalSorter(found).prepare()  # raises CycleError, which names the circle


def test_a_room_of_core_says_what_it_is_for():
    folders = {path.parent for path in list_scripts("core")} - {Path("core")}
    assert {folder.name for folder in folders} == {*LAYERS}
    for folder in folders:
        text = " ".join(ast.get_docstring(parse(folder / "__init__.py")).split())
        assert "In:" in text and "Out:" in text and "Read first:" in text, folder


def test_reading_the_package_imports_nothing():
    """Blender, pytest and pip all import the root; core's folders are imported for single files."""
    for path in [
        Path("__init__.py"),
        *(path for path in list_scripts("core") if path.name == "__init__.py"),
    ]:
        top = parse(path).body
        assert not [node for node in top if isinstance(node, ast.Import | ast.ImportFrom)], path


def test_no_room_is_deeper_than_one_folder_and_pip_knows_each():
    packages = {path.parent for path in list_scripts(*ROOMS)}
    assert max(len(package.parts) for package in packages) <= 2
    listed = tomllib.loads(read_text("pyproject.toml"))["tool"]["setuptools"]["packages"]
    assert set(listed) == {
        "citypv",
        *(".".join(["citypv", *package.parts]) for package in packages),
    }


def test_versions_agree():
    project = tomllib.loads(read_text("pyproject.toml"))["project"]
    manifest = tomllib.loads(read_text("blender_manifest.toml"))
    (version,) = (path for path in list_scripts("core") if path.name == "version.py")
    stated = re.search(r'^__version__ = "(.+)"$', read_text(version), re.MULTILINE)
    changes = re.split(r"^## (.+)$", read_text("CHANGELOG.md"), flags=re.MULTILINE)
    assert project["version"] == manifest["version"] == stated[1] == changes[1]
    assert re.findall("^### (.+)$", changes[2], re.MULTILINE) == ["Added", "Changed", "Fixed"]


@pytest.mark.slow
def test_every_file_is_one_finished_idea():
    files = [
        Path("__init__.py"),
        Path("__main__.py"),
        *list_scripts(*ROOMS, "tests", "tools", "benchmarks"),
    ]
    texts = {path: read_text(path) for path in files}
    assert not [str(path) for path, text in texts.items() if text.count("\n") > LONGEST_FILE]
    assert not [str(path) for path, text in texts.items() if UNFINISHED.search(text)]


def test_docstrings_can_be_read_alone():
    """None refers to what stands above it in the file."""
    for path in list_scripts(*ROOMS):
        for node in ast.walk(parse(path)):
            if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef):
                text = ast.get_docstring(node) or ""
                assert not re.match(r"(The same|Those|That)\b", text), f"{path}: {text}"


def test_modules_that_texts_name_exist():
    """In docstrings and comments, with or without the package's name before them."""
    named = re.compile(r"`(?:citypv\.)?((?:core|operators)(?:\.[a-z_0-9]+)+)`")
    found = {
        (str(path), name)
        for path in list_scripts(*ROOMS)
        for name in named.findall(read_text(path))
    }
    assert len(found) > 10
    assert not {(path, name) for path, name in found if not _is_module_or_name_in_one(name)}


def _is_module_or_name_in_one(name):
    *package, last = name.split(".")
    folder = ROOT.joinpath(*package)
    file = folder.with_suffix(".py")
    if (folder / last).is_dir() or (folder / f"{last}.py").is_file():
        return True
    return file.is_file() and re.search(rf"\b{last}\b", file.read_text("utf-8")) is not None
