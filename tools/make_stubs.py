"""Write `__init__.pyi`: what editors and type checkers know of the package `citypv`.

    .venv/bin/python tools/make_stubs.py [--check]

The functions of `core/commands/python_api.py` take their settings as `**settings`, declared once in
`Request`; in the stub each setting stands with its type, default, unit and meaning. A test compares
the file with what this writes.
"""

import ast
import inspect
import subprocess
import sys
import textwrap
import types
from dataclasses import fields
from pathlib import Path

from citypv.core.commands import python_api
from citypv.core.results import compare_runs
from citypv.core.run.make_world import WorldSettings
from citypv.core.run.variant import Change
from citypv.core.settings.request import declared_settings

STUB = Path(__file__).resolve().parent.parent / "__init__.pyi"
HEAD = '''\
"""CityPV in Python: functions, their settings, and results. Written by tools/make_stubs.py."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import xarray as xr

StrPath = str | PathLike[str]
Progress = Callable[[str, float, float, str], object]

__version__: str

class InputError(ValueError):
    """Input or settings that cannot be used: names the file, the place and the cure."""
'''
# By kind of a setting, where the type of its field says less.
KINDS = {
    "number": "float",
    "integer": "int",
    "switch": "bool",
    "flag": "bool",
    "names": "str | Sequence[str]",
    "texts": "StrPath | Sequence[StrPath]",
    "pairs": "Mapping[str, bool]",
    "shares": "Mapping[str, float]",
    "place": "tuple[float, float]",
}
# Parameters and members whose types nothing in the code declares.
TYPES = {
    "city": "StrPath | Sequence[StrPath]",
    "out": "StrPath | None",
    "folder": "StrPath",
    "overwrite": "bool",
    "private": "bool",
    "temporary": "bool",
    "title": "str",
    "language": "str",
    "districts": "str | None",
    "attribution": "str",
    "exports": "str | Sequence[str]",
    "cluster": "str | None",
    "tile": "float | None",
    "progress": "Progress",
    "weather": "StrPath | Sequence[StrPath]",
    "environments": "StrPath | Sequence[StrPath]",
    "before": "Result | StrPath",
    "after": "Result | StrPath",
}
WISHES = {
    "add": "Sequence[StrPath]",
    "remove": "Sequence[str]",
    "move": "Mapping[str, tuple[float, float]]",
    "raised": "Mapping[str, float]",
    "albedo_of": "Mapping[str, float]",
    "local": "bool",
    "private": "bool",
}
RETURNS = {
    "faces": "pd.DataFrame",
    "groups": "pd.DataFrame",
    "buildings": "pd.DataFrame",
    "districts": "pd.DataFrame",
    "timeseries": "xr.Dataset",
    "summary": "dict[str, Any]",
    "save": "Result",
    "with_weather": "Result",
    "variant": "Result",
    "plot": "Path",
    "simulate": "Result",
    "read_results": "Result",
    "compare": "Comparison",
    "inspect": "dict[str, Any]",
    "world": "xr.Dataset",
}
# Groups of settings that a function takes; those of an edit and of a world are added below.
SETTINGS = {
    "simulate": (),
    "with_weather": ("surfaces", "weather", "electricity", "sky", "effects", "run"),
    "inspect": ("city", "surfaces"),
    "world": ("weather", "electricity", "sky", "run"),
}


def write_stub():
    """The whole stub: str."""
    parts = [HEAD, _write_class(python_api.Result), _write_comparison()]
    for name in ("simulate", "read_results", "compare", "inspect", "world"):
        parts.append(_write_function(name, getattr(python_api, name)))
    ruff = [sys.executable, "-m", "ruff", "format", "--stdin-filename", STUB, "-"]
    formatted = subprocess.run(
        ruff, input="\n".join(parts), capture_output=True, text=True, encoding="utf-8", check=True
    )
    return formatted.stdout


def _write_class(kind):
    """A class with its properties and methods."""
    lines = [f"class {kind.__name__}:", _quote(inspect.getdoc(kind), 4), "    folder: Path"]
    for name, member in vars(kind).items():
        if name == "__init__":
            lines.append("    def __init__(self, folder: StrPath, *, temporary: bool = False): ...")
        elif inspect.isfunction(member) and not name.startswith("_"):
            lines.append(textwrap.indent(_write_function(name, member), "    "))
        elif hasattr(member, "attrname"):  # a cached property
            lines.append(f"    @property\n    def {name}(self) -> {RETURNS[name]}:")
            lines += [_quote(inspect.getdoc(member.func), 8), "        ..."]
    return "\n".join(lines) + "\n"


def _write_comparison():
    """The data of a comparison, as annotated there."""
    tree = ast.parse(inspect.getsource(compare_runs.Comparison)).body[0]
    lines = ["class Comparison:", _quote(inspect.getdoc(compare_runs.Comparison), 4)]
    own = {"later": "Any", "summary": "dict[str, Any]"}
    for node in tree.body:
        if isinstance(node, ast.AnnAssign):
            name = node.target.id
            lines.append(f"    {name}: {own.get(name, ast.unparse(node.annotation))}")
    return "\n".join(lines) + "\n"


def _write_function(name, function):
    """A function with every setting that it takes in place of `**settings`."""
    words, extra = inspect.getdoc(function), _settings_of(name)
    parameters = []
    own = inspect.signature(function).parameters
    for key, parameter in own.items():
        if parameter.kind is parameter.VAR_KEYWORD:
            parameters += [] if "*" in parameters else ["*"]
            parameters += [f"{key}: {kind} = {default}" for key, kind, default in extra]
        elif key == "self":
            parameters.append("self")
        else:
            if parameter.kind is parameter.KEYWORD_ONLY and "*" not in parameters:
                parameters.append("*")
            default = "" if parameter.default is parameter.empty else " = ..."
            if isinstance(parameter.default, bool | tuple | types.NoneType):
                default = f" = {parameter.default!r}"
            parameters.append(f"{key}: {TYPES[key]}{default}")
    listing = "".join(f"    {parameter},\n" for parameter in parameters)
    returned = RETURNS.get(name, "None")
    return f"def {name}(\n{listing}) -> {returned}:\n{_quote(words, 4)}\n    ...\n"


def _settings_of(name):
    """Settings that a function takes besides its own parameters: (name, type, default)."""
    found = []
    if name in SETTINGS:
        own = inspect.signature(
            getattr(python_api, name, None) or getattr(python_api.Result, name)
        ).parameters
        found = [
            _describe_setting(*setting)
            for setting in declared_settings(*SETTINGS[name])
            if setting[0] not in own
        ]
    if name == "variant":
        for field in fields(Change):
            default = "False" if field.name == "local" else "..."
            found.append((field.name, WISHES[field.name], default))
    if name == "world":
        for field in fields(WorldSettings):
            kind = getattr(field.type, "__name__", str(field.type))
            kind = "tuple[float, float] | None" if field.name.endswith("tudes") else kind
            kind = "Sequence[int]" if field.name == "years" else kind
            found.append((field.name, kind, repr(field.default)))
    return found


def _describe_setting(name, default, details):
    """A setting as a parameter: name, type and default."""
    kind = KINDS.get(details.kind, "str")
    if details.metavar in ("FILE", "DIR", "CSV"):
        kind = "StrPath"
    if details.kind == "choice":
        kind = f"Literal[{', '.join(map(repr, details.choices))}]"
    if name == "materials":
        kind = "Mapping[str, Any]"
    optional = " | None" if default is None or details.none else ""
    # Dictionaries have no default that a signature could show.
    return name, kind + optional, "..." if isinstance(default, dict) else repr(default)


def _quote(words, indent):
    """A docstring, indented."""
    raw = "r" if "\\" in words else ""
    lines = f'{raw}"""{words}'.splitlines()
    text = "\n".join(lines) + ("\n" if len(lines) > 1 else "") + '"""'
    return textwrap.indent(text, " " * indent)


if __name__ == "__main__":
    text = write_stub()
    if sys.argv[1:] == ["--check"]:
        sys.exit(STUB.read_text("utf-8") != text)
    STUB.write_text(text, "utf-8")
