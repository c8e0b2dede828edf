"""Long runs: cancelled, killed, out of disk, repeated; nothing half-written is ever taken for a
result.
"""

import gc
import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards
from small_city import write_small_city

from citypv.core.commands.command_line import main
from citypv.core.commands.plain_scenes import box
from citypv.core.light.trace_gather import trace_gather
from citypv.core.settings.request import Request

SCENE = join([strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 8), *box((-5, -5, 0), (5, 5, 10))])
SUNS = suns_towards(np.random.default_rng(1).normal(size=(20, 3)) * [1, 1, 0.3] + [0, 0, 1])
SUNS.direction[:, 2] = np.abs(SUNS.direction[:, 2])
FIELDS = (
    "diffuse_relative",
    "visible_share",
    "direct_reflected",
    "direct_annual_standard_error",
    "covered_share",
)
WHOLE = {
    "buildings.csv",
    "faces.csv",
    "groups.csv",
    "summary.json",
    "surfaces.nc",
    "timeseries.nc",
    "transfer.nc",
}
POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def trace(**settings):
    return run_gather(SCENE, SUNS, **settings)


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS)


FEW = ["--suns", "typical-days:4", "--samples", "16", "--shadow-samples", "4"]


def run(city, out, *more):
    return main(["simulate", str(city), "--out", str(out), "--quiet", *FEW, *more])


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["sky and reflections", "suns"])
def test_cancel_leaves_nothing_running(stage):
    """An exception from the progress ends the task in that stage, its threads end, and the next run
    is as ever.
    """
    reference = trace()
    before = threading.active_count()

    def cancel(now, done, total, unit):
        if now == stage:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trace_gather(SCENE, SUNS, Request(threads=2), cancel)
    assert threading.active_count() == before
    assert same(trace(), reference)


@pytest.mark.slow
def test_the_same_run_in_two_threads_at_once():
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: trace(threads=2), range(4)))
    assert all(same(one, trace()) for one in found)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads the memory from /proc")
def test_twenty_runs_do_not_grow():
    """Not by more than 5 % after the first runs have filled the allocators' pools."""

    def resident():
        gc.collect()
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    for _ in range(5):
        trace(samples=1024)
    before = resident()
    for _ in range(20):
        trace(samples=1024)
    assert resident() < 1.05 * before


@POSIX
@pytest.mark.thorough
def test_killed_while_results_are_replaced(tmp_path):
    """The folder holds all of the earlier results, or all of the new ones: here the new ones,
    beside which the earlier ones are about to be deleted.
    """
    city, out = write_small_city(tmp_path / "city.gml"), tmp_path / "out"
    assert run(city, out) == 0
    code = (
        "import os, shutil\n"
        "shutil.rmtree = lambda *_, **__: os.kill(os.getpid(), 9)\n"
        "from citypv.core.commands.command_line import main; raise SystemExit(main())"
    )
    arguments = [
        "simulate",
        str(city),
        "--out",
        str(out),
        *FEW,
        "--quiet",
        "--overwrite",
        "--seed",
        "1",
    ]
    killed = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, check=False, timeout=120
    )
    assert killed.returncode == -signal.SIGKILL
    assert {path.name for path in out.iterdir()} == WHOLE
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["settings"]["seed"] == 1
    started = time.time()
    assert run(city, out, "--overwrite") == 0
    assert {path.name for path in out.iterdir()} == WHOLE
    assert min(path.stat().st_mtime for path in out.iterdir()) > started - 1
