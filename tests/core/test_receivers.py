"""Surfaces that pass on light without being eligible: sampled less, with the same light and honest
errors.
"""

import numpy as np
import pytest
from scenes import run_gather
from test_closed_forms import direct_relative
from test_tracing import SUNS, three_houses
from weathers import HOUR, year_of

from citypv.core.sun.sun_sampling import choose_suns


def on_ground():
    """The three houses on ground that is known as such: 12 triangles."""
    scene = three_houses()
    scene.surfaces.kind[:12], scene.surfaces.eligible[:12] = "ground", False
    return scene


def traced_for(report, suns, seed=0, samples=256, shadow_samples=16):
    return run_gather(
        on_ground(), suns, report=report, seed=seed, samples=samples, shadow_samples=shadow_samples
    )


@pytest.fixture(scope="module")
def year():
    return choose_suns("days:4", year_of(), HOUR, 52.5, 13.4)


@pytest.mark.slow
def test_receivers_keep_their_own_rays():
    """Sky and suns of surfaces whose numbers are wanted stay the same to the last bit; the others
    send a quarter.
    """
    surfaces = on_ground().surfaces
    wanted = surfaces.eligible | (surfaces.kind == "flat")
    assert 0 < wanted.sum() < len(wanted)
    few, every = traced_for("eligible", SUNS), traced_for("all", SUNS)
    for name in ("sky_view_factor", "visible_share", "covered_share"):
        assert np.array_equal(getattr(few, name)[wanted], getattr(every, name)[wanted])
    assert few.record.hemisphere_rays < every.record.hemisphere_rays
    assert few.record.shadow_rays == every.record.shadow_rays


@pytest.mark.slow
def test_light_that_others_pass_on_is_the_same(year):
    """The mean over the receivers differs by noise only, and by no more than the plan's bound."""
    surfaces = on_ground().surfaces
    area = np.where(surfaces.eligible, surfaces.area, 0)
    difference, bounds = [], []
    for seed in range(4):
        few, every = (traced_for(report, year, seed) for report in ("eligible", "all"))
        difference.append(area @ few.diffuse_relative / (area @ every.diffuse_relative) - 1)
        effect = next(effect for effect in few.record.effects if effect["key"] == "receivers")
        bounds.append(effect["outcome"]["left_out"])
    assert abs(np.mean(difference)) < 3 * np.mean(bounds) / np.sqrt(len(bounds))
    assert np.mean(bounds) < 0.01  # of twelve triangles of ground; a city has thousands


@pytest.mark.slow
def test_others_pass_on_light_from_where_it_falls(year):
    """Facades on bright ground in sun and shadow, against all points: four cells a patch would be 8
    % too bright.
    """
    surfaces = on_ground().surfaces
    facade = surfaces.eligible & (surfaces.kind == "facade")
    ratios = []
    for seed in range(3):
        runs = [traced_for(report, year, seed) for report in ("eligible", "all")]
        few, every = (one.direct_reflected @ one.suns.weight for one in runs)
        ratios.append(few[facade] / every[facade] - 1)
    assert abs(np.average(np.mean(ratios, axis=0), weights=surfaces.area[facade])) < 0.03
    assert np.sqrt((np.mean(ratios, axis=0) ** 2).mean()) < 0.05


@pytest.mark.slow
def test_others_keep_honest_errors(year):
    """Surfaces with fewer rays against many rays: errors as of four replicates (t, three degrees of
    freedom).
    """
    surfaces = on_ground().surfaces
    others = ~(surfaces.eligible | (surfaces.kind == "flat"))
    exact = traced_for("all", year, samples=16384, shadow_samples=1024)
    deviation = []
    for seed in range(1, 7):
        found = traced_for("eligible", year, seed)
        for error, standard_error in (
            (
                found.diffuse_relative - exact.diffuse_relative,
                found.diffuse_relative_standard_error,
            ),
            (
                (direct_relative(found) - direct_relative(exact)) @ year.weight,
                found.direct_annual_standard_error,
            ),
        ):
            noisy = others & (standard_error > 0)
            deviation.append(error[noisy] / standard_error[noisy])
    deviation = np.abs(np.concatenate(deviation))
    assert len(deviation) > 100
    assert 0.4 < np.median(deviation) < 1.2  # 0.765 of t with three degrees of freedom
    assert (deviation < 4).mean() > 0.9  # 97 %
