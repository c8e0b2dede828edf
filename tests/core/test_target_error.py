"""Rounds until a target error or a time, and presets: when they stop, and that the outcome does not
depend on it.
"""

import json
import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from citypv.__main__ import main
from citypv.core.accuracy.rounds_to_target import (
    Goal,
    decide_stop,
    largest_round,
    rounds_needed,
    size_of_round,
)
from citypv.core.accuracy.yield_errors import SAMPLED, YieldErrors
from citypv.core.commands.command_line import build_parser, read_request
from citypv.core.light import trace_run
from citypv.core.results.transfer_file import read_transfer
from citypv.core.settings.presets import PRESETS
from citypv.core.settings.request import Request

COARSE = [
    "--weather",
    "clear-sky",
    "--samples",
    "64",
    "--shadow-samples",
    "16",
    "--suns",
    "days:24",
    "--threads",
    "1",
]
NOTHING = YieldErrors({"rays": np.zeros(0)}, np.zeros(0), np.zeros(0), 1)


def made_errors(rounds=1, **variance):
    """Four surfaces of 100 h and 1 m²."""
    parts = (
        dict.fromkeys(("shadows", "rays", "passed_on", "discretisation", "suns"), 0.0) | variance
    )
    variance = {name: np.full(4, value) for name, value in parts.items()}
    return YieldErrors(variance, np.full(4, 100.0), np.ones(4), rounds)


def test_sampled_errors_fall_as_those_of_nets_do():
    errors = made_errors(shadows=3.0, rays=1.0)
    assert errors.at_share() == pytest.approx(2.0)
    independent = replace(errors, power=dict.fromkeys(SAMPLED, 1.0))
    assert rounds_needed(independent, 0.5) == pytest.approx(16.0, rel=1e-6)
    needed = rounds_needed(errors, 0.5)
    assert 3 * needed**-1.6 + needed**-1.3 == pytest.approx(0.25, rel=1e-6)
    assert rounds_needed(made_errors(shadows=4.0, suns=0.16), 0.5) == pytest.approx(
        (4 / 0.09) ** (1 / 1.6), rel=1e-6
    )
    assert rounds_needed(errors, 3.0) == 1.0
    assert rounds_needed(made_errors(shadows=4.0, suns=0.25), 0.5) == np.inf
    assert errors.largest() == "shadows"


def test_a_large_error_on_little_area_is_not_most_of_what_95_percent_stay_within():
    """Three large surfaces with noise of rays, and a small one that patch size errs on by more."""
    errors = made_errors(rays=1.0)
    errors.variance["discretisation"][3] = 100.0
    assert replace(errors, area=np.array([1.0, 1.0, 1.0, 0.1])).largest() == "rays"
    assert replace(errors, area=np.array([1.0, 1.0, 1.0, 0.2])).largest() == "discretisation"
    assert made_errors().largest() is None


def test_the_error_that_counts_holds_for_95_percent_of_the_area():
    errors = made_errors(rays=1.0)
    errors = replace(
        errors,
        area=np.array([94.0, 1.0, 1.0, 4.0]),
        variance={"rays": np.array([1.0, 4.0, 9.0, 16.0])},
    )
    assert errors.at_share() == pytest.approx(2.0)
    assert errors.at_share(share=0.5) == pytest.approx(1.0)


def test_a_target_out_of_reach_names_the_option_that_would_help():
    told = made_errors(shadows=1.0, suns=1.0).say_unreachable(0.5)
    assert told.startswith("0.5 % cannot be reached: the choice of suns alone leaves 1.00 %")
    assert "give --suns" in told
    assert "give a smaller --patch-size" in made_errors(discretisation=1.0).say_unreachable(0.5)
    assert not made_errors(suns=1.0).say_unreachable(0.81)  # what is left is an estimate
    assert not made_errors(shadows=9.0).say_unreachable(0.5)


def test_it_stops_at_the_target_and_in_time():
    errors = made_errors(shadows=1.0)
    assert decide_stop(errors, Goal(1.5, None)) == "target reached"
    assert not decide_stop(errors, Goal(0.5, None))
    assert (
        decide_stop(made_errors(shadows=0.01, suns=1.0), Goal(0.5, None))
        == "further rounds would not help"
    )
    assert not decide_stop(made_errors(shadows=1.0, suns=1.0), Goal(0.5, None))
    now = time.monotonic()
    assert size_of_round(errors, Goal(None, now + 5), 6.0) == 0
    assert size_of_round(errors, Goal(None, now + 50), 6.0) == 1
    for goal in (Goal(0.5, None), Goal(None, now + 50)):
        assert "no surface carries modules" in decide_stop(NOTHING, goal)


def test_rounds_double_but_no_more_than_is_needed_and_fits():
    """A round of size s takes points k s to (k + 1) s, so the samples before it are a multiple of
    s.
    """
    goal, sizes, total = Goal(0.001, None, largest=4), [], 1
    for _ in range(6):
        sizes.append(size_of_round(made_errors(total, shadows=1.0), goal, 1.0))
        total += sizes[-1]
    assert sizes == [1, 2, 4, 4, 4, 4]
    much = Goal(None, time.monotonic() + 100, largest=64)
    assert size_of_round(made_errors(12, shadows=1.0), much, 1.0) == 4
    assert size_of_round(made_errors(16, shadows=1.0), much, 20.0) == 4
    assert size_of_round(made_errors(16, shadows=1.0), Goal(0.97, None, largest=64), 1.0) == 1
    counts = ((64, 4), (256, 16), (100, 4), (4096, 4))
    assert [
        largest_round(Request(samples=rays, shadow_samples=points)) for rays, points in counts
    ] == [16, 4, 8, 1]


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_a_target_is_met_twice_with_the_same_bits(city, tmp_path, capfd):
    assert (
        main(
            ["simulate", str(city), "--out", str(tmp_path / "a"), *COARSE, "--target-error", "0.45"]
        )
        == 0
    )
    told = capfd.readouterr().err
    assert "target reached" in told
    assert "Mrays/s" in told
    summary = summary_of(tmp_path / "a")
    rounds = summary["traced"]["rounds"]
    assert 1 < rounds < 100
    assert summary["error_budget"]["sampling_95"] <= 0.45
    assert (
        main(
            [
                "simulate",
                str(city),
                "--out",
                str(tmp_path / "again"),
                *COARSE,
                "--target-error",
                "0.45",
            ]
        )
        == 0
    )
    again, written = (read_transfer(tmp_path / name / "transfer.nc") for name in ("again", "a"))
    for name in (
        "visible_share",
        "direct_reflected",
        "diffuse_relative",
        "direct_annual_standard_error",
    ):
        assert np.array_equal(getattr(again, name), getattr(written, name))
    assert written.record.rounds == rounds


@pytest.mark.slow
def test_ctrl_c_keeps_the_finished_rounds(city, tmp_path, monkeypatch, capfd):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    trace = trace_run._Run.add_round

    def interrupted_in_the_third(run, *given):
        if run.transfer.record.rounds == 2:
            signal.raise_signal(signal.SIGINT)
        return trace(run, *given)

    monkeypatch.setattr(trace_run._Run, "add_round", interrupted_in_the_third)
    try:
        status = main(
            ["simulate", str(city), "--out", str(tmp_path / "b"), *COARSE, "--target-error", "0.13"]
        )
    finally:
        signal.signal(signal.SIGINT, before)
    assert status == 130
    assert "and 2 times the samples" in capfd.readouterr().err
    assert summary_of(tmp_path / "b")["traced"]["rounds"] == 2


@pytest.mark.slow
def test_presets_are_defaults_that_options_and_methods_override():
    city = ["simulate", "x.gml", "--out", "y"]
    for arguments, expected in (
        (
            ["--preset", "draft"],
            {"samples": 64, "shadow_samples": 4, "suns": "days:12", "max_bounces": None},
        ),
        (["--preset", "draft", "--samples", "256"], {"samples": 256, "shadow_samples": 4}),
        (["--preset", "reference"], {"samples": 1024, "patch_size": 5.0}),
        (
            ["--preset", "reference", "--method", "paper"],
            {"suns": "typical-days:12", "max_bounces": 3},
        ),
        ([], {"samples": 256, "shadow_samples": 16}),
    ):
        request = read_request(build_parser().parse_args([*city, *arguments]))
        for name, value in expected.items():
            assert getattr(request, name) == value, arguments
    assert set(PRESETS) == {"draft", "standard", "reference"}
