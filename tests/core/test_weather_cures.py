"""Every cure of weather that names an option with a value is run: it is accepted, and what it gives
is right.
"""

import re

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import (
    BERLIN,
    CAIRO,
    ERA5,
    HOUR,
    POTSDAM_2018,
    TMY3,
    lines_of,
    refuse,
    write_lines,
    write_table,
)

from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

OPTIONS = {"--time-shift": ("time_shift", float), "--weather-without": ("without", str)}


def cure_of(path, place=BERLIN, **settings):
    """The settings that the refusal of a file names."""
    with pytest.raises(InputError) as caught:
        read_weather(path, *place, **settings)
    named = re.findall(r"(--time-shift|--weather-without) (\S+)", caught.value.cure)
    assert named, str(caught.value)
    return {OPTIONS[option][0]: OPTIONS[option][1](value) for option, value in named}


def shifted_table(tmp_path, minutes, columns=("ghi", "dhi", "dni")):
    """New York's year with its stamps so many minutes too early, as csv, and what is right."""
    right = read_weather(TMY3, *BERLIN)
    data = right.data[[*columns, "temp_air", "wind_speed"]].rename_axis("time")
    data = data.set_axis(data.index - pd.Timedelta(minutes=minutes), axis=0).rename_axis("time")
    return write_table(tmp_path / f"{minutes}.csv", data), right


def facades(weather):
    """Direct light on walls to the east and to the west over a year [kWh/m²]."""
    data = weather.data
    aoi = [
        pvlib.irradiance.aoi(90, azimuth, data["apparent_zenith"], data["solar_azimuth"])
        for azimuth in (90, 270)
    ]
    return [
        float((np.maximum(np.cos(np.radians(one)), 0) * data["dni"]).sum()) / 1000 for one in aoi
    ]


@pytest.mark.slow
@pytest.mark.parametrize("minutes", mark_cases([-60, -30, 20, 30, 60], kept=2))
@pytest.mark.parametrize(
    "columns", mark_cases([("ghi", "dhi", "dni"), ("ghi", "dhi")], kept=1, single=True), ids=len
)
def test_the_shift_of_a_file_runs_and_is_right(tmp_path, minutes, columns):
    path, right = shifted_table(tmp_path, minutes, columns)
    place = right.latitude, right.longitude
    cure = cure_of(path, place)
    assert cure["time_shift"] == pytest.approx(minutes, abs=4)
    mended = read_weather(path, *place, **cure)
    assert facades(mended) == pytest.approx(facades(right), rel=0.03)


def test_a_shift_beside_one_that_is_given_is_told_as_their_sum(tmp_path):
    path, right = shifted_table(tmp_path, 60)
    place = right.latitude, right.longitude
    assert cure_of(path, place, time_shift=20)["time_shift"] == pytest.approx(60, abs=2)


def dni_of_another_sun(tmp_path, light, direct):
    """Potsdam's DHI and GHI with stamps `light` minutes too early, DNI with the sun of `direct`
    minutes later.
    """
    # as its daylight tells
    right = read_weather(POTSDAM_2018, *BERLIN, place=(52.38, 13.06), time_shift=12)
    data = right.data[["ghi", "dhi", "temp_air", "wind_speed"]]
    data = data.set_axis(data.index - pd.Timedelta(minutes=light), axis=0).rename_axis("time")
    sun = pvlib.solarposition.get_solarposition(
        data.index + HOUR / 2 + pd.Timedelta(minutes=direct), 52.38, 13.06
    )
    height = np.cos(np.radians(sun["zenith"].to_numpy()))
    data["dni"] = np.where(
        height > 0.03, (data["ghi"] - data["dhi"]) / np.maximum(height, 0.03), 0.0
    )
    return write_table(tmp_path / f"{light}_{direct}.csv", data), right


@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "direct"), mark_cases([(30, 0), (-30, 0), (45, 0), (0, 30)], kept=2)
)
def test_dni_of_another_sun_than_its_light(tmp_path, light, direct):
    """As in Essen's file: GHI of stamps in the middle of the hour, DNI made as if they ended it."""
    path, right = dni_of_another_sun(tmp_path, light, direct)
    place = 52.38, 13.06
    cure = cure_of(path, place)
    assert cure["without"] == "dni"
    assert cure.get("time_shift", 0) == pytest.approx(light, abs=5)
    expected, mended = facades(right), facades(read_weather(path, *place, **cure))
    assert mended == pytest.approx(expected, rel=0.05)


@pytest.mark.slow
def test_direct_light_of_another_sun_in_a_real_file():
    assert cure_of(CAIRO) == {"without": "dni"}
    mended = read_weather(CAIRO, *BERLIN, **cure_of(CAIRO))
    assert abs(mended.checks["2021"]["daylight_shift"]) < 10


def test_a_test_reference_year_cut_before_its_columns(tmp_path):
    head = ["Koordinatensystem : Lambert konform konisch", "Rechtswert        : 3731500 Meter"]
    refuse(
        write_lines(tmp_path / "cut.dat", head),
        "(RW HW MM DD HH …) is missing",
        "download the file again",
    )


@pytest.mark.parametrize(("offset", "words"), [(273.15, "K would be"), (None, "°F would be")])
def test_units_of_temperature_are_told_apart(tmp_path, offset, words):
    data = (
        read_weather(ERA5, *BERLIN)
        .data[["ghi", "dhi", "temp_air", "wind_speed"]]
        .rename_axis("time")
    )
    data["temp_air"] = data["temp_air"] * 1.8 + 32 if offset is None else data["temp_air"] + offset
    refuse(write_table(tmp_path / "unit.csv", data), words)


def test_kelvin_in_an_epw_is_told(tmp_path):
    lines = lines_of(CAIRO)
    rows = [line.split(",") for line in lines[8:]]
    rows = [",".join([*row[:6], f"{float(row[6]) + 273.15:.2f}", *row[7:]]) for row in rows]
    refuse(write_lines(tmp_path / "kelvin.epw", [*lines[:8], *rows]), "kelvin", "K − 273.15")


def test_sums_since_midnight_are_told(tmp_path):
    data = (
        read_weather(ERA5, *BERLIN)
        .data[["ghi", "dhi", "temp_air", "wind_speed"]]
        .rename_axis("time")
    )
    sums = data[["ghi", "dhi"]].groupby(data.index.normalize()).cumsum()
    refuse(
        write_table(tmp_path / "sums.csv", data.assign(**sums)),
        "ghi",
        "sums since 0:00 UTC",
        "differences",
    )
    mean = sums / 24
    refuse(
        write_table(tmp_path / "means.csv", data.assign(**mean)),
        "sums since 0:00 UTC",
        "differences",
    )


def test_a_column_of_marks_is_as_good_as_none(tmp_path):
    """9999 in EPW: DNI follows from the others, wind from the climate, as if the columns were not
    there.
    """
    lines = lines_of(CAIRO)
    rows = [line.split(",") for line in lines[8:]]
    rows = [",".join([*row[:14], "9999", *row[15:21], "999", *row[22:]]) for row in rows]
    weather = read_weather(write_lines(tmp_path / "marks.epw", [*lines[:8], *rows]), *BERLIN)
    whole = read_weather(CAIRO, *BERLIN, without="dni")
    pd.testing.assert_frame_equal(
        weather.data[["ghi", "dhi", "dni"]], whole.data[["ghi", "dhi", "dni"]]
    )
    assert any(
        "Direct Normal Radiation, Wind Speed: no value at all" in note for note in weather.notes
    )
    assert any(
        "no wind speed in the file: taken from the built-in climate" in note
        for note in weather.notes
    )


@pytest.mark.parametrize("file", [TMY3, POTSDAM_2018], ids=lambda file: file.name)
def test_ghi_alone_is_decomposed(tmp_path, file):
    """Light on a south facade by pvlib's isotropic sky, of the decomposed and of the file's own DHI
    and DNI.
    """
    right = read_weather(file, *BERLIN, place=(52.38, 13.06) if file == POTSDAM_2018 else None)
    data = right.data[["ghi", "temp_air", "wind_speed"]].rename_axis("time")
    alone = read_weather(write_table(tmp_path / "ghi.csv", data), right.latitude, right.longitude)
    low = alone.data["apparent_zenith"] > 88
    assert (alone.data["dni"][low] == 0).all()
    height = np.maximum(np.cos(np.radians(alone.data["apparent_zenith"])), 0)
    np.testing.assert_allclose(
        alone.data["dhi"] + alone.data["dni"] * height, alone.data["ghi"], atol=0.6
    )
    assert any("DHI and DNI follow from GHI alone" in note for note in alone.notes)
    light = []
    for one in (alone, right):
        part = one.data
        aoi = pvlib.irradiance.aoi(90, 180, part["apparent_zenith"], part["solar_azimuth"])
        direct = part["dni"] * np.maximum(np.cos(np.radians(aoi)), 0)
        light.append((direct + 0.5 * part["dhi"] + 0.1 * part["ghi"]).sum())
    assert light[0] == pytest.approx(light[1], rel=0.06)


def test_air_temperature_from_the_climate_at_the_altitude_of_the_place(tmp_path):
    data = read_weather(ERA5, *BERLIN).data[["ghi", "dhi", "wind_speed"]].rename_axis("time")
    path = write_table(tmp_path / "cold.csv", data)
    low, high = (
        read_weather(path, *BERLIN, altitude).data["temp_air"] for altitude in (0.0, 1000.0)
    )
    np.testing.assert_allclose(low - high, 6.5)
