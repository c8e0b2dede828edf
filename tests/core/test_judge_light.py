"""Outcome of `terrain-horizon`: what a run left out behind a ridge or in a valley, against closed forms and pvlib."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pvlib
import pytest
from test_horizon import HOUR, uniform, valley, with_sun
from transfers import unshaded_transfer
from weathers import BERLIN, plain_table, year_of

from citypv.core.commands.judge_light import judge_terrain
from citypv.core.effects.effect import Effect
from citypv.core.effects.plan_effects import EffectPlan
from citypv.core.ground.terrain import Terrain
from citypv.core.settings.request import Request
from citypv.core.sun.hourly import hourly_suns
from citypv.core.weather.weather import Weather

KEY = "terrain-horizon"
ALBEDO = 0.25
PLANES = ((90, 0), (90, 90), (90, 180), (90, 270))  # walls, each a group of its own


@pytest.fixture(scope="module")
def year():
    """Berlin's suns in an even veil of clouds."""
    times = year_of(2021)
    data = with_sun(plain_table(times))
    return Weather(label="", data=data, interval=HOUR, latitude=BERLIN[0], longitude=BERLIN[1], altitude=0.0)


def light_of_wall(data, azimuth, height_at, lost):
    """Irradiation of an unshaded wall behind terrain, from pvlib's sun and a closed form of the lost sky."""
    sun = pvlib.solarposition.get_solarposition(data.index + pd.Timedelta(minutes=30), *BERLIN)
    seen = sun["apparent_elevation"].to_numpy() >= height_at(sun["azimuth"].to_numpy())
    cosine = pvlib.irradiance.aoi_projection(90, azimuth, sun["apparent_zenith"], sun["azimuth"]).clip(lower=0)
    direct = data["dni"].to_numpy() * seen
    level = direct * np.cos(np.radians(sun["apparent_zenith"].to_numpy())) + data["dhi"].to_numpy()
    sky, ground = 0.5 - lost, 0.5 + lost
    return (direct * cosine.to_numpy() + sky * data["dhi"].to_numpy()).sum() + ALBEDO * ground * level.sum()


def height_of_valley(azimuth):
    """Sides of 10° in the east and west; at their ends as linear as between the angles of a file."""
    return np.interp(azimuth % 180, [44.75, 45.0, 134.75, 135.0], [0, 10, 10, 0])


TEN = np.radians(10)
WALL = (TEN + np.sin(TEN) * np.cos(TEN)) / np.pi  # all around
HALF = np.sin(np.radians(45))
LOST = {  # of walls to the north, east, south and west
    "ridge": [WALL] * 4,
    "valley": [WALL * (1 - HALF), WALL * HALF] * 2,  # ∫ cos over what is in its sides
}


def plan_of(on, horizon, others, bound):
    setting = Terrain(horizon if on else None, np.zeros((0, 3), np.float32), others)
    return EffectPlan([Effect(KEY, on, "", "", bound, setting)])


def outcome_of(transfer, plan, weather):
    (found,) = judge_terrain(transfer, plan, weather, Request(sky="isotropic", threads=1)).record.effects
    return found


@pytest.mark.parametrize(("name", "shape"), [("ridge", uniform), ("valley", valley)])
def test_a_horizon_that_is_left_out_costs_what_its_closed_form_says(year, name, shape):
    suns = hourly_suns(year.data.index, HOUR, *BERLIN)
    transfer = unshaded_transfer(suns, *np.transpose(PLANES), albedo=ALBEDO)
    transfer.surfaces.eligible[:] = True
    transfer.record.effects[:] = [{"key": KEY, "on": False}]
    height_at = height_of_valley if name == "valley" else lambda azimuth: np.full(len(azimuth), 10.0)
    open_sky = [light_of_wall(year.data, azimuth, lambda one: 0 * one, 0.0) for _, azimuth in PLANES]
    hidden = [
        light_of_wall(year.data, azimuth, height_at, lost)
        for (_, azimuth), lost in zip(PLANES, LOST[name], strict=True)
    ]
    changes = np.array(hidden) / open_sky - 1
    largest = np.abs(changes).max()
    assert largest > 0.02
    for bound, holds in ((1.01 * largest, True), (0.99 * largest, False)):
        found = outcome_of(transfer, plan_of(False, None, [shape(10)], bound), year)
        assert found["outcome"]["left_out"] == pytest.approx(largest, rel=2e-3)
        assert found["outcome"]["holds"] is holds
    area = transfer.surfaces.area
    assert found["share"] == pytest.approx(1 - area @ open_sky / (area @ hidden), rel=2e-3)


def test_one_horizon_for_all_leaves_out_what_lies_between_it_and_the_corners(year):
    """Light behind 10°, where a corner of the scene has 12°: the same closed forms, both from pvlib's sun."""
    suns = hourly_suns(year.data.index, HOUR, *BERLIN)
    lost = {angle: (np.radians(angle) + np.sin(2 * np.radians(angle)) / 2) / np.pi for angle in (10, 12)}
    transfer = unshaded_transfer(suns, *np.transpose(PLANES), albedo=ALBEDO)
    transfer.surfaces.eligible[:] = True
    transfer.record.effects[:] = [{"key": KEY, "on": True}]
    transfer = replace(
        transfer,
        terrain=uniform(10),
        sky_view_factor=transfer.sky_view_factor - lost[10],
        far_ground_view_factor=transfer.far_ground_view_factor + lost[10],
        diffuse_relative=transfer.diffuse_relative - (1 - ALBEDO) * lost[10],
    )
    at = {
        angle: np.array(
            [
                light_of_wall(year.data, azimuth, lambda one, angle=angle: 0 * one + angle, lost[angle])
                for _, azimuth in PLANES
            ]
        )
        for angle in lost
    }
    found = outcome_of(transfer, plan_of(True, uniform(10), [uniform(10), uniform(12)], 0.1), year)
    assert found["outcome"]["left_out"] == pytest.approx(np.abs(at[12] / at[10] - 1).max(), rel=2e-3)
    assert found["outcome"]["holds"] and "share" not in found
    found = outcome_of(transfer, plan_of(True, uniform(10), [], 0.0), year)
    assert found["outcome"] == {"left_out": 0.0, "holds": True}
