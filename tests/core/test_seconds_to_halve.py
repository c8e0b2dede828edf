"""Seconds to halve the standard error against the errors of runs that took so long."""

from dataclasses import replace

import numpy as np
import pytest
from transfers import Horizons

from citypv.core.accuracy.yield_errors import seconds_of_rounds, seconds_to_halve, times_more
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.sun.sun_sampling import choose_suns


@pytest.mark.parametrize("fixed", [0.0, 0.01, 0.1, 0.3])
def test_after_that_the_error_is_half(fixed):
    more = times_more(np.array([1.0]), np.array([fixed]))[0]
    assert fixed or more == 3.0  # three times as long again
    assert np.sqrt(1.0 / (1 + more) + fixed) == pytest.approx(np.sqrt(1.0 + fixed) / 2)


def test_where_fixed_errors_are_too_large_no_time_is_enough():
    assert times_more(np.array([3.0, 2.0, 0.0]), np.array([1.0, 1.0, 1.0])).tolist() == [np.inf] * 3
    assert np.isnan(times_more(np.zeros(1), np.zeros(1))).all()


def test_a_quarter_of_the_variance_is_half_of_the_reported_error(berlin):
    suns = choose_suns("days:4", berlin.data.index, berlin.interval, berlin.latitude, berlin.longitude)
    transfer = Horizons(30).transfer(suns)
    seconds = {"plan and tree": 100.0, "sky and reflections": 4.0, "suns": 6.0}
    transfer = replace(transfer, record=replace(transfer.record, seconds=seconds))
    energy = compute_energy(transfer, berlin)
    assert seconds_of_rounds(transfer) == 10.0
    found = seconds_to_halve(transfer, berlin, energy)
    known = np.isfinite(energy.full_load_hours)
    assert known.any()
    np.testing.assert_allclose(found[known], 30.0)
    assert np.isnan(found[~known]).all()
    # Four times the rounds: a quarter of the variances of rays.
    names = ("diffuse_relative_standard_error", "direct_annual_standard_error")
    better = replace(transfer, **{name: getattr(transfer, name) / 2 for name in names})
    errors = [compute_energy(one, berlin).full_load_hours_standard_error[known] for one in (transfer, better)]
    np.testing.assert_allclose(errors[1], errors[0] / 2)


def test_no_time_is_known_without_a_record(berlin):
    suns = choose_suns("days:4", berlin.data.index, berlin.interval, berlin.latitude, berlin.longitude)
    transfer = replace(Horizons(5).transfer(suns), record=None)
    assert np.isnan(seconds_to_halve(transfer, berlin, compute_energy(transfer, berlin))).all()
