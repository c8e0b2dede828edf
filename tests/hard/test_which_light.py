"""Which light: albedo 0 to 1, no reflection to fifty, one sample to ten million, no triangle to a
million.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scenes import join, run_gather, scene_of_triangles, strip, suns_towards
from thorough import mark_cases

from citypv.core.commands.closed_form_checks import furnace
from citypv.core.commands.plain_scenes import box
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.climate import clear_sky

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0, 0, 1]])
HOUSE = join([strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 6), *box((-5, -5, 0), (5, 5, 10))])


def trace(scene, **settings):
    return run_gather(scene, SUNS, **settings)


def trace_all(scene, **settings):
    """Every patch sends rays, also those known in closed form."""
    return trace(scene, effects={"sky-rays": True, "shadow-rays": True}, **settings)


# Albedo


@pytest.mark.parametrize(
    ("albedo", "bounces"),
    mark_cases(
        [(0.0, 3), (0.25, 0), (0.25, 1), (0.25, 10), (0.999, 50), (1.0, 3), (1.0, 50)],
        kept=2,
        law=(2,),
    ),
)
def test_closed_furnace(albedo, bounces):
    """(1 - ρⁿ⁺¹)/(1 - ρ) on every face, n + 1 at ρ = 1: no light is lost and none is made."""
    expected = bounces + 1 if albedo == 1 else (1 - albedo ** (bounces + 1)) / (1 - albedo)
    assert furnace(albedo, bounces)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("albedo", "bounces"),
    [(0.0, 1), (0.0, None), (0.25, 0), (0.25, None), (0.999, 1), (1.0, 1), (1.0, 50), (1.0, None)],
)
def test_any_albedo_and_any_number_of_reflections(albedo, bounces):
    """White furnace: at albedo 1 everything is as bright as the sky, and nothing is ever brighter
    than that.

    Ground that is partly covered hands on its light by the share found open, in 64 cells: that may
    err by a percent.
    """
    transfer = trace(HOUSE, albedo=albedo, ground_albedo=albedo, max_bounces=bounces)
    for values in (
        transfer.diffuse_relative,
        transfer.direct_reflected,
        transfer.diffuse_relative_standard_error,
    ):
        assert np.isfinite(values).all()
        assert values.min() >= 0
    assert transfer.diffuse_relative.max() <= 1.01
    walls = slice(16, 24)
    if bounces == 0 or albedo == 0:
        assert transfer.diffuse_relative == pytest.approx(transfer.sky_view_factor, abs=1e-6)
    elif (
        bounces == 1
    ):  # the ground before the wall is shaded by the house, and nothing lights it up again
        assert 0.9 < transfer.diffuse_relative[walls].mean() / (0.5 + 0.5 * albedo) < 1.001
    else:
        assert transfer.diffuse_relative[walls].mean() == pytest.approx(
            0.5 + 0.5 * albedo, rel=0.04
        )


# Samples


def one_triangle(height=5.0):
    return scene_of_triangles([[0, 0, height], [3, 0, height], [0, 2, height]], [[0, 1, 2]])


@pytest.mark.parametrize(
    ("samples", "shadow_samples"), [(4, 1), (5, 2), (64, 5), (64, 16), (1000, 100)]
)
def test_few_samples(samples, shadow_samples):
    transfer = trace_all(
        one_triangle(), samples=samples, shadow_samples=shadow_samples, max_bounces=1
    )
    assert transfer.sky_view_factor == pytest.approx(1, abs=1e-6)
    assert transfer.visible_share == pytest.approx(1, abs=1e-6)
    # Rays that all agree state the error of one of them.
    assert transfer.diffuse_relative_standard_error == pytest.approx(
        1 / (-(-samples // 4) * 4), abs=1e-6
    )


@pytest.mark.slow
def test_one_shadow_point_tells_no_error():
    """Whose light is known exactly has no error; of the others it is unknown, which is not the
    same, and said.
    """
    weather = add_sun(clear_sky(52.5, 13.4, 40.0, 2021), pd.Timedelta(hours=1))
    one, four = (trace(HOUSE, shadow_samples=points) for points in (1, 2))
    roof, floor, walls = [12, 13], [14, 15], np.arange(16, 24)
    assert (one.direct_annual_standard_error[roof + floor] == 0).all()
    assert np.isnan(one.direct_annual_standard_error[walls]).all()
    assert "--shadow-samples 2" in one.record.standard_error_unknown
    energy = compute_energy(one, weather)
    assert np.isnan(energy.full_load_hours_standard_error[walls]).all()
    assert np.isfinite(energy.full_load_hours[walls]).all()
    assert np.isnan(
        energy.full_load_hours[floor] + energy.full_load_hours_standard_error[floor]
    ).all()
    assert np.isfinite(four.direct_annual_standard_error).all()
    assert four.record.standard_error_unknown is None


@pytest.mark.thorough
def test_millions_of_equal_hits_lose_nothing():
    """Every ray of an unshaded triangle reaches the sky, every shadow ray the sun: exactly 1, not
    0.9999.
    """
    count = 10_000_000
    transfer = trace_all(one_triangle(), samples=count, shadow_samples=count, max_bounces=0)
    assert transfer.record.hemisphere_rays == count
    assert transfer.sky_view_factor == pytest.approx(1, abs=1e-9)
    assert transfer.visible_share == pytest.approx(1, abs=1e-9)


# Triangles


def test_a_surface_whose_triangles_are_all_gone():
    """Its polygon stays a row of the results, without light."""
    scene = scene_of_triangles([[0, 0, 5], [3, 0, 5], [0, 2, 5], [3, 2, 5]], [[0, 1, 2], [1, 3, 2]])
    kept = [0]
    parts = {
        name: getattr(scene, name)[kept]
        for name in ("triangles", "triangle_surface", "footprint", "closure")
    }
    transfer = trace(replace(scene, **parts))
    assert transfer.diffuse_relative[0] == pytest.approx(1, abs=1e-6)
    assert transfer.diffuse_relative[1] == transfer.visible_share[1].max() == 0


@pytest.mark.thorough
def test_a_million_triangles():
    """A plain of 707² squares with a few rays each: all of it sees the whole sky."""
    across = 707
    place = np.arange(across + 1, dtype=float)
    x, y = (axis.ravel() for axis in np.meshgrid(place, place, indexing="ij"))
    corner = (np.arange(across)[:, None] * (across + 1) + np.arange(across)).ravel()
    halves = [
        [corner, corner + across + 1, corner + across + 2],
        [corner, corner + across + 2, corner + 1],
    ]
    triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
    scene = scene_of_triangles(
        np.column_stack([x, y, np.zeros(len(x))]), triangles, np.zeros(len(triangles), int)
    )
    assert len(scene.triangles) == 2 * across**2
    transfer = trace_all(scene, samples=4, shadow_samples=1, max_bounces=1)
    assert transfer.sky_view_factor == pytest.approx(1, abs=1e-9)
    assert transfer.visible_share == pytest.approx(1, abs=1e-6)


# Weather


@pytest.mark.slow
def test_a_weather_year_of_zeros():
    """No light: no electricity, and no NaN from the logarithms and quotients on the way there."""
    weather = add_sun(clear_sky(52.5, 13.4, 40.0, 2021), pd.Timedelta(hours=1))
    weather.data[["ghi", "dhi", "dni"]] = 0.0
    energy = compute_energy(trace(HOUSE), weather)
    electric = ~np.isin(HOUSE.surfaces.kind, ("ground", "downward"))
    assert electric.sum() > 4
    assert (energy.full_load_hours[electric] == 0).all()
    assert (energy.poa_global_annual == 0).all()
    assert (energy.full_load_hours_standard_error[electric] == 0).all()
    assert (energy.capacity_factor == 0).all()
