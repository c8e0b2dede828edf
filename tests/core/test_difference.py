"""Errors of what an edit changes: its scatter over seeds, and the same whichever of the two cities came first."""

from dataclasses import replace

import numpy as np
import pytest
from cities import box, make_city
from test_edit_light import REQUEST, annual_light, make

from citypv.core.city.edit_city import Change, edit_city
from citypv.core.light.difference import errors_of_difference
from citypv.core.light.edit_light import edit_light
from citypv.core.study import compute_energy, place_city, read_year, stand_city, trace_base

pytestmark = pytest.mark.once


@pytest.mark.slow
def test_the_error_of_a_difference_is_its_scatter():
    """A tower beside nine houses, with 16 seeds: noise that both cities share does not count."""
    city, _ = make("houses")
    change = Change(added=(make_city(box("tower", 13, -8, 5, 5, 0, 30)),))
    request = replace(REQUEST, max_bounces=2, suns="days:4")
    after, scene = edit_city(city, change), place_city(city, request)
    weather, differences, stated, apart = read_year(scene.site, request), [], [], []
    for seed in range(16):
        base = trace_base(scene, weather, replace(request, seed=seed))
        edited = edit_light(base, stand_city(after, base.request, like=base.scene))
        found, (old, new) = errors_of_difference(base, edited)
        differences.append(annual_light(edited.transfer)[:, new] - annual_light(base.transfer)[:, old])
        for errors, one in ((stated, found), (apart, base.transfer)):
            errors.append([one.diffuse_relative_standard_error, one.direct_annual_standard_error])
    counted = found.surfaces.eligible
    scatter = np.var(differences, axis=0, ddof=1)[:, counted].mean(axis=1)
    told, alone = (np.square(errors).mean(axis=0) for errors in (stated, apart))
    ratio = np.sqrt(told[:, counted].mean(axis=1) / scatter)
    assert (ratio > 0.8).all()
    assert (ratio < 1.25).all()
    assert (told[:, counted].mean(axis=1) < alone[:, old][:, counted].mean(axis=1)).all()


def test_the_error_of_a_difference_is_the_same_both_ways():
    """Of an edit and of its undoing, whichever of the two cities knows what the choice of suns adds to its error."""
    city, request = make("row")
    scene = place_city(city, request)
    base = trace_base(scene, read_year(scene.site, request), request)
    after = edit_city(city, Change(raised={"b3": 9.0}))
    edited = edit_light(base, stand_city(after, base.request, like=base.scene))
    weather, errors = read_year(scene.site, request), []
    record = replace(base.transfer.record, sun_sampling={"bias": 1.0, "rms": 2.0})
    leaf = base.city.states[0]
    states = [replace(leaf, transfer=replace(leaf.transfer, record=record))]
    knows = replace(base, city=replace(base.city, states=states))
    for pair in ((knows, edited), (edited, knows)):
        found, _ = errors_of_difference(*pair)
        errors.append(compute_energy(found, weather, request).full_load_hours_standard_error)
    errors = np.nan_to_num(errors)
    assert errors[0].max() > 1
    assert errors[0] == pytest.approx(errors[1], rel=0.15, abs=0.05)
