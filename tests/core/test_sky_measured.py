"""The sky against measured walls and against ISO 52010-1, by `benchmarks/sky.py`, and what chooses
the sky.
"""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import run_gather, scene_of_triangles, strip, suns_towards
from thorough import mark_cases
from transfers import unshaded_transfer
from weathers import BARROW

from citypv.core.effects.plan_effects import plan_effects
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.transfer import SourceLight
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sky.sky_models import choose_sky, split_sky
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

BENCHMARK = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "sky.py"))
NORTH = {1: 10, 2: 14}  # [W/m²] rms allowed with Perez's sky, by period of measurement
WORSE = 3  # [W/m²] than pvlib's own Perez


@pytest.mark.slow
@pytest.mark.parametrize("period", mark_cases(NORTH, kept=1))
def test_measured_walls(period):
    """Hourly global irradiance of four walls, as measured: bounds from pvlib's own numbers."""
    found = BENCHMARK["compare_walls"](period)
    assert found["north"]["perez"][1] <= NORTH[period]
    assert found["north"]["isotropic"][1] > 20
    for wall, models in found.items():
        assert models["perez"][1] <= models["pvlib"][1] + WORSE, wall
    mean = {
        sky: np.mean([models[sky][1] for models in found.values()])
        for sky in ("isotropic", "perez")
    }
    assert mean["perez"] < 0.8 * mean["isotropic"]


@pytest.mark.slow
def test_hours_of_iso_52010():
    """No worse than pvlib's Perez; and with the norm's clearness, by the sun's altitude, the norm's
    own numbers.
    """
    found = BENCHMARK["compare_norm"]()
    assert len(found) == 4
    for plane, models in found.items():
        assert models["perez"][1] <= models["pvlib"][1] + WORSE, plane
        assert models["norm"][1] < 3, plane
        assert abs(models["norm"][0]) < 1, plane


# -- light of the sky in the energy --


def horizon_of(transfer, share):
    """The horizon of unshaded surfaces, of which a share is visible."""
    view = share * np.sin(np.radians(transfer.surfaces.surface_tilt))
    return replace(transfer, sources={"horizon": SourceLight(view, view, np.zeros(len(view)))})


@pytest.mark.slow
def test_no_sky_is_darker_than_black(berlin):
    """Where little of the dome but all of the horizon is seen, a dark horizon takes no more than
    the dome gives.
    """
    transfer = horizon_of(
        unshaded_transfer(choose_suns("days:12", *berlin.axis), [90] * 3, [0, 90, 180], albedo=0), 1
    )
    for dome in (0.5, 0.05, 0.01, 0.0):
        little = replace(
            transfer, sky_view_factor=np.full(3, dome), diffuse_relative=np.full(3, dome)
        )
        little.visible_share[:] = 0
        series = compute_energy(little, berlin, series=[0, 1, 2], sky="perez").series
        assert series.poa_diffuse.min() > -1e-9
    assert split_sky(berlin, "perez").sources["horizon"].min() < -1


@pytest.mark.slow
@pytest.mark.thorough
def test_few_and_many_surfaces_agree_under_perez(berlin):
    """pvlib itself and its tables: full load hours to 0.03 %, with the loss of diffuse light by
    incidence.
    """
    tilt, azimuth = np.repeat([90.0, 90.0, 30.0, 60.0], 150), np.tile(np.linspace(0, 359, 150), 4)
    transfer = horizon_of(
        unshaded_transfer(choose_suns("days:12", *berlin.axis), tilt, azimuth), 0.6
    )
    system = build_system(Request(iam="physical", diffuse_iam=True))
    many = compute_energy(transfer, berlin, system, sky="perez")
    few = unshaded_transfer(choose_suns("days:12", *berlin.axis), tilt[::10], azimuth[::10])
    few = compute_energy(horizon_of(few, 0.6), berlin, system, sky="perez")
    np.testing.assert_allclose(many.full_load_hours[::10], few.full_load_hours, rtol=3e-4)
    np.testing.assert_allclose(many.poa_global_annual[::10], few.poa_global_annual, rtol=1e-4)


@pytest.mark.slow
def test_annual_sums_are_those_of_the_hours(berlin):
    transfer = horizon_of(
        unshaded_transfer(choose_suns("days:12", *berlin.axis), [90, 30, 120], [180, 90, 0]), 0.5
    )
    energy = compute_energy(transfer, berlin, series=[0, 1, 2], sky="perez")
    series = energy.series
    np.testing.assert_allclose(
        (series.poa_direct + series.poa_diffuse).sum(axis=0) / 1000, energy.poa_global_annual
    )
    direct = compute_energy(transfer, berlin, series=[0, 1, 2]).series.poa_direct
    # circumsolar light counts as diffuse
    np.testing.assert_allclose(series.poa_direct, direct, atol=1e-9)


@pytest.mark.slow
def test_errors_of_the_horizon_are_carried_to_hours(berlin):
    transfer = horizon_of(
        unshaded_transfer(choose_suns("days:12", *berlin.axis), [90, 90], [180, 0]), 1
    )
    plain = compute_energy(transfer, berlin, sky="perez")
    transfer.sources["horizon"].standard_error[:] = 0.05
    found = compute_energy(transfer, berlin, sky="perez")
    dark = compute_energy(horizon_of(transfer, 0), berlin, sky="perez")
    change = plain.full_load_hours - dark.full_load_hours
    np.testing.assert_allclose(
        found.full_load_hours_standard_error, 0.05 * np.abs(change), rtol=0.15
    )


# -- which sky --


def plan_of(scene, weather=None, **settings):
    prepared = prepare_scene(scene, Request(**settings))
    return plan_effects(scene, prepared.patches, Request(**settings), weather=weather)


def test_the_plan_takes_perez_where_inclined_surfaces_count(berlin):
    level = scene_of_triangles(*strip([0, 0, 0], [10, 0, 0], [0, 10, 0], 1))
    wall = scene_of_triangles(*strip([0, 0, 0], [10, 0, 0], [0, 0, 10], 1))
    effect = plan_of(level, berlin)["perez"]
    assert not effect.on and effect.bound == 0 and "no inclined surface" in effect.reason
    effect = plan_of(wall, berlin)["perez"]
    assert effect.on and effect.bound == 0
    assert "100 m² of inclined surfaces count; it changes unshaded ones by" in effect.reason
    assert plan_of(wall)["perez"].on
    for settings in ({"sky": "isotropic"}, {"effects": {"perez": False}}):
        effect = plan_of(wall, berlin, **settings)["perez"]
        circumsolar = 0.349  # share of DHI
        assert not effect.on and effect.bound == pytest.approx(
            circumsolar / (1 - circumsolar), abs=0.005
        )
        assert plan_of(wall, **settings)["perez"].bound is None
    assert plan_of(level, berlin, sky="perez")["perez"].on


@pytest.mark.slow
def test_the_sky_of_a_transfer():
    suns = suns_towards([[0, 0, 1.0]])
    wall = scene_of_triangles(*strip([0, 0, 0], [10, 0, 0], [0, 0, 10], 1))
    auto = run_gather(wall, suns)
    assert choose_sky(Request(), auto) == "perez"
    assert choose_sky(Request(sky="isotropic"), auto) == "isotropic"
    assert choose_sky(Request(effects={"perez": False}), auto) == "isotropic"
    even = run_gather(wall, suns, sky="isotropic")
    assert even.sources == {} and even.record.source_rays == {}
    assert choose_sky(Request(), even) == "isotropic"
    assert choose_sky(Request(sky="perez"), even) == "perez"
    weather = read_weather(BARROW, 71.32, -156.62)
    with pytest.raises(
        InputError, match="--sky perez: the Transfer was traced without the light of the horizon"
    ):
        compute_energy(even, weather, sky="perez")
