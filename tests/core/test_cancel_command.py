"""Ctrl-C as users of the command line meet it: what was traced is kept whole, or nothing is; the
status is 130.
"""

import json
import signal

import numpy as np
import pandas as pd
import pytest
from small_city import TABLES
from weathers import ERA5

from citypv.__main__ import main
from citypv.core.light import sun_blocks
from citypv.core.run import study, write_run


@pytest.fixture(autouse=True)
def hear_interrupts():
    """Whoever runs the tests in the background may have them ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def run(city, out, *more):
    options = [
        "--weather",
        str(ERA5),
        "--samples",
        "64",
        "--shadow-samples",
        "4",
        "--suns",
        "typical-days:8",
    ]
    return main(["simulate", str(city), "--out", str(out), *options, *more])


def interrupt(monkeypatch, moment):
    """Send a signal at the end of a block of suns, or at the beginning of one of the stages of a
    run.
    """
    if isinstance(moment, int):
        end = sun_blocks.SunProgress.end

        def stop(self):
            if self.block.start <= moment < self.block.stop:
                signal.raise_signal(signal.SIGINT)
            end(self)

        monkeypatch.setattr(sun_blocks.SunProgress, "end", stop)
        return
    room = study if hasattr(study, moment) else write_run
    stage = getattr(room, moment)

    def stop_before(*arguments, **more):
        signal.raise_signal(signal.SIGINT)
        return stage(*arguments, **more)

    monkeypatch.setattr(room, moment, stop_before)


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
def test_first_interrupt_keeps_the_suns(city, tmp_path, capfd, monkeypatch):
    interrupt(monkeypatch, 40)
    out = tmp_path / "out"
    assert run(city, out) == 130
    assert {path.name for path in out.iterdir()} == TABLES
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    kept, count = (
        summary["traced"]["interrupted"]["suns_traced"],
        summary["traced"]["interrupted"]["of"],
    )
    assert 40 <= kept < count
    assert summary["suns"]["count"] == kept
    assert summary["suns"]["way"].startswith("typical-days:")
    assert summary["suns"]["way"] != "typical-days:8"
    assert summary["error_budget"]["sun_sampling"]["patches"] > 10
    said = capfd.readouterr().err
    assert "Interrupting: finished suns are kept" in said
    assert (
        said.strip()
        .splitlines()[-1]
        .startswith(f"Interrupted: kept {kept} of {count} suns; this changes full")
    )
    assert "Traceback" not in said
    # The whole run is not far away, and the part can be weighed again.
    monkeypatch.undo()
    assert run(city, tmp_path / "whole", "--quiet") == 0
    hours = [
        pd.read_csv(folder / "faces.csv")["full_load_hours"] for folder in (out, tmp_path / "whole")
    ]
    assert np.nanmean(hours[0]) == pytest.approx(np.nanmean(hours[1]), rel=0.03)
    again = [
        "yield",
        str(out / "transfer.nc"),
        "--weather",
        str(ERA5),
        "--out",
        str(tmp_path / "again"),
        "--quiet",
    ]
    assert main(again) == 0
    assert (tmp_path / "again" / "faces.csv").read_text() == (out / "faces.csv").read_text()
    assert main([*again[:-1], "--overwrite"]) == 0
    assert f"an interrupted run. Interrupted: kept {kept} of {count} suns" in capfd.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
def test_an_interrupted_run_that_shall_be_editable_keeps_its_suns_alone(
    city, tmp_path, capfd, monkeypatch
):
    interrupt(monkeypatch, 40)
    out = tmp_path / "out"
    assert run(city, out, "--editable") == 130
    assert {path.name for path in out.iterdir()} == TABLES
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    interrupted = summary["traced"]["interrupted"]
    assert 40 <= interrupted["suns_traced"] < interrupted["of"]
    assert "What its rays met is not kept" in capfd.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("moment", ["measure_sun_sampling", "summarise"])
def test_second_interrupt_leaves_nothing(city, tmp_path, capfd, monkeypatch, moment):
    interrupt(monkeypatch, 40)
    interrupt(monkeypatch, moment)
    assert run(city, tmp_path / "out", "--quiet") == 130
    assert capfd.readouterr().err == "citypv: error: interrupted; no results were written\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_interrupted_error_check_keeps_all_suns(city, tmp_path, capfd, monkeypatch):
    interrupt(monkeypatch, "measure_sun_sampling")
    assert run(city, tmp_path / "out", "--quiet") == 130
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    interrupted = summary["traced"]["interrupted"]
    assert interrupted["suns_traced"] == interrupted["of"] == summary["suns"]["count"]
    assert summary["suns"]["way"] == "typical-days:8"
    assert "sun_sampling" not in summary["error_budget"]
    assert capfd.readouterr().err.startswith("Interrupted: kept ")
