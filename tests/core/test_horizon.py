"""Distant terrain against closed forms and PVGIS' formats; that of rasters is in
test_horizon_of_terrain.py.
"""

import json
from dataclasses import replace

import numpy as np
import pvlib
import pytest
from scenes import (
    RUNS,
    assert_mean,
    join,
    run_forward,
    run_gather,
    scene_of_triangles,
    strip,
    suns_towards,
)
from transfers import unshaded_transfer
from weathers import BERLIN, HOUR

from citypv.core.effects.plan_effects import plan_effects
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.patches.patches import Patches
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sky.horizon import STEPS, TerrainHorizon, is_above
from citypv.core.sky.read_horizon import read_horizon_table
from citypv.core.sun.sun_sampling import hourly_suns
from citypv.core.weather.read_weather import read_weather

RAYS = {"sky-rays": True, "shadow-rays": True}


def uniform(height):
    """A horizon of the same height [°] all around."""
    return TerrainHorizon(np.full(STEPS, float(height)))


def valley(height):
    """Ridges in the east and in the west, each a quarter of the horizon."""
    azimuth = uniform(0).azimuth % 180
    return TerrainHorizon(np.where((azimuth >= 45) & (azimuth < 135), float(height), 0.0))


def write_angles(path, horizon, step=4):
    """The horizon as azimuth,elevation."""
    rows = zip(horizon.azimuth[::step], horizon.elevation[::step], strict=True)
    path.write_text(
        "azimuth,elevation\n" + "\n".join(f"{a},{h}" for a, h in rows), encoding="utf-8"
    )
    return str(path)


# Sky


def test_a_level_surface_keeps_the_cosine_squared_of_the_sky():
    level, south = np.array([[0, 0, 1.0]]), np.array([[0, -1.0, 0]])
    for height in (2.0, 10.0, 30.0):
        angle = np.radians(height)
        assert 1 - uniform(height).lost_sky(level) == pytest.approx(np.cos(angle) ** 2, abs=1e-12)
        wall = (angle + np.sin(angle) * np.cos(angle)) / np.pi
        assert uniform(height).lost_sky(south) == pytest.approx(wall, abs=1e-5)
    # A quarter in the east and one in the west; a south wall sees half of each, at the flat end of
    # its cosine.
    angle = np.radians(15)
    assert valley(15).lost_sky(level) == pytest.approx(np.sin(angle) ** 2 / 2, abs=1e-3)
    part = (angle + np.sin(angle) * np.cos(angle)) * (1 - np.sin(np.radians(45))) / np.pi
    assert valley(15).lost_sky(south) == pytest.approx(part, abs=2e-4)


@pytest.mark.slow
def test_lost_sky_of_any_slope_is_what_random_rays_lose():
    rng = np.random.default_rng(4)
    normal = rng.normal(size=(6, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    horizon = TerrainHorizon(8 + 6 * np.sin(np.radians(3 * uniform(0).azimuth)))
    rays = rng.normal(size=(400_000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hidden = ~is_above(horizon, rays) & (rays[:, 2] > 0)
    share = 4 * np.maximum(rays @ normal.T, 0) * hidden[:, None]  # uniform over the sphere
    assert_mean(
        share.mean(axis=0), share.std(axis=0) / np.sqrt(len(rays)), horizon.lost_sky(normal)
    )


@pytest.fixture(scope="module")
def slopes():
    """A level surface, a wall and a roof, of which none stands in front of another."""
    starts, tilts = [(0, 12, 5), (5, 0, -6), (10, 0, 0)], np.radians([0, 90, 35])
    south = [[0, 4 * np.cos(tilt), 4 * np.sin(tilt)] for tilt in tilts]
    return join([strip(start, [4, 0, 0], up, 1) for start, up in zip(starts, south, strict=True)])


@pytest.mark.parametrize(
    ("estimator", "shape"),
    [("gather", uniform), ("gather", valley), ("rays", valley), ("forward", uniform)],
)
def test_estimators_lose_the_sky_behind_a_ridge(slopes, tmp_path, estimator, shape):
    """Terrain above the horizontal reflects as the far ground does."""
    horizon = read_horizon_table(write_angles(tmp_path / "ridge.csv", shape(10), step=1))
    settings = {
        "horizon": horizon.source,
        "max_bounces": 1,
        "albedo": 0.0,
        "ground_albedo": 0.4,
        "threads": 1,
    }
    settings |= {"effects": RAYS} if estimator == "rays" else {}
    settings["samples"] = 1 << (17 if estimator == "forward" else 12)
    found = RUNS.get(estimator, run_gather)(slopes, suns_towards([[0, -0.6, 0.8]]), **settings)
    upward = slopes.surfaces.normal[:, 2]
    lost = horizon.lost_sky(slopes.surfaces.normal)
    sky, ground = (1 + upward) / 2 - lost, (1 - upward) / 2 + lost
    error = found.diffuse_relative_standard_error
    assert (error < 0.02).all() and (lost > 0.01).all()
    assert_mean(found.diffuse_relative, error + 1e-4, sky + 0.4 * ground)
    assert_mean(found.sky_view_factor, error + 1e-4, sky)
    assert_mean(found.far_ground_view_factor, error / 0.4 + 1e-4, ground)
    if estimator == "gather":
        assert found.sky_view_factor == pytest.approx(sky, abs=1e-6)


@pytest.mark.slow
def test_a_level_horizon_changes_no_bit(tmp_path):
    scene = scene_of_triangles(
        [(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 4, 4), (4, 4, 0)], [(0, 1, 2), (2, 4, 3)]
    )
    suns = suns_towards([[0.3, -0.6, 0.5], [0.8, 0.1, 0.05]])
    level = {
        "horizon": write_angles(tmp_path / "level.csv", uniform(0)),
        "effects": {"terrain-horizon": True},
    }
    with_it, without = (run_gather(scene, suns, threads=1, **settings) for settings in (level, {}))
    for name in (
        "diffuse_relative",
        "visible_share",
        "direct_reflected",
        "direct_annual_standard_error",
    ):
        assert (getattr(with_it, name) == getattr(without, name)).all(), name


# Suns


@pytest.mark.slow
def test_suns_behind_the_ridge_are_off_hour_by_hour():
    """Unshaded level ground and walls: light of the hours in which pvlib has the sun above 10°."""
    weather = read_weather("clear-sky", *BERLIN)
    times = weather.data.index
    transfer = unshaded_transfer(hourly_suns(times, HOUR, *BERLIN), [0, 90, 90], [0, 180, 90])
    energy = compute_energy(replace(transfer, terrain=uniform(10)), weather, threads=1)
    sun = pvlib.solarposition.get_solarposition(times + HOUR / 2, *BERLIN)
    seen, sunny = sun["apparent_elevation"] >= 10, sun["apparent_elevation"] >= 2
    for row, (tilt, azimuth) in enumerate([(0, 0), (90, 180), (90, 90)]):
        cosine = pvlib.irradiance.aoi_projection(
            tilt, azimuth, sun["apparent_zenith"], sun["azimuth"]
        ).clip(lower=0)
        ground = (
            0.25 * (1 - np.cos(np.radians(tilt))) / 2 * np.cos(np.radians(sun["apparent_zenith"]))
        )
        direct = ((cosine + ground) * seen)[sunny].mean()
        assert energy.direct_relative_annual[row] == pytest.approx(direct, rel=1e-6)
        poa = (weather.data["dni"].to_numpy() * (cosine + ground) * seen).sum()
        poa += weather.data["dhi"].sum() * transfer.diffuse_relative[row]
        assert energy.poa_global_annual[row] == pytest.approx(poa / 1000, rel=1e-6)
    whole = compute_energy(transfer, weather, threads=1)
    assert (energy.full_load_hours < whole.full_load_hours).all()


def test_a_low_horizon_is_left_out_with_its_height_as_the_reason(slopes, tmp_path):
    for height, on in ((1.9, False), (2.1, True)):
        path = write_angles(tmp_path / f"{height}.csv", uniform(height))
        patches = Patches.of_scene(slopes, np.full(len(slopes.triangles), 0.2), 0)
        plan = plan_effects(slopes, patches, Request(horizon=path))
        assert plan["terrain-horizon"].on == on and f"{height}°" in plan["terrain-horizon"].reason
        assert (plan.terrain is None) == (not on)


@pytest.mark.slow
def test_a_ridge_hides_the_horizon_of_perez(slopes, tmp_path):
    """The band at the horizon, 6.5° high: all of it behind a ridge of 10°, its upper half behind
    one of 3.25°.
    """
    for height, left in ((10.0, 0.0), (3.25, 0.5)):
        path = write_angles(tmp_path / f"{height}.csv", uniform(height))
        for effects, run in (({}, run_gather), (RAYS, run_gather), ({}, run_forward)):
            settings = {
                "horizon": path,
                "sky": "perez",
                "max_bounces": 0,
                "samples": 1 << 14,
                "threads": 1,
            }
            found = run(slopes, suns_towards([[0, -0.6, 0.8]]), effects=effects, **settings)
            expected = left * np.sin(np.radians(slopes.surfaces.surface_tilt))
            assert_mean(
                found.sources["horizon"].view_factor,
                found.sources["horizon"].standard_error + 1e-3,
                expected,
            )


# -- files of horizons: formats that are read, and what is refused in one line --


def test_formats_of_angles(tmp_path):
    """Azimuth from north; PVGIS' A from the south; PVGIS' list from north, clockwise."""
    azimuth, height = np.arange(0, 360, 7.5), 10 + 8 * np.sin(np.radians(np.arange(0, 360, 7.5)))
    rows = list(zip(azimuth, height, strict=True))
    table = "\n".join(
        f"{a:.1f}\t{h:.4f}\t-30.0\t0.0\t-30.0\t0.0"
        for a, h in sorted((a - 180, h) for a, h in rows)
    )
    head = "Latitude (decimal degrees):\t36.300\nLongitude (decimal degrees):\t-84.200\n\n"
    columns = "A\tH_hor\tA_sun(w)\tH_sun(w)\tA_sun(s)\tH_sun(s)\n"
    profile = [{"A": a - 180, "H_hor": h} for a, h in rows]
    texts = {
        "two.csv": "# azimuth, elevation\n" + "\n".join(f"{a},{h:.4f}" for a, h in reversed(rows)),
        "pvgis.csv": head
        + columns
        + table
        + "\n\nA: Azimuth (0 = S, 90 = W, -90 = E) (degree)\nH_hor: height 1\n",
        "pvgis.json": json.dumps({"inputs": {}, "outputs": {"horizon_profile": profile}}),
        "turned.csv": "elevation [deg], azimuth [deg]\n"
        + "\n".join(f"{h:.4f}, {a}" for a, h in rows),
        "user.txt": "\n".join(f"{h:.4f}" for _, h in rows),
        "line.txt": " ".join(f"{h:.4f}" for _, h in rows),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        horizon = read_horizon_table(tmp_path / name)
        assert horizon.elevation_at(azimuth) == pytest.approx(height, abs=1e-3), name
        assert horizon.elevation_at(356.25) == pytest.approx(
            (height[-1] + height[0]) / 2, abs=1e-3
        ), name


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
