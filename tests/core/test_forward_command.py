"""The forward estimator from the command line."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from citypv.__main__ import main

ERA5 = Path(__file__).parents[2] / "examples" / "berlin" / "era5_berlin_2017.nc"


def simulate(city, folder, *options):
    common = ["--weather", str(ERA5), "--suns", "typical-days:2", "--out", str(folder), "--quiet"]
    return main(["simulate", str(city), *common, *options])


def columns_of(folder):
    with (folder / "faces.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in NUMBERS}


NUMBERS = ("area", "covered_share", "sky_view_factor", "diffuse_relative", "full_load_hours")
NUMBERS += ("diffuse_relative_standard_error", "full_load_hours_standard_error", "direct_relative_annual")


@pytest.mark.slow
@pytest.mark.once
def test_both_estimators_give_the_same_year(city, tmp_path):
    """Full load hours of three houses, within the errors that both state."""
    assert simulate(city, tmp_path / "one") == 0
    assert simulate(city, tmp_path / "other", "--estimator", "forward", "--samples", "700") == 0
    one, other = columns_of(tmp_path / "one"), columns_of(tmp_path / "other")
    assert other["covered_share"] == pytest.approx(one["covered_share"], abs=0.02)
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
    assert columns_of(tmp_path / "again")["full_load_hours"] == pytest.approx(other["full_load_hours"], nan_ok=True)


def test_the_plan_of_forward(city, capsys):
    assert main(["effects", str(city), "--estimator", "forward"]) == 0
    said = capsys.readouterr().out
    assert "shadow-rays" in said
    assert "follows light from its source" in said
    assert main(["effects", str(city), "--estimator", "forward", "--effects", "sky-rays=off"]) == 2
    assert "sky-rays=off is for gather only" in capsys.readouterr().err
