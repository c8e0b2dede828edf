"""Targets and time budgets that cannot be kept are refused before the first round, and the others
are kept.
"""

import json
import re
import time

import pytest

from citypv.__main__ import main
from citypv.core.commands.command_line import build_parser, read_request

CITY = ["simulate", "x.gml", "--out", "y"]
COMMON = ["--weather", "clear-sky", "--threads", "1"]


@pytest.mark.parametrize(
    "arguments, samples",
    [
        ([], 256),
        (["--time-budget", "60"], 64),
        (["--time-budget", "60", "--samples", "256"], 256),  # given, though the default
        (["--time-budget", "60", "--preset", "reference"], 1024),
        (["--target-error", "1"], 256),
    ],
)
def test_with_a_time_budget_the_first_round_has_few_rays(arguments, samples):
    """It chooses nothing else."""
    request = read_request(build_parser().parse_args([*CITY, *arguments]))
    assert request.samples == samples
    assert arguments[2:3] == ["--preset"] or (request.suns, request.shadow_samples) == (
        "days:24",
        16,
    )


@pytest.mark.slow
def test_a_target_below_the_error_of_the_suns_is_refused_at_once(city, tmp_path, capfd):
    options = ["simulate", str(city), "--out", str(tmp_path / "a"), *COMMON, "--suns", "days:4"]
    assert main([*options, "--target-error", "0.05"]) == 2
    told = capfd.readouterr().err
    assert not (tmp_path / "a").exists() and "Tracing" not in told
    least = re.search(
        r"--target-error: 0.05 % is below the (\S+) % that --suns days:4 leaves", told
    )[1]
    assert f"give --suns days:52, or a target above {least}" in told
    assert main([*options, "--target-error", least]) == 0


@pytest.mark.slow
def test_a_budget_below_that_of_the_first_round_is_refused_with_one_that_is_kept(
    city, tmp_path, capfd
):
    options = ["simulate", str(city), "--out", str(tmp_path / "a"), *COMMON]
    assert main([*options, "--time-budget", "0.01"]) == 2
    told = capfd.readouterr().err
    assert not (tmp_path / "a").exists() and "Tracing" not in told
    least = re.search(r"0.01 s are too few: .*; give --time-budget (\d+) at least", told)[1]
    started = time.monotonic()
    assert main([*options, "--time-budget", least]) == 0
    assert time.monotonic() - started < 1.25 * int(least)
    told = capfd.readouterr().err
    assert "was exceeded" not in told
    assert "--samples 64 --shadow-samples 16: " in told


@pytest.mark.thorough
def test_more_time_leaves_no_more_error_than_a_target_takes(city, tmp_path):
    """A target is met in some seconds; in 2.7 times as many a budget gets further."""

    def run(name, *goal):
        started = time.monotonic()
        assert main(["simulate", str(city), "--out", str(tmp_path / name), *COMMON, *goal]) == 0
        summary = json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))
        return time.monotonic() - started, summary["error_budget"]["surfaces"]["all"]["at_95"]

    seconds, error = run("target", "--target-error", "0.8")
    taken, left = run("budget", "--time-budget", f"{2.7 * seconds:.1f}")
    assert taken < 5 * seconds  # a busy machine may slow down after it was measured
    assert left <= error
