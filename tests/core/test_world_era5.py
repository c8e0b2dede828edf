"""Gridded weather of a world: orders of axes, several files and years, gaps, other calendars."""

import re
from contextlib import ExitStack

import numpy as np
import pytest
import xarray as xr
from thorough import mark_cases

from citypv.core.commands.command_line import main
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.run.world_tasks import stamp_files
from citypv.core.settings.errors import InputError
from citypv.core.weather.climate import look_up_altitude
from citypv.core.weather.grid_sources import regular_axes, thin_axis
from citypv.core.weather.read_era5 import open_era5_grid, read_era5
from citypv.core.weather.read_weather import read_weather
from citypv.core.world.environment import unshaded_transfer

from .weathers import ERA5

PARTS = ("ssrd", "fdir", "t2m", "u10", "v10", "sp")
TIME, NORTH, EAST = "time", "latitude", "longitude"


@pytest.fixture(scope="module")
def demo():
    """The demonstration's grid: two latitudes and three longitudes."""
    with xr.open_dataset(ERA5) as dataset:
        return dataset[[*PARTS]].load()


def run(folder, *files, options=()):
    """Unshaded planes under the weather of some files."""
    out = folder / "out"
    arguments = [
        "world",
        "unshaded",
        "--weather",
        *map(str, files),
        "--pictures",
        "off",
        "--quiet",
        "--overwrite",
    ]
    assert main([*arguments, "--out", str(out), *options]) == 0
    with xr.open_dataset(out / "world.nc") as dataset:
        return dataset.load()


@pytest.fixture
def refusal(refused, tmp_path):
    """Returns the line in which `citypv world` refuses files."""
    return lambda *files: refused(
        "world", "unshaded", "--weather", *files, "--quiet", "--out", tmp_path / "no"
    )


def save(dataset, path):
    dataset.to_netcdf(path)
    return path


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    return run(tmp_path_factory.mktemp("era5"), ERA5)


@pytest.mark.slow
def test_values_of_one_point_are_those_of_yield(tmp_path, expected):
    """The file's own point, computed like a city there."""
    assert dict(expected.sizes) | {"latitude": 2, "longitude": 3, "group": 8} == dict(
        expected.sizes
    )
    assert (expected["weather"] == 3).all()
    place = float(expected.latitude[1]), float(expected.longitude[2])
    weather = read_weather(ERA5, *place, look_up_altitude(*place))
    energy = compute_energy(unshaded_transfer(), weather, sky="perez")
    hours = energy.capacity_factor.sum(axis=0)
    np.testing.assert_allclose(expected["full_load_hours"][1, 2, 0], hours, rtol=1e-4)
    assert expected["group"].to_numpy().tolist() == ["_".join(pair) for pair in energy.groups]


@pytest.mark.slow
@pytest.mark.parametrize("turn", mark_cases(["ascending", "0 to 360", "west of Greenwich"], kept=1))
def test_axes_may_run_either_way(tmp_path, demo, expected, turn):
    changed, shift = (
        demo.sortby(NORTH, ascending=not demo.indexes[NORTH].is_monotonic_increasing),
        0.0,
    )
    if (
        turn != "ascending"
    ):  # the same weather 15° further west, around Greenwich: the sun comes an hour later
        shift, moved = -15.0, demo[EAST].to_numpy() - 15.0
        later = demo[TIME] + np.timedelta64(1, "h")
        changed = demo.assign_coords(
            {EAST: moved % 360.0 if turn == "0 to 360" else moved, TIME: later}
        )
    found = run(tmp_path, save(changed, tmp_path / "changed.nc"))
    assert (np.diff(found["longitude"]) > 0).all()
    assert (np.diff(found["latitude"]) > 0).all()
    np.testing.assert_allclose(found["longitude"], expected["longitude"] + shift, atol=1e-4)
    # The declination moves on within the hour.
    np.testing.assert_allclose(
        found["full_load_hours"], expected["full_load_hours"], rtol=1e-3 if shift else 1e-6
    )


@pytest.mark.slow
def test_variables_and_times_may_be_in_several_files(tmp_path, demo, expected, refusal):
    half = demo.sizes[TIME] // 2
    files = [
        save(demo[["ssrd", "fdir"]].isel({TIME: slice(0, half)}), tmp_path / "a.nc"),
        save(demo[["ssrd", "fdir"]].isel({TIME: slice(half, None)}), tmp_path / "b.nc"),
        save(demo[["t2m", "u10", "v10", "sp"]], tmp_path / "c.nc"),
    ]
    found = run(tmp_path, *files)
    np.testing.assert_allclose(found["full_load_hours"], expected["full_load_hours"], rtol=1e-5)
    files.pop(1)
    refusal(*files)


@pytest.mark.slow
def test_years_are_averaged_and_chosen(tmp_path, demo, expected):
    later = demo.assign_coords({TIME: demo[TIME] + np.timedelta64(365 * 24, "h")})
    later["ssrd"], later["fdir"] = later["ssrd"] * 0.9, later["fdir"] * 0.9
    files = ERA5, save(later, tmp_path / "later.nc")
    both = run(tmp_path, *files)["full_load_hours"]
    once = run(tmp_path, *files, options=("--years", "2017", "2017"))
    assert once.attrs["comment"].endswith("years 2017; 1 year; DC without losses")
    first = once["full_load_hours"]
    second = run(tmp_path, *files, options=("--years", "2018"))["full_load_hours"]
    np.testing.assert_allclose(both, (first + second) / 2, rtol=1e-3)
    np.testing.assert_allclose(first, expected["full_load_hours"], rtol=1e-4)
    assert (second < first).all()


@pytest.mark.slow
def test_a_point_without_values_stays_blank_and_a_gap_is_refused(tmp_path, demo, expected, refusal):
    blank = demo.copy(deep=True)
    for name in blank.data_vars:
        blank[name][:, 0, 1] = np.nan
    found = run(tmp_path, save(blank, tmp_path / "blank.nc"))
    assert int((found["weather"] == 0).sum()) == 1
    assert int(np.isnan(found["full_load_hours"][..., 0]).sum()) == 1
    # a point that lacks a variable, as where temperature is that of a land model
    sea = demo.copy(deep=True)
    sea["t2m"][:, 0, 1] = np.nan
    assert int((run(tmp_path, save(sea, tmp_path / "sea.nc"))["weather"] == 0).sum()) == 1
    gap = demo.copy(deep=True)
    gap["t2m"][100, 1, 1] = np.nan
    path = save(gap, tmp_path / "gap.nc")
    said = refusal(path)
    assert "temp_air is missing" in said and "gap.nc at " in said


@pytest.mark.slow
def test_what_is_missing_or_odd_is_refused_in_one_line(tmp_path, demo):
    with ExitStack() as stack, pytest.raises(InputError, match="variables fdir"):
        open_era5_grid([save(demo.drop_vars("fdir"), tmp_path / "fdir.nc")], stack)
    other = save(demo.isel({NORTH: slice(0, 1)}), tmp_path / "other.nc")
    with ExitStack() as stack, pytest.raises(InputError, match="not those of the other files"):
        open_era5_grid([ERA5, other], stack)
    days = xr.date_range(
        "2017-01-01", periods=360 * 24, freq="h", calendar="360_day", use_cftime=True
    )
    odd = demo.isel({TIME: slice(0, len(days))}).assign_coords({TIME: days})
    odd[TIME].attrs.clear()
    with ExitStack() as stack, pytest.raises(InputError, match="standard calendar"):
        open_era5_grid([save(odd, tmp_path / "odd.nc")], stack)


@pytest.mark.slow
def test_a_grid_is_thinned_and_cut(tmp_path, expected):
    found = run(tmp_path, ERA5, options=("--step", "0.5", "--latitudes", "52.5", "53"))
    assert found.sizes["latitude"] == 1
    assert found.sizes["longitude"] == 2
    np.testing.assert_allclose(
        found["full_load_hours"][0, 1], expected["full_load_hours"][1, 2], rtol=1e-6
    )


def test_a_region_across_the_date_line_is_cut_and_thinned():
    axis = np.arange(-180.0, 180.0, 2.5)
    assert axis[thin_axis(axis, None, (175.0, -175.0))].tolist() == [-180, -177.5, -175, 175, 177.5]
    assert axis[thin_axis(axis, 5.0, (172.5, -175.0))].tolist() == [
        -177.5,
        172.5,
        177.5,
    ]  # from its western edge on
    assert regular_axes(5.0, None, (170.0, -170.0))[1].tolist() == [-180, -175, -170, 170, 175]


@pytest.mark.thorough
def test_a_later_file_fills_what_an_earlier_one_lacks(tmp_path, demo, expected):
    """Final and preliminary data as two files of all hours, each with gaps where the other has
    values.
    """
    early = np.arange(demo.sizes[TIME]) < 5000
    parts = demo.where(xr.DataArray(early, dims=TIME)), demo.where(xr.DataArray(~early, dims=TIME))
    files = [save(part, tmp_path / f"{number}.nc") for number, part in enumerate(parts)]
    for order in (files, files[::-1]):
        np.testing.assert_allclose(
            run(tmp_path, *order)["full_load_hours"], expected["full_load_hours"], rtol=1e-5
        )


@pytest.mark.slow
def test_further_dimensions_are_dropped_or_refused(tmp_path, demo, expected, refusal):
    """Members of an ensemble, steps of a forecast, points in a list, curved grids."""
    found = run(tmp_path, save(demo.expand_dims(number=[0], surface=[0.0]), tmp_path / "single.nc"))
    np.testing.assert_array_equal(found["full_load_hours"], expected["full_load_hours"])
    small = demo.isel({TIME: slice(0, 48)})
    curved = small.rename({NORTH: "y", EAST: "x"}).reset_coords(drop=True).drop_vars(["y", "x"])
    around = np.meshgrid(demo[EAST], demo[NORTH])
    odd = {
        "number (2)": xr.concat([small, small], "number"),
        "x (3)": curved.assign_coords(
            {NORTH: (("y", "x"), around[1]), EAST: (("y", "x"), around[0])}
        ),
        "p (6)": small.stack(p=(NORTH, EAST)).reset_index("p"),
        "latitude of 91°": small.assign_coords({NORTH: [91.0, 52.0]}),
        "latitude of nan°": small.assign_coords({NORTH: [np.nan, 52.0]}),
        "latitude 52° twice": small.assign_coords({NORTH: [52.0, 52.0]}),
    }
    for number, (words, dataset) in enumerate(odd.items()):
        path = save(dataset, tmp_path / f"odd{number}.nc")
        said = refusal(path)
        assert words in said and path.name in said


@pytest.mark.slow
def test_a_time_that_a_file_has_twice_is_refused_as_by_yield(tmp_path, demo, refusal):
    """Two values of one hour: nobody knows which is right. Sorted or not, alone or beside other
    files.
    """
    other = demo.isel({TIME: slice(4000, 4200)}) * 2
    twice = xr.concat([demo, other.assign_coords({TIME: demo[TIME][4000:4200]})], TIME)
    twice = twice.assign({name: twice[name].assign_attrs(demo[name].attrs) for name in twice})
    one, further = (
        save(twice[["ssrd", "fdir"]].sortby(TIME), tmp_path / "one.nc"),
        save(twice, tmp_path / "further.nc"),
    )
    for files in ([further], [ERA5, further], [one, ERA5]):
        said = refusal(*files)
        assert "has the time 2017-06-" in said and " twice; give each once" in said
        with pytest.raises(InputError, match=r"has the time 2017-06-.* twice"):
            read_era5(files, 52.5, 13.5, 34.0, "nearest")


@pytest.mark.slow
def test_wrong_times_have_a_cure_that_a_grid_allows(tmp_path, demo, refusal):
    path = save(
        demo.assign_coords({TIME: demo[TIME] + np.timedelta64(2, "h")}), tmp_path / "late.nc"
    )
    error = refusal(path)
    assert (
        "end the interval" in error
        and re.search(r"1[12]\d min earlier", error)
        and "--" not in error
    )


def test_kept_tasks_of_changed_weather_are_not_used(tmp_path, demo):
    """The same name with other contents is other weather."""
    path = save(demo, tmp_path / "a.nc")
    first = stamp_files(str(path))
    assert first == stamp_files([str(path)])
    save(demo.isel({NORTH: [0]}), path)
    assert first != stamp_files(str(path)) != stamp_files("climate")
