"""A time budget chooses the settings that the user left open."""

import json
import re

import numpy as np
import pytest
from test_target_error import made_errors

from citypv.__main__ import main
from citypv.core.commands.add_options import settings_of_options
from citypv.core.commands.choose_settings import free_settings
from citypv.core.commands.command_line import build_parser
from citypv.core.commands.spend_budget import Offer, choose_offer

CITY = ["simulate", "x.gml", "--out", "y"]


def offer(way, seconds, suns, rays, samples=64):
    """Of surfaces whose errors of suns and rays are given in percent."""
    errors = made_errors(suns=suns**2, rays=rays**2)
    return Offer({"suns": way, "samples": samples, "shadow_samples": 16}, seconds, 0.0, errors)


def test_more_time_is_for_more_days():
    """Rounds halve the error of the rays in 4^(1/1.3) of the time, but leave that of the suns."""
    few, many = offer("days:12", 2.0, 1.0, 1.0), offer("days:52", 8.0, 0.2, 1.0)
    assert choose_offer([few, many], 6.0) is few  # the other does not fit
    assert choose_offer([few, many], 40.0) is many
    assert few.error_in(8.0) == pytest.approx(np.sqrt(1 + 4**-1.3))
    assert choose_offer([few, many], 40.0, target=1.1) is few  # both reach it
    assert choose_offer([few, many], 1.0) is few  # none fits: the cheapest


@pytest.mark.parametrize(
    "arguments, expected",
    [
        ([], ()),
        (["--time-budget", "60"], ("suns", "samples", "shadow_samples")),
        (["--time-budget", "60", "--samples", "256"], ("suns", "shadow_samples")),  # given, though the default
        (["--time-budget", "60", "--preset", "standard"], ()),
        (["--time-budget", "60", "--method", "paper"], ("samples", "shadow_samples")),
    ],
)
def test_only_what_was_not_given_is_free(arguments, expected):
    options = build_parser().parse_args([*CITY, *arguments])
    assert free_settings(settings_of_options(options)) == expected


@pytest.mark.once
@pytest.mark.parametrize("budget, why", [("600", "predicted"), ("0.001", "the time is up")])
def test_a_run_says_what_it_chose_and_traces_with_it(budget, why, city, tmp_path, capfd):
    options = ["--weather", "clear-sky", "--threads", "1", "--time-budget", budget, "--samples", "128"]
    options += ["--target-error", "5"]  # which ends the rounds
    assert main(["simulate", str(city), "--out", str(tmp_path / "a"), *options]) == 0
    told = capfd.readouterr().err
    line = re.search(r"^Chosen for .*$", told, re.MULTILINE)[0]
    over = re.search(r"^--time-budget 0.001 was exceeded: the run took (\S+) s, (.*)$", told, re.MULTILINE)
    assert (over is None) == (budget == "600")
    if over:  # what took the time adds up to it
        parts = [float(part) for part in re.findall(r"(\S+) s for", over[2])]
        assert len(parts) > 4 and sum(parts) == pytest.approx(float(over[1]), abs=0.5)
    assert why in line
    chosen = re.search(r"--suns (\S+) --shadow-samples (\d+)", line)
    traced = json.loads((tmp_path / "a" / "summary.json").read_text(encoding="utf-8"))
    text = json.dumps(traced)
    assert f'"suns": "{chosen[1]}"' in text
    assert f'"shadow_samples": {chosen[2]}' in text
    assert '"samples": 128' in text
