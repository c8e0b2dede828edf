"""The forward estimator from the command line."""

import json

import numpy as np
import pandas as pd
import pytest
from weathers import ERA5

from citypv.__main__ import main


def simulate(city, folder, *options):
    common = ["--weather", str(ERA5), "--suns", "typical-days:2", "--out", str(folder), "--quiet"]
    return main(["simulate", str(city), *common, *options])


@pytest.mark.thorough
@pytest.mark.once
def test_both_estimators_give_the_same_year(city, tmp_path):
    """Full load hours of three houses, within the errors that both state."""
    assert simulate(city, tmp_path / "one") == 0
    assert simulate(city, tmp_path / "other", "--estimator", "forward", "--samples", "700") == 0
    one, other = (pd.read_csv(tmp_path / name / "faces.csv") for name in ("one", "other"))
    assert other["covered_share"].to_numpy() == pytest.approx(one["covered_share"].to_numpy(), abs=0.02)
    for name in ("diffuse_relative", "full_load_hours"):
        known = (one[name] > 0) & (one["area"] > 20)
        error = np.hypot(one[f"{name}_standard_error"], other[f"{name}_standard_error"])[known]
        assert known.sum() >= 18
        # Gather's light is even over each wall: one percent of it.
        assert (np.abs(other[name] - one[name])[known] <= 4 * error + 0.01 * one[name][known]).all()
        assert np.median(error / one[name][known]) < 0.04
    summary = json.loads((tmp_path / "other" / "summary.json").read_text("utf-8"))
    assert summary["settings"]["estimator"] == "forward"
    assert set(summary["traced"]["photons"]) == {"sky", "far ground", "suns", "horizon"}
    for tally in summary["traced"]["photons"].values():
        assert sum(tally.values()) == pytest.approx(2 * tally["emitted"], rel=1e-12)
    assert summary["traced"]["rays"] > summary["traced"]["photons"]["suns"]["emitted"]
    assert summary["error_budget"]["sampling_total"] > 0
    assert abs(summary["error_budget"]["sun_sampling"]["bias"]) < 5
    kept, again = str(tmp_path / "other" / "transfer.nc"), str(tmp_path / "again")
    assert main(["yield", kept, "--weather", str(ERA5), "--out", again, "--quiet"]) == 0
    hours = pd.read_csv(tmp_path / "again" / "faces.csv")["full_load_hours"]
    assert hours.to_numpy() == pytest.approx(other["full_load_hours"], nan_ok=True)


def test_the_plan_of_forward(city, capsys):
    assert main(["effects", str(city), "--estimator", "forward"]) == 0
    said = capsys.readouterr().out
    assert "shadow-rays" in said
    assert "follows light from its source" in said
