"""Pictures of a world, and the numbers they show."""

import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from citypv.core.commands.command_line import main
from citypv.core.energy.pv_system import dc_system
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.grid_sources import station_source
from citypv.core.weather.weather import Record
from citypv.core.world.compute_world import compute_world
from citypv.core.world.draw_world import PICTURES
from citypv.core.world.draw_world_maps import (
    draw_world_map,
    find_gain,
    join_at_date_line,
    map_of,
    nearest_place,
    read_coast,
    write_degrees,
    write_longitude,
)
from citypv.core.world.environment import build_environment, unshaded_transfer

from .weathers import HOUR, PVGIS, year_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("world") / "out"
    options = (
        "--weather climate --off-land clear-sky --step 20 --latitudes -40 80 --longitudes -20 20 "
        "--mix city=1 --quiet"
    )
    assert main(["world", "city=unshaded", "unshaded", *options.split(), "--out", str(out)]) == 0
    return out


@pytest.mark.thorough
def test_plot_draws_them_anew(folder, tmp_path, capfd, refused):
    """From world.nc alone, the same bytes; what is no grid, or no world, ends in one line."""
    shutil.copy(folder / "world.nc", tmp_path / "world.nc")
    assert main(["plot", str(tmp_path)]) == 0
    assert capfd.readouterr().err.count(".png") == len(PICTURES)
    for name in PICTURES:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
        assert (tmp_path / name).stat().st_size > 20_000
    station = tmp_path / "station"
    assert (
        main(["world", "unshaded", "--weather", str(PVGIS), "--quiet", "--out", str(station)]) == 0
    )
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "world.nc").write_text("nothing", encoding="utf-8")
    (tmp_path / "other").mkdir()
    xr.Dataset({"weather": ("station", [1])}).to_netcdf(
        tmp_path / "other" / "world.nc", engine="h5netcdf"
    )
    problems = {
        station: "single places",
        tmp_path / "bad": "cannot be read",
        tmp_path / "other": "has no",
    }
    for place, words in problems.items():
        said = refused("plot", place)
        assert f"{place / 'world.nc'}: " in said and words in said


def test_file_follows_the_conventions(folder):
    with xr.open_dataset(folder / "world.nc") as dataset:
        assert dataset.attrs["Conventions"].startswith("CF-")
        assert dataset["latitude"].attrs == {
            "units": "degrees_north",
            "standard_name": "latitude",
            "axis": "Y",
        }
        # CF 2.5.1: coordinates have no missing values.
        assert not any("_FillValue" in dataset[name].encoding for name in dataset.coords)
        assert dataset["longitude"].attrs["units"] == "degrees_east"
        assert dataset["longitude"].to_numpy().tolist() == [-20, 0, 20]
        assert dataset["weather"].attrs["flag_meanings"].split()[2] == "clear_sky"
        assert set(np.unique(dataset["weather"])) == {1, 2}
        assert dataset["environment"].to_numpy().tolist() == ["city", "unshaded", "mix"]
        hours = dataset["full_load_hours"]
        np.testing.assert_allclose(dataset["capacity_factor"] * 8760, hours, rtol=1e-5)
        np.testing.assert_allclose(
            hours.sel(environment="mix"), hours.sel(environment="city"), rtol=1e-6
        )
        months = dataset["full_load_hours_by_month"].sum("month")
        np.testing.assert_allclose(months, hours, rtol=1e-5)


def test_gain_lies_where_the_ground_is(folder):
    """The further a facade faces away from the sun, the more of its light comes from the ground."""
    with xr.open_dataset(folder / "world.nc") as dataset:
        mean = dataset[["full_load_hours", "full_load_hours_without_reflections"]].mean("longitude")
        gain = find_gain(mean).sel(environment="unshaded", group="facade_south")
        assert (find_gain(dataset) > 0).all()
    assert float(gain.sel(latitude=-20)) > 2 * float(gain.sel(latitude=40))
    assert 5 < float(gain.sel(latitude=60)) < 25


@pytest.mark.slow
@pytest.mark.law
def test_gain_under_an_overcast_sky_is_that_of_the_closed_form():
    """Eq. 9: a facade gets 0.5 from the sky and 0.25·0.5 from the ground; 25 %, as far as power is
    linear.
    """
    times = year_of()
    data = pd.DataFrame({"ghi": 1.0, "dhi": 1.0, "temp_air": 25.0, "wind_speed": 1.0}, index=times)
    zenith = add_sun(Record(data, 20.0, 10.0, 0.0, "test", "overcast"), HOUR).data[
        "apparent_zenith"
    ]
    data["ghi"] = data["dhi"] = np.where(zenith < 80, 400.0, 0.0)
    weather = add_sun(Record(data, 20.0, 10.0, 0.0, "test", "overcast"), HOUR)
    system = dc_system()
    environment = build_environment("unshaded", "test", unshaded_transfer(), system)
    world = compute_world([environment], station_source([weather], ["overcast"]), system, threads=1)
    gain = world.full_load_hours[0, 0, :4, 0] / world.without_reflections[0, 0, :4, 0] - 1
    np.testing.assert_allclose(gain, 0.25, atol=0.015)
    np.testing.assert_allclose(gain, gain[0], rtol=1e-6)


def test_coast_lines_are_on_the_map():
    lines = read_coast()
    points = np.concatenate(lines)
    assert len(lines) > 100
    assert np.abs(points[:, 0]).max() <= 180
    assert np.abs(points[:, 1]).max() <= 90
    # No line runs across the map, and some known capes are on them.
    assert max(np.abs(np.diff(line[:, 0])).max() for line in lines) < 20
    for longitude, latitude in ((-67.3, -55.9), (18.4, -34.2), (-5.6, 36.0)):
        assert np.hypot(points[:, 0] - longitude, points[:, 1] - latitude).min() < 1.5


def test_places_are_found_across_the_date_line():
    places = {"latitude": [0.0, 20, 40], "longitude": [-180.0, -90, 0, 90]}
    values = xr.DataArray(np.ones((3, 4)), places, ("latitude", "longitude"))
    assert nearest_place(values, 19, 178) == (1, 0)
    values[1, 0] = np.nan
    assert nearest_place(values, 19, 178) == (0, 0)
    assert nearest_place(values * np.nan, 0, 0) is None
    assert [write_degrees(value, "E", "W") for value in (-10.5, 0, 20)] == ["10.5°W", "0°", "20°E"]


@pytest.mark.slow
def test_a_region_across_the_date_line_is_one_piece(folder):
    """Fiji lies between 177° E and 178° W; the map shows it once, in the middle, with both ends of
    its coast.
    """
    with xr.open_dataset(folder / "world.nc") as dataset:
        grid = (
            dataset.isel(latitude=[1, 2], longitude=[0, 1, 2])
            .load()
            .assign_coords(longitude=[-180.0, -170, 170])
        )
    turned = join_at_date_line(grid)
    assert turned["longitude"].to_numpy().tolist() == [170, 180, 190]
    west = grid["full_load_hours"].sel(longitude=-170).to_numpy()
    np.testing.assert_array_equal(turned["full_load_hours"].sel(longitude=190), west)
    assert [write_longitude(value) for value in (170, 180, 190, -180)] == [
        "170°E",
        "180°",
        "170°W",
        "180°",
    ]
    axes = draw_world_map(turned).axes[0]
    assert axes.get_xlim() == (165, 195)
    assert any(line.vertices[:, 0].min() > 180 for line in axes.collections[1].get_paths())
    # A grid around the whole Earth, and one that misses the date line, stay as they are.
    for longitude in ([-180.0, -60, 60], [0.0, 10, 20], [-30.0, 0, 20]):
        whole = grid.assign_coords(longitude=longitude)
        assert join_at_date_line(whole)["longitude"].to_numpy().tolist() == longitude


def test_every_environment_has_a_map_of_what_faces_the_equator(folder):
    """South facades in the north and north ones in the south; each environment that was asked for,
    with its title.
    """
    with xr.open_dataset(folder / "world.nc") as dataset:
        grid = dataset.load()
    hours = grid["full_load_hours"]
    *panels, scale = draw_world_map(grid).axes
    titles = [axes.get_title() for axes in panels if axes.axison]
    assert titles == [
        f"Facades towards the equator, {name}" for name in ("city", "unshaded", "mix")
    ]
    shown = panels[1].collections[0].get_array().reshape(7, 3)
    for latitude, row in zip(grid["latitude"].to_numpy(), shown, strict=True):
        side = "facade_north" if latitude < 0 else "facade_south"
        np.testing.assert_allclose(
            row, hours.sel(environment="unshaded", group=side, latitude=latitude)
        )
    assert scale.get_ylabel() == "Full load hours in a year [h]"
    north, _ = map_of(hours.sel(latitude=slice(20, 80)).drop_sel(group="facade_north"), "city")
    np.testing.assert_array_equal(
        north, hours.sel(environment="city", group="facade_south", latitude=slice(20, 80))
    )
    roofs = hours.sel(group=["roof_east", "roof_south"])
    assert map_of(roofs, "city")[1] == "East roofs, city"
