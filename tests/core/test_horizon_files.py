"""Files of horizons: formats that are read, and what is refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from small_city import write_small_city

from citypv.__main__ import main
from citypv.core.settings.errors import InputError
from citypv.core.sun.horizon import elevation_at
from citypv.core.sun.read_horizon import read_horizon_table

DEM = Path(__file__).parents[1] / "data" / "terrain" / "dem_jacksboro_tn_wgs84.tif"
NO_SYSTEM = DEM.with_name("dem_jacksboro_utm16_clip.asc")


def test_formats_of_angles(tmp_path):
    """Azimuth from north; PVGIS' A from the south; PVGIS' list from north, clockwise."""
    azimuth, height = np.arange(0, 360, 7.5), 10 + 8 * np.sin(np.radians(np.arange(0, 360, 7.5)))
    rows = list(zip(azimuth, height, strict=True))
    table = "\n".join(f"{a:.1f}\t{h:.4f}\t-30.0\t0.0\t-30.0\t0.0" for a, h in sorted((a - 180, h) for a, h in rows))
    head = "Latitude (decimal degrees):\t36.300\nLongitude (decimal degrees):\t-84.200\n\n"
    columns = "A\tH_hor\tA_sun(w)\tH_sun(w)\tA_sun(s)\tH_sun(s)\n"
    profile = [{"A": a - 180, "H_hor": h} for a, h in rows]
    texts = {
        "two.csv": "# azimuth, elevation\n" + "\n".join(f"{a},{h:.4f}" for a, h in reversed(rows)),
        "pvgis.csv": head + columns + table + "\n\nA: Azimuth (0 = S, 90 = W, -90 = E) (degree)\nH_hor: height 1\n",
        "pvgis.json": json.dumps({"inputs": {}, "outputs": {"horizon_profile": profile}}),
        "turned.csv": "elevation [deg], azimuth [deg]\n" + "\n".join(f"{h:.4f}, {a}" for a, h in rows),
        "user.txt": "\n".join(f"{h:.4f}" for _, h in rows),
        "line.txt": " ".join(f"{h:.4f}" for _, h in rows),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        horizon = read_horizon_table(tmp_path / name)
        assert elevation_at(horizon, azimuth) == pytest.approx(height, abs=1e-3), name
        assert elevation_at(horizon, 356.25) == pytest.approx((height[-1] + height[0]) / 2, abs=1e-3), name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("azimuth,elevation\n0,5\n90,nan\n180,5\n", "out of range"),
        ("0,5\n90,6\n", "2 angles"),
        ("0,5\n90,6\nabc,7\n", "no numbers"),
        ("hello\n", "neither two columns nor one"),
        ("azimuth;elevation\n0;5\n90;10,5\n180;5\n", r"bad.csv:3: has more or fewer columns"),
        ("{}", "not a horizon of PVGIS"),
        ('{"outputs": {"horizon_profile": []}}', "0 angles"),
    ],
)
def test_files_of_angles_that_cannot_be_used(tmp_path, text, words):
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_horizon_table(tmp_path / "bad.csv")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["--horizon", str(NO_SYSTEM)], "names no coordinate reference system"),
        (["--horizon", str(DEM)], "does not reach the site"),
        (["--horizon", "nowhere.tif"], "no such file"),
        (["--effects", "terrain-horizon=on"], "--horizon FILE"),
    ],
)
def test_a_horizon_that_cannot_be_used_is_one_line(tmp_path, capsys, settings, words):
    city = write_small_city(tmp_path / "small.gml")
    assert main(["effects", str(city), *settings]) == 2
    told = capsys.readouterr().err.strip()
    assert words in told and "\n" not in told
