"""Rounds until a target error or a time, and presets: when they stop, and that the outcome does not depend on it."""

import json
import signal
import time
from dataclasses import replace

import numpy as np
import pytest
from small_city import write_small_city

from citypv.__main__ import main
from citypv.core.accuracy.refine import Goal, decide_stop, describe_round, rounds_needed, unreachable
from citypv.core.accuracy.yield_errors import YieldErrors
from citypv.core.commands import refine_run
from citypv.core.commands.add_options import imply_settings, request_of_options
from citypv.core.commands.command_line import build_parser
from citypv.core.presets import PRESETS, settings_of_preset
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.results.read_transfer import read_transfer
from citypv.core.study import read_scene, read_year, trace_round, trace_scene
from citypv.core.transfer.merge_transfers import merge_transfers
from citypv.core.transfer.prepare_scene import prepare_scene
from citypv.core.transfer.trace_record import TraceRecord

COARSE = ["--weather", "clear-sky", "--samples", "64", "--shadow-samples", "16", "--suns", "days:24", "--threads", "1"]


def made_errors(rounds=1, **variance):
    """Four surfaces of 100 h and 1 m²."""
    parts = dict.fromkeys(("shadows", "rays", "passed_on", "discretisation", "suns"), 0.0) | variance
    return YieldErrors(
        {name: np.full(4, value) for name, value in parts.items()}, np.full(4, 100.0), np.ones(4), rounds
    )


def test_sampled_errors_fall_with_the_square_root_of_the_rounds():
    errors = made_errors(shadows=3.0, rays=1.0)
    assert errors.at_share() == pytest.approx(2.0)
    assert rounds_needed(errors, 0.5) == pytest.approx(16.0, rel=1e-6)
    assert rounds_needed(made_errors(shadows=4.0, suns=0.16), 0.5) == pytest.approx(4 / 0.09, rel=1e-6)
    assert rounds_needed(errors, 3.0) == 1.0
    assert rounds_needed(made_errors(shadows=4.0, suns=0.25), 0.5) == np.inf
    assert errors.largest() == "shadows"


def test_the_error_that_counts_holds_for_95_percent_of_the_area():
    errors = made_errors(rays=1.0)
    errors = replace(errors, area=np.array([94.0, 1.0, 1.0, 4.0]), variance={"rays": np.array([1.0, 4.0, 9.0, 16.0])})
    assert errors.at_share() == pytest.approx(2.0)
    assert errors.at_share(share=0.5) == pytest.approx(1.0)


def test_a_target_out_of_reach_names_the_option_that_would_help():
    problem, cure = unreachable(made_errors(shadows=1.0, suns=1.0), 0.5, 16)
    assert "the choice of suns alone leaves 1.00 %" in problem
    assert "--suns" in cure
    assert "--patch-size" in unreachable(made_errors(discretisation=1.0), 0.5, 16)[1]
    assert "--shadow-samples 16" in unreachable(made_errors(discretisation=1.0), 0.5, 4)[1]
    assert unreachable(made_errors(shadows=9.0), 0.5, 16) is None


def test_it_stops_at_the_target_and_in_time():
    errors = made_errors(shadows=1.0)
    assert decide_stop(errors, Goal(1.5, None), 1.0) == "target reached"
    assert not decide_stop(errors, Goal(0.5, None), 1.0)
    now = time.monotonic()
    assert decide_stop(errors, Goal(None, now + 5), 6.0) == "no time for another round"
    assert not decide_stop(errors, Goal(None, now + 50), 6.0)
    assert decide_stop(made_errors(shadows=0.01, suns=1.0), Goal(0.5, None), 1.0) == "further rounds would not help"
    assert not decide_stop(made_errors(shadows=1.0, suns=1.0), Goal(0.5, None), 1.0)
    nothing = YieldErrors({"rays": np.zeros(0)}, np.zeros(0), np.zeros(0), 1)
    for goal in (Goal(0.5, None), Goal(None, now + 50)):
        assert "no surface is eligible" in decide_stop(nothing, goal, 1.0)


def test_a_round_without_eligible_surfaces_names_no_error():
    nothing = YieldErrors({"rays": np.zeros(0)}, np.zeros(0), np.zeros(0), 1)
    record = TraceRecord({}, [], 0, 0.0, 1, 1, {"suns": 2.0}, 2.0, 0.0, 0.0, shadow_rays=4_000_000)
    assert describe_round(nothing, Goal(0.5, None), 1.0, record, "done") == "round 1: 2.0 Mrays/s, 2 s; done"


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    return write_small_city(tmp_path_factory.mktemp("city") / "small.gml")


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


@pytest.mark.once
def test_a_target_is_met_and_its_rounds_are_those_of_any_run(city, tmp_path, capfd):
    assert main(["simulate", str(city), "--out", str(tmp_path / "a"), *COARSE, "--target-error", "0.45"]) == 0
    told = capfd.readouterr().err
    assert "target reached" in told
    assert "Mrays/s" in told
    summary = summary_of(tmp_path / "a")
    rounds = summary["traced"]["rounds"]
    assert 1 < rounds < 100
    assert summary["error_budget"]["sampling_95"] <= 0.45
    options = build_parser().parse_args(["simulate", str(city), "--out", "x", *COARSE])
    request = request_of_options(options)
    scene = read_scene([city], request)
    weather = read_year(scene.site, request)
    prepared = prepare_scene(scene, request, weather=weather)
    traced = [trace_scene(scene, weather, request, prepared=prepared)]
    for index in range(1, rounds):
        traced.append(trace_round(scene, traced[0].suns, request, index, progress=silent, prepared=prepared))
    again, written = merge_transfers(traced), read_transfer(tmp_path / "a" / "transfer.nc")
    for name in ("visible_share", "direct_reflected", "diffuse_relative", "direct_annual_standard_error"):
        assert np.array_equal(getattr(again, name), getattr(written, name))
    assert written.record.rounds == rounds


@pytest.mark.once
def test_ctrl_c_keeps_the_finished_rounds(city, tmp_path, monkeypatch, capfd):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    trace = refine_run.trace_round

    def interrupted_in_the_third(scene, suns, request, index, **more):
        if index == 2:
            signal.raise_signal(signal.SIGINT)
        return trace(scene, suns, request, index, **more)

    monkeypatch.setattr(refine_run, "trace_round", interrupted_in_the_third)
    try:
        status = main(["simulate", str(city), "--out", str(tmp_path / "b"), *COARSE, "--target-error", "0.01"])
    finally:
        signal.signal(signal.SIGINT, before)
    assert status == 130
    assert "and 2 rounds" in capfd.readouterr().err
    assert summary_of(tmp_path / "b")["traced"]["rounds"] == 2


def test_presets_are_defaults_that_options_and_methods_override():
    city = ["simulate", "x.gml", "--out", "y"]
    for arguments, expected in (
        (["--preset", "draft"], {"samples": 64, "shadow_samples": 4, "suns": "days:12", "max_bounces": None}),
        (["--preset", "draft", "--samples", "256"], {"samples": 256, "shadow_samples": 4}),
        (["--preset", "reference"], {"samples": 1024, "patch_size": 5.0}),
        (["--preset", "reference", "--method", "paper"], {"suns": "typical-days:12", "max_bounces": 3}),
        ([], {"samples": 256, "shadow_samples": 16}),
    ):
        parser = build_parser()
        imply_settings(parser.parse_args([*city, *arguments]))
        request = request_of_options(parser.parse_args([*city, *arguments]))
        for name, value in expected.items():
            assert getattr(request, name) == value, arguments
    assert Request(**settings_of_preset("draft", samples=100)).samples == 100
    assert set(PRESETS) == {"draft", "standard", "reference"}


@pytest.mark.parametrize("option", ["--target-error", "--time-budget"])
@pytest.mark.parametrize("value", ["0", "-1", "nan"])
def test_goals_that_mean_nothing_are_refused(option, value, city, tmp_path, capfd):
    assert main(["simulate", str(city), "--out", str(tmp_path / "c"), option, value]) == 2
    assert option in capfd.readouterr().err
    assert not (tmp_path / "c").exists()
