"""The second process of a first run: what it compiles, and that it neither prints, nor stays, nor
fails the run.
"""

import inspect
import os
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.sigutils import normalize_signature

from citypv.core.commands.command_line import main
from citypv.core.rays import compile_ahead as ahead
from citypv.core.rays.compile_ahead import read_loops

ROOT = Path(__file__).parents[2]


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    """An empty folder in which new processes keep what they compile."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    return tmp_path / "numba"


@pytest.fixture
def nothing_kept(monkeypatch):
    """As on a computer on which nothing was compiled yet."""
    monkeypatch.setattr(ahead, "is_compiled", lambda: False)


CALL = """
import numpy as np
from citypv.core.energy.strings_in_shade import _keep as loop
light = np.zeros((1, 1), np.float32)
hours = np.zeros((1, 1), np.int32), light, light[:, 0]
loop(np.zeros((1, 3, 1), np.uint8), hours, (light, light, light), (4, 0.1), light)
print(sum(loop.stats.cache_hits.values()), sum(loop.stats.cache_misses.values()))
"""


@pytest.mark.parametrize("line", read_loops())
def test_a_loop_takes_as_many_arguments_as_are_listed(line):
    """Else the first step in Blender, which compiles them, fails: run tools/list_loops.py."""
    module, function, arguments = line.split(" ", 2)
    loop = getattr(import_module(f"citypv.core.{module}"), function)
    types, _ = normalize_signature(arguments)
    assert len(types) == len(inspect.signature(loop.py_func).parameters)


@pytest.mark.slow
def test_a_new_process_finds_what_the_child_compiled_which_ends_with_its_parent(fresh_cache):
    child = ahead.start_child()
    assert read_loops()[-1].split()[1] == "_keep"  # is compiled first
    end = time.monotonic() + 120
    while child.poll() is None and not list(fresh_cache.glob("*/*._keep-*.nbc")):
        assert time.monotonic() < end
        time.sleep(0.05)
    child.stdin.close()  # as the system closes it when the parent ends
    assert child.wait(60) == 0
    assert (
        len(list(fresh_cache.glob("*/*.nbi"))) < len(read_loops()) / 2
    )  # it did not go on to the end
    found = subprocess.run([sys.executable, "-c", CALL], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["1", "0"]  # found, compiled


@pytest.mark.parametrize("fault", ["no program", "not Python", "no module"])
def test_a_failing_child_fails_no_run_and_prints_nothing(
    nothing_kept, monkeypatch, tmp_path, capfd, fault
):
    if fault == "no module":
        monkeypatch.setattr(ahead, "START", "import none_of_this_name")
    else:
        program = tmp_path / "python"
        if fault == "not Python":
            program.write_text("#!/bin/sh\necho no; echo no >&2; exit 3\n")
            program.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(program))
    with ahead.compile_ahead(threads=2):
        child = ahead.start_child()
        assert (child is None) == (
            fault == "no program" or (os.name == "nt" and fault == "not Python")
        )
        if child is not None:
            assert child.wait(60) != 0
            ahead.stop_child(child)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "kept, threads, estimator",
    [(True, "2", "gather"), (False, "1", "gather"), (False, "2", "forward")],
)
def test_no_child_where_it_is_of_no_use(monkeypatch, tmp_path, kept, threads, estimator):
    monkeypatch.setattr(ahead, "is_compiled", lambda: kept)
    monkeypatch.setattr(ahead, "start_child", lambda: pytest.fail("started"))
    options = [
        "--quiet",
        "--threads",
        threads,
        "--estimator",
        estimator,
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(["simulate", str(tmp_path / "none.gml"), *options]) == 2  # of the missing file


def test_a_run_starts_the_child_before_it_reads_and_ends_it(nothing_kept, monkeypatch, tmp_path):
    started = []

    def start():
        started.append(subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE))
        return started[0]

    monkeypatch.setattr(ahead, "start_child", start)
    assert (
        main(
            [
                "simulate",
                str(tmp_path / "none.gml"),
                "--quiet",
                "--threads",
                "2",
                "--out",
                str(tmp_path),
            ]
        )
        == 2
    )
    assert started[0].returncode is not None


@pytest.mark.slow
def test_the_list_names_each_loop_that_a_draft_calls():
    """Where it does not, type: python tools/list_loops.py."""
    tool = [sys.executable, "-W", "error", ROOT / "tools/list_loops.py", "--print"]
    found = subprocess.run(tool, capture_output=True, text=True, check=True).stdout.splitlines()
    assert sorted(found) == sorted(read_loops())
