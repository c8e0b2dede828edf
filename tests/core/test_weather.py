"""Weather against sums counted elsewhere, closed relations, and every kind of bad input."""

import gzip
import json
import zipfile

import numpy as np
import pandas as pd
import pvlib
import pytest
import xarray as xr
from weathers import BARROW, ERA5, HOUR, PVGIS, TMY3, plain_table, write_table, year_of

from citypv.core.errors import InputError
from citypv.core.weather.read_weather import read_weather

BERLIN = (52.51, 13.39)


def annual_sums(weather):
    """Of ghi, dni, dhi [kWh/m²]."""
    return (weather.data[["ghi", "dni", "dhi"]].sum() / 1000.0).to_numpy()


def direct_horizontal(data):
    """Direct irradiance on the ground [Wm⁻²]."""
    return data["dni"] * np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0)


def assert_sun_fits(weather):
    """The stamps are right: the sun of mid-interval explains the split better than one half an hour off."""
    data = weather.data[weather.data["apparent_zenith"] < 80]
    off = {}
    for minutes in (-30, 0, 30):
        times = data.index + weather.interval / 2 + pd.Timedelta(minutes=minutes)
        zenith = pvlib.solarposition.get_solarposition(times, weather.latitude, weather.longitude)["apparent_zenith"]
        ghi = data["dhi"].to_numpy() + data["dni"].to_numpy() * np.cos(np.radians(zenith.to_numpy()))
        off[minutes] = np.abs(ghi - data["ghi"].to_numpy()).mean()
    assert off[0] < 0.3 * min(off[-30], off[30])


# --- each format


def test_era5_sums_and_relation():
    weather = read_weather(ERA5, *BERLIN)
    data = weather.data
    # Sums of the grid point 52.6° N, 13.35° E, counted by an independent script.
    direct = (data["ghi"] - data["dhi"]).sum() / 1000.0
    low = data["apparent_zenith"] > 88
    assert annual_sums(weather)[0] == pytest.approx(1031.4, abs=0.06)
    assert direct == pytest.approx(568.4, abs=0.7)  # a little direct light falls below 2°
    np.testing.assert_allclose(data["ghi"], data["dhi"] + direct_horizontal(data), atol=1e-9)  # Eq. 5
    assert (data["dni"][low] == 0).all()
    assert (data["dhi"][low] == data["ghi"][low]).all()
    assert "52.6°, 13.35°" in weather.label
    # The sun is that of the place asked for.
    assert (weather.latitude, weather.longitude) == BERLIN
    assert data["temp_air"].mean() == pytest.approx(10.07, abs=0.01)
    assert data.notna().all().all() and len(data) == 8760 and weather.interval == HOUR


def test_era5_stamps_end_the_hour():
    weather = read_weather(ERA5, *BERLIN)
    with xr.open_dataset(ERA5) as dataset:
        stamps = pd.DatetimeIndex(dataset["time"].to_numpy(), tz="UTC")
        ssrd = dataset["ssrd"].sel(latitude=52.6, longitude=13.35, method="nearest").to_numpy()
    assert weather.data.index[0] == stamps[0] - HOUR
    np.testing.assert_allclose(weather.data["ghi"], ssrd / 3600.0, atol=1e-9)
    # Around noon of clear days the irradiance of the morning mirrors that of the afternoon only with the right sun.
    clear = weather.data["dni"] > 600
    noon = weather.data["solar_azimuth"][clear]
    high = weather.data["ghi"][clear & (weather.data.index.month == 6)]
    assert noon.between(60, 300).all()
    assert abs(np.average(weather.data.loc[high.index, "solar_azimuth"], weights=high) - 180) < 8


def test_era5_bilinear_lies_between_its_neighbours():
    weather = read_weather(ERA5, 52.475, 13.225, point="bilinear")
    # The middle of four grid points is their mean.
    assert annual_sums(weather)[0] == pytest.approx(np.mean([1030.8, 1031.4, 1046.1, 1045.7]), abs=0.1)
    assert (weather.latitude, weather.longitude) == pytest.approx((52.475, 13.225), abs=1e-6)
    # On a grid point, and beyond the grid's edge by less than half a cell, it is the grid point's own.
    at_point = read_weather(ERA5, 52.6, 13.35, point="bilinear")
    assert annual_sums(at_point)[0] == pytest.approx(1031.4, abs=0.06)
    beyond = read_weather(ERA5, 52.7, 13.7, point="bilinear")
    assert annual_sums(beyond)[0] == pytest.approx(1030.1, abs=0.06)
    assert "bilinear: 52.6°" in beyond.label


def save_era5(path, change):
    """The demonstration's file, changed, as a new NetCDF file."""
    with xr.open_dataset(ERA5) as dataset:
        change(dataset[["ssrd", "fdir", "t2m", "u10", "v10"]].load()).to_netcdf(path)
    return path


def test_era5_new_names_expver_and_longitudes(tmp_path):
    plain = read_weather(ERA5, *BERLIN).data

    def renew(dataset):
        # Final data until October and preliminary ones after it, side by side, each with gaps.
        late = dataset["time"] >= np.datetime64("2017-10-01")
        both = xr.concat([dataset.where(~late), dataset.where(late)], dim=pd.Index([1, 5], name="expver"))
        both = both.assign_coords(longitude=(both["longitude"] + 360) % 360, number=0)
        return both.rename(time="valid_time").isel(latitude=slice(None, None, -1))

    new = read_weather(save_era5(tmp_path / "new.nc", renew), *BERLIN).data
    np.testing.assert_allclose(new[["ghi", "dni", "temp_air"]], plain[["ghi", "dni", "temp_air"]], rtol=1e-5, atol=2e-3)


def test_era5_in_two_files_of_a_zip(tmp_path):
    accumulated = save_era5(tmp_path / "accum.nc", lambda dataset: dataset[["ssrd", "fdir"]])
    instant = save_era5(tmp_path / "instant.nc", lambda dataset: dataset[["t2m", "u10", "v10"]])
    with zipfile.ZipFile(tmp_path / "download.zip", "w") as archive:
        archive.write(accumulated, "data_stream-oper_stepType-accum.nc")
        archive.write(instant, "data_stream-oper_stepType-instant.nc")
    zipped = read_weather(tmp_path / "download.zip", *BERLIN)
    assert annual_sums(zipped)[0] == pytest.approx(1031.4, abs=0.06)


def test_era5_of_several_years_with_one_left_out(tmp_path):
    for year in (2015, 2017):
        save_era5(
            tmp_path / f"{year}.nc",
            lambda dataset, year=year: dataset.assign_coords(
                time=dataset["time"] + np.timedelta64((year - 2017) * 365 + (1 if year < 2016 else 0) * -1, "D")
            ),
        )
    weather = read_weather(tmp_path, *BERLIN)
    assert len(weather.data) == 2 * 8760
    assert annual_sums(weather)[0] == pytest.approx(2 * 1031.4, abs=0.1)


def test_epw_of_the_arctic():
    weather = read_weather(BARROW, *BERLIN)
    assert annual_sums(weather) == pytest.approx([713.4, 674.5, 461.7], abs=12.0)  # EXPECTED; dni above 2° only
    assert annual_sums(weather)[0] == pytest.approx(713.4, abs=0.06)
    assert (weather.latitude, weather.longitude, weather.altitude) == (71.286, -156.767, 10.0)
    assert weather.data["temp_air"].mean() == pytest.approx(-11.82, abs=0.01)
    assert weather.data.index[0] == pd.Timestamp("2021-01-01T09:00Z")  # midnight, nine hours behind
    assert_sun_fits(weather)
    # Polar night and midnight sun.
    assert weather.data.loc["2021-12-05":"2022-01-01", "dni"].max() == 0
    assert (weather.data.loc["2021-06-01":"2021-07-01", "apparent_zenith"] < 90).all()


def test_tmy3_with_a_repeated_row():
    weather = read_weather(TMY3, *BERLIN)
    assert len(weather.data) == 8760
    assert (weather.latitude, weather.longitude) == (40.65, -73.8)
    assert "repeated row" in weather.label
    assert weather.data["pressure"].between(95e3, 105e3).all()
    assert_sun_fits(weather)


def test_pvgis_csv_and_json_and_its_time_offset(tmp_path):
    weather = read_weather(PVGIS, *BERLIN)
    assert annual_sums(weather)[0] == pytest.approx(1435.9, abs=0.06)  # EXPECTED
    assert annual_sums(weather)[1:] == pytest.approx([1591.6, 570.9], abs=1.0)
    assert (weather.latitude, weather.longitude, weather.altitude) == (45.0, 8.0, 250.0)
    # The middle of the interval is the satellite's time, 0.1761 h after the stamp.
    middle = weather.data.index[0] + weather.interval / 2
    assert abs((middle - pd.Timestamp("2021-01-01T00:00Z")).total_seconds() - 0.1761 * 3600) < 1
    assert_sun_fits(weather)
    # The same as json.
    with gzip.open(PVGIS, "rt") as file:
        lines = file.read().splitlines()
    head = next(number for number, line in enumerate(lines) if line.startswith("time(UTC)"))
    names = lines[head].split(",")
    rows = [line.split(",") for line in lines[head + 1 : head + 1 + 8760]]
    hourly = [{names[0]: row[0]} | dict(zip(names[1:], map(float, row[1:]), strict=True)) for row in rows]
    place = {"latitude": 45.0, "longitude": 8.0, "elevation": 250.0, "irradiance_time_offset": 0.1761}
    tree = {
        "inputs": {"location": place},
        "outputs": {"months_selected": [], "tmy_hourly": hourly},
        "meta": {"inputs": {}},
    }
    (tmp_path / "tmy.json").write_text(json.dumps(tree))
    pd.testing.assert_frame_equal(read_weather(tmp_path / "tmy.json", *BERLIN).data, weather.data)


def test_clear_sky_is_an_upper_bound():
    weather = read_weather("clear-sky", *BERLIN, 34.0, year=2020)
    assert "upper bound" in weather.label
    assert len(weather.data) == 8784
    assert (weather.data["temp_air"] == 15).all() and (weather.data["wind_speed"] == 1).all()
    # The same by pvlib's own Location, hour by hour.
    middle = weather.data.index + HOUR / 2
    sky = pvlib.location.Location(*BERLIN, altitude=34.0).get_clearsky(middle)
    high = weather.data["apparent_zenith"].to_numpy() < 85
    np.testing.assert_allclose(weather.data["ghi"][high], sky["ghi"].to_numpy()[high], rtol=5e-3)
    real = read_weather(ERA5, *BERLIN)
    assert annual_sums(weather)[0] > 1.2 * annual_sums(real)[0]


def test_csv_of_two_columns_of_irradiance(tmp_path):
    times = year_of()
    table = plain_table(times)
    weather = read_weather(write_table(tmp_path / "own.csv", table), 0.0, 0.0)
    np.testing.assert_allclose(weather.data["ghi"], table["ghi"], rtol=1e-9)
    np.testing.assert_allclose(weather.data["dhi"] + direct_horizontal(weather.data), table["ghi"], atol=1e-9)
    # From ghi and dni, and from dhi and dni, the third comes out the same.
    for other in ("dhi", "ghi"):
        sunny = weather.data[["ghi", "dhi", "dni", "temp_air", "wind_speed"]].rename_axis("time").drop(columns=other)
        again = read_weather(write_table(tmp_path / f"no_{other}.csv", sunny), 0.0, 0.0)
        high = weather.data["apparent_zenith"] <= 88
        np.testing.assert_allclose(again.data[other][high], weather.data[other][high], atol=1e-6)


def test_csv_with_summer_time_offsets_and_quarter_hours(tmp_path):
    local = year_of(freq="15min").tz_convert("Europe/Berlin")
    table = plain_table(local)
    weather = read_weather(write_table(tmp_path / "quarters.csv", table), *BERLIN)
    assert weather.interval == pd.Timedelta(minutes=15)
    assert weather.data.index[0] == pd.Timestamp("2021-01-01T00:00Z")
    assert len(weather.data) == 4 * 8760


def test_sun_is_that_of_mid_interval(tmp_path):
    weather = read_weather(write_table(tmp_path / "own.csv", plain_table(year_of())), *BERLIN)
    own = pvlib.solarposition.get_solarposition(weather.data.index + HOUR / 2, *BERLIN)
    np.testing.assert_allclose(weather.data["apparent_zenith"], own["apparent_zenith"], atol=1e-9)
    np.testing.assert_allclose(weather.data["solar_azimuth"], own["azimuth"], atol=1e-9)


def test_small_negatives_are_rounding(tmp_path):
    table = plain_table(year_of())
    table.loc[table["ghi"] == 0, ["ghi", "dhi"]] = -0.4
    weather = read_weather(write_table(tmp_path / "dark.csv", table), *BERLIN)
    assert weather.data[["ghi", "dhi", "dni"]].min().min() == 0


def refuse(source, *words, place=BERLIN):
    """Reading must fail in one line that names the file and the words."""
    with pytest.raises(InputError) as caught:
        read_weather(source, *place)
    message = str(caught.value)
    assert "\n" not in message
    assert str(source) in message
    for word in words:
        assert word in message, message


def test_files_that_are_no_weather(tmp_path):
    refuse(tmp_path / "missing.nc", "cannot be read")
    for name, content, word in (
        ("empty.csv", b"", "empty"),
        ("words.txt", b"this is no weather", "no known weather format"),
        ("bytes.bin", bytes(range(256)) * 8, "no known weather format"),
        ("header.csv", b"time,ghi,dhi,temp_air,wind_speed\n", "no rows"),
        ("other.csv", b"a,b\n1,2\n", "weather variable"),
        ("cut.epw", b"LOCATION,Nowhere,-,USA,TMY3,1,10.0,10.0,1.0,5.0\nDESIGN", "full year"),
        ("head.epw", b"LOCATION,Nowhere\n", "cannot be read as epw"),
        ("cut.json", b'{"inputs": {"loc', "no json"),
        ("other.json", b'{"type": "CityJSON"}', "PVGIS"),
        ("cut.nc", ERA5.read_bytes()[:300], "NetCDF"),
        ("broken.nc", b"\x89HDF\r\n\x1a\n" + bytes(200), "NetCDF"),
        ("broken.gz", b"\x1f\x8b\x08\x00rubbish", "cannot be read"),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        refuse(path, word)


def test_truncated_files(tmp_path):
    path = tmp_path / "cut.nc"
    path.write_bytes(ERA5.read_bytes()[:-3])
    refuse(path, "NetCDF")
    with gzip.open(BARROW) as file:
        text = file.read()
    path = tmp_path / "cut.epw"
    path.write_bytes(text[: len(text) // 2])
    refuse(path)
    path = tmp_path / "cut.csv.gz"
    path.write_bytes(PVGIS.read_bytes()[:50_000])
    refuse(path)


def test_era5_without_a_variable_or_with_another_unit(tmp_path):
    refuse(save_era5(tmp_path / "a.nc", lambda dataset: dataset.drop_vars(["fdir", "t2m"])), "fdir, t2m", "missing")

    def watts(dataset):
        dataset["ssrd"].attrs["units"] = "W m**-2"
        return dataset

    refuse(save_era5(tmp_path / "b.nc", watts), "ssrd", "W m**-2")
    refuse(save_era5(tmp_path / "c.nc", lambda dataset: dataset.isel(time=slice(0, 4000))), "full years")
    refuse(save_era5(tmp_path / "d.nc", lambda dataset: dataset.drop_isel(time=[1000, 1001])), "gap", "2017-02-11")
    refuse(
        save_era5(tmp_path / "e.nc", lambda dataset: dataset.where(dataset["time"].dt.month != 5)), "2017-0", "missing"
    )


def test_place_outside_the_grid():
    refuse(ERA5, "outside the grid", "48.1", place=(48.1, 11.6))
    refuse(ERA5, "outside the grid", place=(52.6, 13.73))
    assert "13.6°" in read_weather(ERA5, 52.6, 13.72).label


def test_tables_with_faults(tmp_path):
    good = plain_table(year_of())
    faults = {
        "naive": (good.tz_localize(None), ["has no time zone", "row 1"]),
        "no_wind": (good.drop(columns="wind_speed"), ["wind_speed"]),
        "one_irradiance": (good.drop(columns="dhi"), ["two of ghi, dhi, dni"]),
        "gap": (good.drop(good.index[100:103]), ["gap", "2021-01-05 04:00", "2021-01-05 07:00"]),
        "twice": (pd.concat([good[:10], good[9:]]), ["twice", "2021-01-01 09:00"]),
        "disorder": (good.iloc[::-1], ["out of order"]),
        "nan": (
            good.assign(ghi=good["ghi"].where(good.index != good.index[50])),
            ["ghi is missing at 2021-01-03 02:00"],
        ),
        "negative": (good.assign(dhi=good["dhi"] - 30), ["dhi is -30", "2021-01-01 00:00"]),
        "kelvin": (good.assign(temp_air=285.0), ["temp_air is 285"]),
        "hectopascal": (good.assign(pressure=1013.0), ["pressure is 1013"]),
        "half_a_year": (good[:4380], ["182.5", "full years"]),
        "part": (plain_table(year_of(2020, 2021))[:13000], ["full years"]),
        "daily": (good[::24], ["1 days"]),
        "infinite": (good.assign(ghi=np.inf), ["ghi is missing"]),
    }
    for name, (table, words) in faults.items():
        refuse(write_table(tmp_path / f"{name}.csv", table), *words)
    text = (tmp_path / "kelvin.csv").read_text().replace("285.0", "warm", 1)
    (tmp_path / "word.csv").write_text(text)
    refuse(tmp_path / "word.csv", "'warm'", "row 1", "temp_air")


def test_leap_years_and_many_years_are_whole(tmp_path):
    for first, last, hours in ((2020, 2020, 8784), (2019, 2021, 26304)):
        weather = read_weather(write_table(tmp_path / f"{first}.csv", plain_table(year_of(first, last))), *BERLIN)
        assert len(weather.data) == hours


def test_epw_of_a_real_leap_year_without_its_leap_day(tmp_path):
    with gzip.open(BARROW, "rt") as file:
        lines = file.read().splitlines()
    rows = [",".join(["2012", *line.split(",")[1:]]) for line in lines[8:]]
    path = tmp_path / "2012.epw"
    path.write_text("\n".join(lines[:8] + rows) + "\n")
    weather = read_weather(path, *BERLIN)
    assert annual_sums(weather)[0] == pytest.approx(713.4, abs=0.06)
    # A real year that is no leap year keeps its calendar.
    path.write_text("\n".join(lines[:8] + [row.replace("2012", "2014", 1) for row in rows]) + "\n")
    assert read_weather(path, *BERLIN).data.index[0] == pd.Timestamp("2014-01-01T09:00Z")


def test_unknown_point():
    with pytest.raises(InputError, match="--weather-point"):
        read_weather(ERA5, *BERLIN, point="cubic")
