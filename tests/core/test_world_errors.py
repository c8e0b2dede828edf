"""Standard errors of a world: those of `yield`, and as large as the scatter of Transfers with known
noise.
"""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from citypv.core.commands.command_line import main
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import dc_system
from citypv.core.light.transfer import ErrorParts, SourceLight
from citypv.core.results.transfer_file import write_transfer
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.weather.grid_sources import station_source
from citypv.core.weather.read_weather import read_weather
from citypv.core.world.compute_world import compute_world
from citypv.core.world.environment import build_environment, unshaded_transfer
from citypv.core.world.group_errors import add_mix, parse_mix
from citypv.core.world.merge_surfaces import merge_surfaces

from .transfers import Horizons
from .weathers import BARROW, PVGIS

COUNT = 60
AS_YIELD = 0.02  # one ratio of hours to irradiance for each group, not for each surface
DRAWS = 40
NOISE = 0.004  # of relative irradiances
SYSTEM = dc_system()


@pytest.fixture(scope="module")
def town():
    """A Transfer with all parts of errors, each of which counts."""
    transfer, rng = Horizons(COUNT, seed=3).transfer(sky_grid_suns(400)), np.random.default_rng(4)
    view = np.hypot(*transfer.surfaces.normal[:, :2].T) * rng.random(COUNT)
    own = rng.uniform(0.005, 0.02, (2, COUNT))
    common = 0.01 * rng.normal(size=8)
    passed_on = common + 0.005 * rng.normal(size=(2, COUNT, 8))
    grid = rng.normal(0.001, 0.002, (2, COUNT))
    whole = np.sqrt(own**2 + passed_on.var(axis=-1, ddof=1) / 8 + grid**2)
    covariance = rng.uniform(-0.9, 0.5, COUNT) * own.prod(axis=0)
    return replace(
        transfer,
        sources={
            "horizon": SourceLight(
                view, view + 0.1 * rng.random(COUNT), rng.uniform(0.001, 0.01, COUNT)
            )
        },
        diffuse_relative_standard_error=whole[0],
        direct_annual_standard_error=whole[1],
        error_parts=ErrorParts(*passed_on, *grid, covariance, np.zeros(COUNT)),
        record=replace(transfer.record, sun_sampling={"of_groups": 0.4, "rms": 0.5}),
    )


def world_at(environments, weathers, sky="isotropic"):
    source = station_source(weathers, [str(number) for number in range(len(weathers))])
    return compute_world(environments, source, SYSTEM, threads=1, sky=sky)


def world_of(transfer, weathers):
    return world_at([build_environment("town", "test", transfer, SYSTEM)], weathers)


@pytest.mark.slow
@pytest.mark.parametrize("sky", ["isotropic", "perez"])
def test_errors_are_those_of_yield(town, sky):
    """The Arctic, 45° N, and a clear sky at the equator: shares of direct light from a third to
    four fifths.
    """
    weathers = [read_weather(path, 0.0, 0.0) for path in (BARROW, PVGIS)]
    weathers.append(read_weather("clear-sky", 0.0, 10.0, 0.0))
    environment = build_environment("town", "test", town, SYSTEM, sky)
    world = world_at([environment], weathers, sky)
    merged = world_at([merge_surfaces(environment, COUNT // 2)], weathers, sky)
    for row, weather in enumerate(weathers):
        energy = compute_energy(town, weather, SYSTEM, threads=1, sky=sky)
        assert world.groups == energy.groups
        np.testing.assert_allclose(
            world.standard_error[row, 0, :, 0], energy.group_standard_error, rtol=AS_YIELD
        )
        np.testing.assert_allclose(
            merged.standard_error[row, 0, :, 0], energy.group_standard_error, rtol=AS_YIELD
        )
    relative = world.standard_error[:, 0, :, 0] / world.full_load_hours[:, 0, :, 0]
    assert (
        np.ptp(relative, axis=0) > 0.05 * relative.mean(axis=0)
    ).any()  # one share for all places would not do


@pytest.mark.thorough
def test_errors_are_as_large_as_the_scatter():
    """Of the year and the gain: noise of known size in the reflected light of single surfaces, and
    in the visible sky, beside which rays meet faces of half its brightness.
    """
    plain, rng = Horizons(COUNT, seed=3).transfer(sky_grid_suns(100)), np.random.default_rng(7)
    plain.direct_reflected += np.float32(0.05)
    np.clip(plain.sky_view_factor, 0.1, 0.9, out=plain.sky_view_factor)
    plain.diffuse_relative[:] = (1 + plain.sky_view_factor) / 2
    plain.direct_annual_standard_error[:] = NOISE
    plain.diffuse_relative_standard_error[:] = 2 * NOISE
    weathers = [read_weather(BARROW, 0.0, 0.0), read_weather(PVGIS, 0.0, 0.0)]

    def noisy():
        diffuse, direct = rng.normal(size=(2, COUNT, 1)) * NOISE
        return replace(
            plain,
            diffuse_relative=plain.diffuse_relative + 2 * diffuse[:, 0],
            sky_view_factor=plain.sky_view_factor + 4 * diffuse[:, 0],
            direct_reflected=plain.direct_reflected + direct.astype(np.float32),
        )

    stated, draws = world_of(plain, weathers), [world_of(noisy(), weathers) for _ in range(DRAWS)]
    annual = np.array([one.full_load_hours[:, 0, :, 0] for one in draws])
    gain = np.array(
        [one.full_load_hours[:, 0, :, 0] / one.without_reflections[:, 0, :, 0] for one in draws]
    )
    # Some 6 independent groups of 40 draws: 9 % of the variance; hours are proportional to light
    # within 10 %.
    ratio = annual.var(axis=0, ddof=1) / stated.standard_error[:, 0, :, 0] ** 2
    np.testing.assert_allclose(np.sqrt(ratio.mean(axis=1)), 1.0, atol=0.17)
    ratio = gain.var(axis=0, ddof=1) / stated.gain_error[:, 0] ** 2
    np.testing.assert_allclose(np.sqrt(ratio.mean(axis=1)), 1.0, atol=0.17)


@pytest.mark.slow
@pytest.mark.thorough
def test_months_are_as_uncertain_as_the_scatter():
    """Noise of known size, another in each direction of the grid: months have more of it than the
    year has.
    """
    plain, rng = Horizons(COUNT, seed=3).transfer(sky_grid_suns(400)), np.random.default_rng(8)
    plain.direct_reflected += np.float32(0.6)
    plain.direct_annual_standard_error[:] = NOISE
    plain.diffuse_relative_standard_error[:] = 0
    weathers = [read_weather("clear-sky", latitude, 10.0, 0.0) for latitude in (0.0, 45.0)]

    def noisy():
        noise = NOISE * 20 * rng.normal(size=(COUNT, 400)).astype(np.float32)  # 20 = √400
        return replace(plain, direct_reflected=plain.direct_reflected + noise)

    stated = world_of(plain, weathers).standard_error[:, 0]
    found = np.array(
        [world_of(noisy(), weathers).full_load_hours[:, 0, :, :13] for _ in range(DRAWS)]
    )
    ratio = found.var(axis=0, ddof=1) / stated**2
    year, months = (np.sqrt(part.mean(axis=(1, 2))) for part in (ratio[..., :1], ratio[..., 1:]))
    # The year's is that of the mean over the whole grid, of which a place meets a half or less:
    # known to be low.
    assert (year > 1).all() and (year < 2).all()
    np.testing.assert_allclose(months / year, 1.0, atol=0.17)


@pytest.mark.slow
def test_a_mix_is_the_weighted_mean_of_independent_errors_and_closed_forms_have_none(town):
    environments = [
        build_environment(name, "test", transfer, SYSTEM)
        for name, transfer in (("town", town), ("unshaded", unshaded_transfer()))
    ]
    plain = world_at(environments, [read_weather(PVGIS, 0.0, 0.0)])
    world = add_mix(plain, parse_mix("town=0.25,unshaded=.75", plain.environments))
    town_hours, unshaded, mix = world.full_load_hours[0]
    np.testing.assert_allclose(mix, 0.25 * town_hours + 0.75 * unshaded, rtol=1e-6)
    town_error, unshaded, mix = world.standard_error[0]
    assert (unshaded == 0).all() and (town_error > 0).all()
    np.testing.assert_allclose(mix, 0.25 * town_error, rtol=1e-6)
    town_gain, unshaded, mix = world.gain_error[0]
    plain = world.without_reflections[0, ..., 0]
    assert (unshaded == 0).all() and (town_gain > 0).all()
    np.testing.assert_allclose(mix, 0.25 * town_gain * plain[0] / plain[2], rtol=1e-5)


@pytest.mark.slow
def test_an_unknown_error_stays_unknown(town):
    unknown = replace(town, direct_annual_standard_error=np.full(COUNT, np.nan))
    world = world_of(unknown, [read_weather(PVGIS, 0.0, 0.0)])
    assert np.isnan(world.standard_error).all() and np.isnan(world.gain_error).all()
    assert np.isfinite(world.full_load_hours).all()


@pytest.mark.slow
def test_the_file_has_them_and_tasks_do_not_change_them(town, tmp_path):
    write_transfer(tmp_path / "transfer.nc", town)
    options = [
        "--step",
        "60",
        "--latitudes",
        "0",
        "60",
        "--longitudes",
        "0",
        "60",
        "--pictures",
        "off",
        "--quiet",
    ]
    for name, more in (("one", []), ("tasks", ["--cluster", "serial"])):
        command = [
            "world",
            str(tmp_path / "transfer.nc"),
            "unshaded",
            *options,
            *more,
            "--out",
            str(tmp_path / name),
        ]
        assert main(command) == 0
    with (
        xr.open_dataset(tmp_path / "one" / "world.nc") as one,
        xr.open_dataset(tmp_path / "tasks" / "world.nc") as two,
    ):
        for name, unit in (
            ("full_load_hours", "h"),
            ("full_load_hours_by_month", "h"),
            ("gain_by_reflections", "1"),
        ):
            values, error = one[name], one[f"{name}_standard_error"]
            assert values.attrs["ancillary_variables"] == error.name
            assert (
                error.attrs["units"] == values.attrs["units"] == unit and error.dims == values.dims
            )
            np.testing.assert_array_equal(np.isnan(error), np.isnan(values))
        hours, plain = one["full_load_hours"], one["full_load_hours_without_reflections"]
        np.testing.assert_allclose(one["gain_by_reflections"], hours / plain - 1, atol=1e-6)
        assert float((one["full_load_hours_standard_error"] / hours).max()) < 0.1
        xr.testing.assert_equal(one, two)
