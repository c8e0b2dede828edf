"""Bounds of light beyond the last reflection, against closed forms and against runs that follow 30."""

from dataclasses import replace

import numpy as np
import pvlib
import pytest
from scenes import suns_towards
from test_effects import bowl

from citypv.core.commands.judge_light import judge_light
from citypv.core.effects.effect import judge
from citypv.core.effects.reflections import bound_beyond, certainty_of, look_at_years, share_beyond, years_of
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.settings.request import Request
from citypv.core.study import prepare_study, read_scene, read_year, trace_scene
from citypv.core.sun.plausible_years import OVERCAST, clear_year, hours_of_suns, overcast_year

CHEAP = {"suns": "days:4", "samples": 64, "shadow_samples": 4, "threads": 1}
SINGLE = {"samples": 16, "shadow_samples": 1, "suns": "days:2", "threads": 1}
MANY = 30


def test_clear_and_overcast_years():
    """Clear as pvlib's own `Location` has it; clouds let a quarter through."""
    weather = read_year(bowl().site, Request(weather="clear-sky"))
    cloudy = replace(weather, data=weather.data.assign(ghi=1.0, dni=0.0, dhi=1.0))
    clear, overcast = clear_year(cloudy).data, overcast_year(clear_year(cloudy)).data
    place = pvlib.location.Location(weather.latitude, weather.longitude, altitude=weather.altitude)
    expected = place.get_clearsky(weather.data.index + weather.interval / 2)
    for name in ("ghi", "dni", "dhi"):
        assert clear[name].sum() == pytest.approx(expected[name].sum(), rel=1e-3)
    assert (overcast["dni"] == 0).all()
    assert overcast["dhi"].sum() == pytest.approx(OVERCAST * expected["ghi"].sum(), rel=1e-3)


def test_hours_of_suns_without_a_weather():
    """Three suns, one of which stands for half of the hours."""
    suns = suns_towards([[0, 0, 1], [0, 1, 1], [1, 0, 1]])
    hours = hours_of_suns(replace(suns, weight=np.array([0.5, 0.25, 0.25]))).data
    places, counts = np.unique(hours.round(6).to_numpy(), axis=0, return_counts=True)
    assert places == pytest.approx(np.array([[0, 0], [45, 0], [45, 90]]), abs=1e-6)
    assert counts / len(hours) == pytest.approx([0.5, 0.25, 0.25])
