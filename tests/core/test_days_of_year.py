"""Days spread over the year: interpolation between them against closed forms, at every latitude and
time step.
"""

import numpy as np
import pandas as pd
import pytest
from test_suns import sunny_directions
from thorough import mark_cases
from weathers import HOUR, year_of

from citypv.core.sun.days_of_year import EPOCH, cubic_weights
from citypv.core.sun.solar_position import solar_days
from citypv.core.sun.sun_sampling import choose_suns, match_suns

PLACES = [(0.0, 0.0), (52.5, 13.4), (-33.4, -70.8), (66.56, 25.0), (75.0, 179.9), (90.0, 0.0)]


def angles(suns, times, interval, latitude, longitude):
    """Angles [°] between the places that the traced suns make of the sunny intervals' own, and
    these.
    """
    match = match_suns(suns, times, interval, latitude, longitude)
    direction, sunny = sunny_directions(times, interval, latitude, longitude)
    np.testing.assert_allclose(match.weight.sum(axis=1), sunny, atol=1e-5)
    assert (match.index[match.weight == 0] == 0).all()
    place = np.einsum("tk,tkx->tx", match.weight[sunny], suns.direction[match.index[sunny]])
    place /= np.linalg.norm(place, axis=1, keepdims=True)
    return np.degrees(
        2 * np.arcsin(np.clip(np.linalg.norm(place - direction[sunny], axis=1) / 2, 0, 1))
    )


def test_cubics_are_met_exactly():
    rng = np.random.default_rng(3)
    nodes = np.sort(rng.uniform(-5, 5, (200, 4)), axis=1) + np.arange(4)
    place = nodes[:, 1] + rng.random(200) * (nodes[:, 2] - nodes[:, 1])
    weight = cubic_weights(place, nodes, np.ones((200, 4), bool))
    for power in range(4):
        np.testing.assert_allclose(
            (weight * nodes**power).sum(axis=1), place**power, rtol=1e-8, atol=1e-8
        )
    middle = cubic_weights(np.array([0.5]), np.array([[-1.0, 0, 1, 2]]), np.ones((1, 4), bool))
    np.testing.assert_allclose(middle, [[-1 / 16, 9 / 16, 9 / 16, -1 / 16]])


def test_where_nodes_are_missing():
    known = np.array([[0, 1, 1, 1], [1, 1, 0, 1], [1, 0, 1, 1], [1, 0, 0, 1]], bool)
    weight = cubic_weights(np.full(4, 0.25), np.tile([-1.0, 0.0, 1.0, 2.0], (4, 1)), known)
    np.testing.assert_allclose(
        weight, [[0, 0.75, 0.25, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]]
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("latitude", "longitude", "minutes"),
    mark_cases(
        [(*place, 60) for place in PLACES]
        + [(52.5, 13.4, minutes) for minutes in (10, 20)]
        + [(-90.0, 0.0, 15)],
        kept=3,
    ),
)
def test_the_suns_place_is_met_at_every_time_step(latitude, longitude, minutes):
    interval = pd.Timedelta(minutes=minutes)
    times = year_of(freq=interval)
    suns = choose_suns("days:24", times, interval, latitude, longitude)
    assert suns.direction[:, 2].min() >= 0
    assert suns.weight.sum() == pytest.approx(1) and suns.weight.min() >= 0
    assert len(suns) < 24 * 24 * 60 / max(minutes, 15) * 0.56
    found = angles(suns, times, interval, latitude, longitude)
    # Days lie 15.2 apart: far from sunrise and sunset a cubic misses the analemma by less than a
    # hundredth of a degree.
    assert np.median(found) < 0.03
    assert np.quantile(found, 0.9) < 1.0
    assert found.max() < 7.0


@pytest.mark.slow
@pytest.mark.law
def test_a_day_for_every_day_is_every_hour():
    suns = choose_suns("days:365", year_of(), HOUR, 52.5, 13.4)
    assert angles(suns, year_of(), HOUR, 52.5, 13.4).max() < 1e-4


@pytest.mark.slow
def test_the_year_of_tracing_does_not_matter():
    """Another year, many years, a year before 1970: the season is that of the sun, not of the
    calendar.
    """
    suns = choose_suns("days:24", year_of(2017), HOUR, 52.5, 13.4)
    for times in (year_of(2016), year_of(2000, 2001), year_of(1959)):
        assert np.median(angles(suns, times, HOUR, 52.5, 13.4)) < 0.1
    old = choose_suns("days:24", year_of(1959), HOUR, 52.5, 13.4)
    assert old.day.min() >= pd.Timestamp("1958-12-31").toordinal()
    assert np.median(angles(old, year_of(1959), HOUR, 52.5, 13.4)) < 0.03
    several = choose_suns("days:24", year_of(2015, 2017), HOUR, 52.5, 13.4)
    assert len(np.unique(several.day)) == 24
    assert np.median(angles(several, year_of(2015, 2017), HOUR, 52.5, 13.4)) < 0.03


def test_days_are_spread_evenly():
    suns = choose_suns("days:24", year_of(), HOUR, 52.5, 13.4)
    dates = np.unique(suns.day)
    gaps = np.diff(np.append(dates, dates[0] + 365))
    assert set(gaps) <= {15, 16} and len(dates) == 24
    day, _ = solar_days(year_of(), HOUR, 13.4)
    assert np.isin(dates - EPOCH, day).all()


@pytest.mark.slow
def test_few_days_take_the_nearest():
    """Days more than 60 days apart are not joined."""
    suns = choose_suns("days:4", year_of(), HOUR, 52.5, 13.4)
    assert match_suns(suns, year_of(), HOUR, 52.5, 13.4).index.shape[1] == 1
    assert angles(suns, year_of(), HOUR, 52.5, 13.4).max() < 26
