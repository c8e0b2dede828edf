"""Faults put into real records: each is found by what it does to the light, and the records as they
are pass.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from thorough import mark_cases
from weathers import BARROW, DATA, HOUR, POTSDAM_2018, PVGIS

from citypv.core.settings.errors import InputError
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.check_faults import (
    check_diffuse,
    check_direct,
    check_faults,
    check_summer_time,
    cut_days,
)
from citypv.core.weather.formats import recognise_weather
from citypv.core.weather.read_weather import check_record, read_file

RECORDS = {
    "New York": DATA / "USA_NY_New.York-CentralPark_TMY3.epw.gz",
    "Potsdam": POTSDAM_2018,
    "Santiago": DATA / "CHL_Santiago_TMYx.epw.gz",
    "Utqiagvik": BARROW,
    "Po valley": PVGIS,
}
LIGHT = ["ghi", "dhi", "dni"]


@cache
def read_record(name):
    """Record of a station with all three irradiances, as they belong together."""
    kind, place = recognise_weather(RECORDS[name]), (52.38, 13.06, 81.0)
    record = read_file(RECORDS[name], kind, place, place if kind == "dwd" else None)
    data = add_sun(record, HOUR).data[[*LIGHT, "temp_air", "wind_speed", "pressure"]]
    return replace(record, data=data, columns={})


def year_of_record(name, columns=LIGHT):
    """A copy with some of the three, to put faults into."""
    record = read_record(name)
    return replace(
        record, data=record.data[[*columns, "temp_air", "wind_speed", "pressure"]].copy()
    )


def faults_of(record):
    """Notes on what is unlikely in a record that passes the checks of faults."""
    year = add_sun(record, record.data.index[1] - record.data.index[0])
    days = cut_days(year)
    check_diffuse(year, "a year")
    check_direct(year, "a year")
    check_summer_time(days, "a year")
    return check_faults(year, days, "a year")


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(RECORDS, kept=2))
def test_real_records_pass(name):
    assert len(faults_of(year_of_record(name))) == (
        1 if name == "Po valley" else 0
    )  # of which two days are dark


def gap_of_zeros(data):
    data.loc[data.index.month.isin([6, 7]), LIGHT] = 0.0


def gap_of_means(data):
    data.iloc[24 * 200 : 24 * 214, :3] = data.iloc[24 * 200 : 24 * 214, :3].mean().to_numpy()


def global_as_diffuse(data):
    data["dhi"] = data.pop("ghi")


def horizontal_as_dni(data):
    data["dni"] = data.pop("ghi") - data["dhi"]


def quarter_more(data):
    data[LIGHT] *= 1.25


def summer_time(data):
    later = data.shift(int(HOUR / (data.index[1] - data.index[0]))).bfill()
    rows = data.index.month.isin([4, 5, 6, 7, 8, 9, 10])
    data[rows] = later[rows]
    data.pop("dni")


def fahrenheit(data):
    data["temp_air"] = data["temp_air"] * 1.8 + 32


FAULTS = {
    gap_of_zeros: r"no light on 6[01] days, the first 20\d\d-06-01: a gap filled with zeros",
    gap_of_means: "light in 15 nights",
    global_as_diffuse: "it may be GHI",
    horizontal_as_dni: "direct light on a horizontal plane",
    quarter_more: "more light than the cleanest air lets through",
    summer_time: "summer time; give times without",
    fahrenheit: "°F would be",
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
@pytest.mark.parametrize("name", mark_cases(["New York", "Potsdam"], kept=1))
def test_a_fault_is_refused(name, fault):
    record = year_of_record(name)
    fault(record.data)
    with pytest.raises(InputError, match=FAULTS[fault]):
        faults_of(record)


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(RECORDS, kept=2))
def test_global_as_diffuse_beside_all_three_is_no_shift_by_half_a_day(name):
    """With the sun below the horizon GHI = DHI."""
    record = year_of_record(name)
    record.data["dhi"] = record.data["ghi"]
    with pytest.raises(InputError, match="it may be GHI"):
        check_record(record)


@pytest.mark.parametrize(("name", "shift"), [("Santiago", 0), ("Po valley", -30)])
def test_no_shift_mends_summer_time(name, shift):
    record = year_of_record(name)
    summer_time(record.data)
    with pytest.raises(InputError, match=r"summer time; .*--time-shift cannot mend it"):
        # all checks, of which that of a shift comes later
        check_record(record.change(shift))


def test_a_day_or_two_of_zeros_are_noted():
    """Weather services have such days: Potsdam's of 2016 and 2017, and PVGIS' typical year of the
    Po valley.
    """
    record = year_of_record("Potsdam")
    record.data.loc["2018-05-03":"2018-05-04", LIGHT] = 0.0
    (note,) = faults_of(record)
    assert note.startswith(("no light on 1 day", "no light on 2 days")) and "2018-05-0" in note


def test_gaps_under_a_sun_that_does_not_set():
    record = year_of_record("Utqiagvik")
    gap_of_means(record.data)
    with pytest.raises(InputError, match="h on end"):
        faults_of(record)


def test_one_temperature_all_year_is_no_fault():
    record = year_of_record("Potsdam")
    assert (
        faults_of(
            replace(record, data=record.data.assign(temp_air=np.full(len(record.data), 25.0)))
        )
        == []
    )


@pytest.mark.slow
def test_the_dark_signal_of_an_instrument_counts_as_0_with_a_note():
    """Pyranometers lose heat to the night sky: -5 Wm⁻² in every hour of darkness, which a file
    without a cure keeps.
    """
    record = year_of_record("New York", ["ghi", "dhi"])
    night = record.data["ghi"] == 0
    record.data.loc[night, "ghi"] = -5.0
    weather = check_record(replace(record, columns={"ghi": "SR01"}))
    assert (
        f"2021: {night.sum():,} values of SR01 below zero, down to -5.0 Wm⁻², count as 0"
        in weather.notes
    )
    assert weather.data.loc[night, LIGHT].eq(0).all(axis=None)
    record.data.loc[~night & (record.data.index.hour == 17), "ghi"] = -5.0
    with pytest.raises(InputError, match=r"ghi is -5 Wm⁻² at .*, by day; give values from -4"):
        check_record(record)
    record.data.loc[night, "ghi"] = -99.0
    with pytest.raises(InputError, match="ghi is -99 Wm⁻²"):
        check_record(record)


def test_direct_light_above_the_extraterrestrial_counts_as_diffuse_or_is_refused():
    record = year_of_record("Potsdam", ["ghi", "dhi"])
    zenith = add_sun(record, HOUR).data["apparent_zenith"]
    low = record.data.index[zenith.between(86, 87)][0]
    record.data.loc[low, ["ghi", "dhi"]] = 170.0, 10.0
    weather = check_record(replace(record, columns={"ghi": "G", "dhi": "D"}))
    assert any(
        "dni (from G and D) is above the extraterrestrial irradiance in 1 h" in note
        for note in weather.notes
    )
    row = weather.data.loc[low]
    assert 1310 < row["dni"] < 1420
    assert row["dhi"] + row["dni"] * np.cos(np.radians(row["apparent_zenith"])) == pytest.approx(
        170
    )
    high = record.data.index[zenith.between(60, 70)][:25]
    record.data.loc[high, ["ghi", "dhi"]] = 750.0, 20.0
    with pytest.raises(
        InputError, match=r"above the extraterrestrial irradiance in .* h; check these"
    ):
        check_record(record)
