"""The forward estimator from the command line."""

import json

import pandas as pd
from weathers import ERA5

from citypv.__main__ import main


def test_a_run_by_forward_tells_where_its_photons_went_and_is_read_again(city, tmp_path):
    common = ["--weather", str(ERA5), "--quiet", "--out"]
    run = ["simulate", str(city), "--estimator", "forward", "--suns", "typical-days:2", "--samples", "16"]
    assert main([*run, *common, str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert summary["settings"]["estimator"] == "forward"
    assert set(summary["traced"]["photons"]) == {"sky", "far ground", "suns", "horizon"}
    assert summary["traced"]["rays"] > summary["traced"]["photons"]["suns"]["emitted"]
    assert summary["error_budget"]["sampling_total"] > 0
    assert abs(summary["error_budget"]["sun_sampling"]["bias"]) < 5
    assert main(["yield", str(tmp_path / "out" / "transfer.nc"), *common, str(tmp_path / "again")]) == 0
    hours, again = (pd.read_csv(tmp_path / name / "faces.csv")["full_load_hours"] for name in ("out", "again"))
    pd.testing.assert_series_equal(hours, again)


def test_the_plan_of_forward(city, capsys):
    assert main(["effects", str(city), "--estimator", "forward"]) == 0
    said = capsys.readouterr().out
    assert "shadow-rays" in said
    assert "follows light from its source" in said
