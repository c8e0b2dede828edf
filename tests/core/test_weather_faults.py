"""Faults put into real records: each is found by what it does to the light, and the records as they are pass."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from citypv.core.settings.errors import InputError
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.check_faults import check_faults
from citypv.core.weather.read_weather import read_file, recognise_weather

DATA = Path(__file__).parents[1] / "data" / "weather"
HOUR = pd.Timedelta(hours=1)
RECORDS = {
    "New York": "USA_NY_New.York-CentralPark_TMY3.epw.gz",
    "Potsdam": "Germany_Potsdam_2018_DWD.txt.gz",
    "Santiago": "CHL_Santiago_TMYx.epw.gz",
    "Utqiagvik": "USA_AK_Barrow_TMY3.epw.gz",
}
LIGHT = ["ghi", "dhi", "dni"]


def year_of_record(name):
    """Record of a station with all three irradiances, as they belong together."""
    path = DATA / RECORDS[name]
    kind = recognise_weather(path)
    place = (52.38, 13.06, 81.0)
    record = read_file(path, kind, place, place if kind == "dwd" else None)
    return replace(record, data=add_sun(record, HOUR).data[[*LIGHT, "temp_air", "wind_speed", "pressure"]])


def check(record):
    return check_faults(add_sun(record, HOUR), "a year")


@pytest.mark.parametrize("name", RECORDS)
def test_real_records_pass(name):
    assert check(year_of_record(name)) == []


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
    later = data.shift(1).bfill()
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
    summer_time: "summer time",
    fahrenheit: "°F would be",
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
@pytest.mark.parametrize("name", ["New York", "Potsdam"])
def test_a_fault_is_refused(name, fault):
    record = year_of_record(name)
    fault(record.data)
    with pytest.raises(InputError, match=FAULTS[fault]):
        check(record)


def test_a_day_or_two_of_zeros_are_noted():
    """Weather services have such days: Potsdam's of 2016 and 2017, and PVGIS' typical year of the Po valley."""
    record = year_of_record("Potsdam")
    record.data.loc["2018-05-03":"2018-05-04", LIGHT] = 0.0
    (note,) = check(record)
    assert note.startswith(("no light on 1 day", "no light on 2 days")) and "2018-05-0" in note


def test_gaps_under_a_sun_that_does_not_set():
    record = year_of_record("Utqiagvik")
    gap_of_means(record.data)
    with pytest.raises(InputError, match="h on end"):
        check(record)


def test_one_temperature_all_year_is_no_fault():
    record = year_of_record("Potsdam")
    assert check(replace(record, data=record.data.assign(temp_air=np.full(len(record.data), 25.0)))) == []
