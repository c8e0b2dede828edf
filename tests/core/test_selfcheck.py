"""The self-check passes here, and fails where something is wrong."""

import json

import numpy as np
import pytest
from thorough import mark_cases

from citypv.core.commands import closed_form_checks, selfcheck
from citypv.core.commands.command_line import main
from citypv.core.light import solve_radiosity


@pytest.fixture(scope="module")
def report():
    return selfcheck.report_checks(selfcheck.selfcheck())


@pytest.mark.slow
def test_everything_passes_in_half_a_minute(report):
    wrong = [check for check in report["checks"] if not check["passed"]]
    assert not wrong
    assert report["passed"] is True
    assert report["seconds"] < 30
    assert len(report["checks"]) >= 37
    assert len({check["name"] for check in report["checks"]}) == len(report["checks"])
    json.dumps(report, allow_nan=False)


@pytest.mark.slow
def test_errors_are_small_enough_to_reject_the_nearest_wrong_value(report):
    """Two reflections are told from three, the sky from the sky and the ground, one view factor
    from the next.
    """
    found = {check["name"]: check for check in report["checks"]}
    for face in ("wall", "street"):
        two, three = (found[f"street canyon, {face} after {count} reflections"] for count in (2, 3))
        reach = 4 * two["standard_error"] + two["allowance"]
        assert abs(two["expected"] - three["expected"]) > 1.5 * reach
    for check in report["checks"]:
        assert check["standard_error"] < 2e-3


def test_the_command_prints_numbers_and_says_pass(monkeypatch, capsys):
    few = [
        ("one is one", 1.0, 0.0, lambda: (1.0, 0.0)),
        ("about two", 2.0, 0.0, lambda: (2.01, 0.004)),
    ]
    monkeypatch.setattr(selfcheck, "closed_form_checks", lambda: few)
    monkeypatch.setattr(selfcheck, "hard_checks", list)
    assert main(["selfcheck"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0].startswith("pass  one is one")
    assert "expected 2 " in out[1]
    assert "found 2.01 " in out[1]
    assert "± 0.004" in out[1]
    assert out[2].endswith("all passed")


@pytest.mark.parametrize(
    "found",
    mark_cases(
        [(1.02, 0.004), (0.98, 0.004), (np.nan, 0.0), (1.0, np.nan), None], kept=2, single=True
    ),
    ids=["above", "below", "nan", "no error", "breaks off"],
)
def test_a_wrong_number_fails_the_command_and_the_others_go_on(monkeypatch, capsys, found):
    checks = [("about one", 1.0, 1e-6, lambda: found), ("sound", 1.0, 0.0, lambda: (1.0, 0.0))]
    monkeypatch.setattr(selfcheck, "closed_form_checks", lambda: checks)
    monkeypatch.setattr(selfcheck, "hard_checks", list)
    assert main(["selfcheck"]) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[0].startswith("FAIL  about one") and ("TypeError: " in out[0]) == (found is None)
    assert out[1].startswith("pass  sound") and out[2].endswith("1 FAILED")
    assert main(["selfcheck", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["passed"] is False


def test_a_fault_in_the_tracer_is_found(monkeypatch):
    """With a tenth of the reflected light lost, the furnace fails."""
    whole = solve_radiosity.multiply
    monkeypatch.setattr(
        solve_radiosity, "multiply", lambda *given, **kept: np.float32(0.9) * whole(*given)
    )
    name = "closed furnace, albedo 0.25, 3 reflections"
    furnace = [check for check in closed_form_checks.closed_form_checks() if check[0] == name]
    monkeypatch.setattr(selfcheck, "closed_form_checks", lambda: furnace)
    monkeypatch.setattr(selfcheck, "hard_checks", list)
    (check,) = selfcheck.selfcheck()
    assert not check.passed and not check.problem
