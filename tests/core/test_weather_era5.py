"""ERA5 in all its spellings, against sums counted elsewhere."""

import zipfile

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from thorough import mark_cases
from weathers import BERLIN, ERA5, HOUR, annual_sums, direct_horizontal, refuse, save_era5

from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.every_python


@pytest.mark.slow
def test_era5_sums_and_relation():
    weather = read_weather(ERA5, *BERLIN)
    data = weather.data
    # Sums of the grid point 52.6° N, 13.35° E, counted by an independent script.
    direct = (data["ghi"] - data["dhi"]).sum() / 1000.0
    low = data["apparent_zenith"] > 88
    assert annual_sums(weather)[0] == pytest.approx(1031.4, abs=0.06)
    assert direct == pytest.approx(568.4, abs=0.7)  # a little direct light falls below 2°
    # Eq. 5
    np.testing.assert_allclose(data["ghi"], data["dhi"] + direct_horizontal(data), atol=1e-9)
    assert (data["dni"][low] == 0).all()
    assert (data["dhi"][low] == data["ghi"][low]).all()
    assert "52.6°, 13.35°" in weather.label
    # The sun is that of the place asked for.
    assert (weather.latitude, weather.longitude) == BERLIN
    assert data["temp_air"].mean() == pytest.approx(10.07, abs=0.01)
    assert data.notna().all().all() and len(data) == 8760 and weather.interval == HOUR


@pytest.mark.slow
def test_era5_stamps_end_the_hour():
    weather = read_weather(ERA5, *BERLIN)
    with xr.open_dataset(ERA5) as dataset:
        stamps = pd.DatetimeIndex(dataset["time"].to_numpy(), tz="UTC")
        ssrd = dataset["ssrd"].sel(latitude=52.6, longitude=13.35, method="nearest").to_numpy()
    assert weather.data.index[0] == stamps[0] - HOUR
    np.testing.assert_allclose(weather.data["ghi"], ssrd / 3600.0, atol=1e-9)


@pytest.mark.slow
def test_era5_bilinear_lies_between_its_neighbours():
    weather = read_weather(ERA5, 52.475, 13.225, point="bilinear")
    # The middle of four grid points is their mean.
    assert annual_sums(weather)[0] == pytest.approx(
        np.mean([1030.8, 1031.4, 1046.1, 1045.7]), abs=0.1
    )
    assert (weather.latitude, weather.longitude) == pytest.approx((52.475, 13.225), abs=1e-6)
    # On a grid point, and beyond the grid's edge by less than half a cell, it is the grid point's
    # own.
    at_point = read_weather(ERA5, 52.6, 13.35, point="bilinear")
    assert annual_sums(at_point)[0] == pytest.approx(1031.4, abs=0.06)
    beyond = read_weather(ERA5, 52.7, 13.7, point="bilinear")
    assert annual_sums(beyond)[0] == pytest.approx(1030.1, abs=0.06)
    assert "bilinear: 52.6°" in beyond.label


@pytest.mark.slow
def test_era5_new_names_expver_and_longitudes(tmp_path):
    plain = read_weather(ERA5, *BERLIN).data

    def renew(dataset):
        # Final data until October and preliminary ones after it, side by side, each with gaps.
        late = dataset["time"] >= np.datetime64("2017-10-01")
        both = xr.concat(
            [dataset.where(~late), dataset.where(late)], dim=pd.Index([1, 5], name="expver")
        )
        both = both.assign_coords(longitude=(both["longitude"] + 360) % 360, number=0)
        return both.rename(time="valid_time").isel(latitude=slice(None, None, -1))

    new = read_weather(save_era5(tmp_path / "new.nc", renew), *BERLIN).data
    np.testing.assert_allclose(
        new[["ghi", "dni", "temp_air"]], plain[["ghi", "dni", "temp_air"]], rtol=1e-5, atol=2e-3
    )


@pytest.mark.slow
def test_era5_in_two_files_of_a_zip(tmp_path):
    accumulated = save_era5(tmp_path / "accum.nc", lambda dataset: dataset[["ssrd", "fdir"]])
    instant = save_era5(tmp_path / "instant.nc", lambda dataset: dataset[["t2m", "u10", "v10"]])
    with zipfile.ZipFile(tmp_path / "download.zip", "w") as archive:
        archive.write(accumulated, "data_stream-oper_stepType-accum.nc")
        archive.write(instant, "data_stream-oper_stepType-instant.nc")
    zipped = read_weather(tmp_path / "download.zip", *BERLIN)
    assert annual_sums(zipped)[0] == pytest.approx(1031.4, abs=0.06)


@pytest.mark.slow
def test_era5_of_several_years_with_one_left_out(tmp_path):
    for year, days in ((2015, -731), (2017, 0)):
        save_era5(
            tmp_path / f"{year}.nc",
            lambda dataset, days=days: dataset.assign_coords(
                time=dataset["time"] + np.timedelta64(days, "D")
            ),
        )
    weather = read_weather(tmp_path, *BERLIN)
    assert len(weather.data) == 2 * 8760
    assert annual_sums(weather)[0] == pytest.approx(2 * 1031.4, abs=0.1)


@pytest.mark.slow
def test_era5_without_a_variable_or_with_another_unit(tmp_path):
    refuse(
        save_era5(tmp_path / "a.nc", lambda dataset: dataset.drop_vars(["ssrd", "t2m"])),
        "ssrd, t2m",
        "missing",
    )

    # Joules that are called watts.
    watts = save_era5(tmp_path / "b.nc", lambda dataset: spell(dataset, {"ssrd": "W m**-2"}))
    refuse(watts, "ssrd", "times 1/3600")
    refuse(
        save_era5(tmp_path / "m.nc", lambda dataset: spell(dataset, {"u10": "mph"})), "u10", "mph"
    )
    refuse(
        save_era5(tmp_path / "c.nc", lambda dataset: dataset.isel(time=slice(0, 4000))),
        "full years",
    )
    refuse(
        save_era5(tmp_path / "d.nc", lambda dataset: dataset.drop_isel(time=[1000, 1001])),
        "gap",
        "2017-02-11",
    )
    may = save_era5(tmp_path / "e.nc", lambda dataset: dataset.where(dataset["time"].dt.month != 5))
    refuse(may, "2017-0", "missing")


@pytest.mark.slow
def test_place_outside_the_grid():
    refuse(ERA5, "outside the grid", "48.1", place=(48.1, 11.6))
    refuse(ERA5, "outside the grid", place=(52.6, 13.73))
    assert "13.6°" in read_weather(ERA5, 52.6, 13.72).label


def spell(dataset, units):
    """The same values under other units, without a change of the numbers."""
    for name, unit in units.items():
        dataset[name].attrs["units"] = unit
    return dataset


@pytest.mark.slow
@pytest.mark.parametrize("unit", mark_cases(["J m-2", "J/m^2", "J m⁻²", "J m^-2"], kept=2))
def test_era5_units_in_other_spellings(tmp_path, unit):
    path = save_era5(
        tmp_path / "a.nc",
        lambda dataset: spell(dataset, {"ssrd": unit, "fdir": unit, "u10": "m/s"}),
    )
    assert annual_sums(read_weather(path, *BERLIN))[0] == pytest.approx(1031.4, abs=0.06)


@pytest.mark.slow
def test_era5_mean_rates_celsius_and_wind_speed(tmp_path):
    plain = read_weather(ERA5, *BERLIN).data

    def rates(dataset):
        new = xr.Dataset(
            {"avg_sdswrf": dataset["ssrd"] / 3600.0, "avg_sdirswrf": dataset["fdir"] / 3600.0}
        )
        new["t2m"] = dataset["t2m"] - 273.15
        new["ws10"] = np.hypot(dataset["u10"], dataset["v10"])
        return spell(
            new, {"avg_sdswrf": "W m**-2", "avg_sdirswrf": "W m-2", "t2m": "degC", "ws10": "m s-1"}
        )

    found = read_weather(save_era5(tmp_path / "rates.nc", rates), *BERLIN).data
    columns = ["ghi", "dhi", "temp_air", "wind_speed"]
    np.testing.assert_allclose(found[columns], plain[columns], rtol=2e-5, atol=2e-3)


@pytest.mark.slow
def test_era5_one_file_for_each_variable_beside_others(tmp_path):
    for name in ("ssrd", "fdir", "t2m", "u10", "v10"):
        save_era5(tmp_path / f"{name}.nc", lambda dataset, name=name: dataset[[name]])
    save_era5(
        tmp_path / "tp.nc",
        lambda dataset: dataset[["ssrd"]].rename(ssrd="tp").isel(time=slice(0, 100)),
    )
    folder = read_weather(tmp_path, *BERLIN)
    listed = read_weather(sorted(tmp_path.glob("*.nc")), *BERLIN)
    assert annual_sums(folder)[0] == pytest.approx(1031.4, abs=0.06)
    pd.testing.assert_frame_equal(folder.data, listed.data)
    refuse(tmp_path / "tp.nc", "no weather variable")
    # Variables of different grid points do not belong together.
    save_era5(
        tmp_path / "u10.nc",
        lambda dataset: dataset[["u10"]].sel(latitude=[52.35], method="nearest"),
    )
    with pytest.raises(InputError, match=r"the same grid|outside the grid"):
        read_weather(tmp_path, *BERLIN)


def leap_year(dataset):
    """The year 2017 on the calendar of 2016 without its 29 February."""
    times = pd.date_range("2016-01-01", "2016-12-31T23:00", freq="h")
    return dataset.assign_coords(time=times[~((times.month == 2) & (times.day == 29))].to_numpy())


@pytest.mark.slow
def test_era5_without_29_february(tmp_path):
    weather = read_weather(save_era5(tmp_path / "leap.nc", leap_year), *BERLIN)
    assert len(weather.data) == 8760
    assert "29 February 2016 is missing" in weather.notes
    # A day that is missing elsewhere is a gap.
    gap = save_era5(
        tmp_path / "gap.nc", lambda dataset: dataset.drop_isel(time=np.arange(2000, 2024))
    )
    refuse(gap, "gap", "2017-03-25")


@pytest.mark.slow
def test_era5_calendar_without_leap_days(tmp_path):
    path = save_era5(
        tmp_path / "noleap.nc", lambda dataset: leap_year(dataset).convert_calendar("noleap")
    )
    weather = read_weather(path, *BERLIN)
    assert len(weather.data) == 8760
    assert annual_sums(weather)[0] == pytest.approx(1031.4, abs=0.06)


def quarters(dataset, share):
    """Every hour as four quarters that hold a share of its joules each."""
    times = pd.date_range("2017-01-01T00:15", "2018-01-01", freq="15min").to_numpy()
    values = {
        name: (
            ("time", "latitude", "longitude"),
            np.repeat(dataset[name].to_numpy(), 4, axis=0) * share.get(name, 1.0),
        )
        for name in dataset.data_vars
    }
    new = xr.Dataset(
        values, {"time": times, "latitude": dataset["latitude"], "longitude": dataset["longitude"]}
    )
    return spell(
        new, {"ssrd": "J m**-2", "fdir": "J m**-2", "t2m": "K", "u10": "m s**-1", "v10": "m s**-1"}
    )


@pytest.mark.slow
def test_era5_joules_of_a_quarter_of_an_hour(tmp_path):
    right = save_era5(
        tmp_path / "right.nc", lambda dataset: quarters(dataset, {"ssrd": 0.25, "fdir": 0.25})
    )
    weather = read_weather(right, *BERLIN, time_shift=-60)  # the copy begins an hour late
    assert weather.interval == pd.Timedelta(minutes=15)
    assert annual_sums(weather)[0] == pytest.approx(1031.4, abs=0.06)
