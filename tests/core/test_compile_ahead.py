"""The list of loops that Blender compiles before a run."""

import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.sigutils import normalize_signature

from citypv.core.rays.compile_ahead import read_loops

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("line", read_loops())
def test_a_loop_takes_as_many_arguments_as_are_listed(line):
    """Else the first step in Blender, which compiles them, fails: run tools/list_loops.py."""
    module, function, arguments = line.split(" ", 2)
    loop = getattr(import_module(f"citypv.core.{module}"), function)
    types, _ = normalize_signature(arguments)
    assert len(types) == len(inspect.signature(loop.py_func).parameters)


@pytest.mark.slow
def test_the_list_names_each_loop_that_a_draft_calls():
    """Where it does not, type: python tools/list_loops.py."""
    tool = [sys.executable, "-W", "error", ROOT / "tools/list_loops.py", "--print"]
    found = subprocess.run(tool, capture_output=True, text=True, check=True).stdout.splitlines()
    assert sorted(found) == sorted(read_loops())
