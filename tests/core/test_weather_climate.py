"""Years held against the climate of their place: what two independent things agree on is refused,
the rest is named.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import BARROW, BERLIN, ERA5, HOUR, POTSDAM_2018, STOCKHOLM, TMY3, refuse, write_table

from citypv.core.settings.errors import InputError
from citypv.core.weather.check_faults import cut_days
from citypv.core.weather.climate import climate
from citypv.core.weather.compare_climate import climate_of_place, compare_with_climate
from citypv.core.weather.read_weather import check_record, read_weather

COLUMNS = ["ghi", "dhi", "dni", "temp_air", "wind_speed"]
# Places without frost, so that an exchanged wind is never below 0: desert, coast, tropics,
# mountain.
WARM = {
    "Aswan": (24.0, 32.8),
    "Lisbon": (38.7, -9.1),
    "Darwin": (-12.4, 130.9),
    "Mexico": (19.4, -99.1),
}
DULL = {
    "Paris": (48.85, 2.34),
    "Bergen": (60.4, 5.3),
    "Hobart": (-42.9, 147.3),
    "Seattle": (47.6, -122.3),
}


def year_at(latitude, longitude, freq="h"):
    """Record of the built-in climate under other days, as any record would be, with wind that
    varies.
    """
    record = climate(latitude, longitude, seed=7)
    draws = np.random.default_rng(1).gamma(4.0, 0.25, len(record.data))
    data = record.data.assign(wind_speed=record.data["wind_speed"] * draws)
    if freq != "h":
        times = pd.date_range(
            data.index[0], periods=len(data) * int(HOUR / pd.Timedelta(freq)), freq=freq
        )
        data = data.reindex(times, method="ffill")
    return replace(record, data=data, source="a year", label="a year")


def sky_at(latitude, longitude, model):
    """Record of a clear sky by pvlib's own functions, hourly at mid-interval; Bird's with other air
    each day.
    """
    record, place = climate(latitude, longitude), pvlib.location.Location(latitude, longitude)
    middle = record.data.index + HOUR / 2
    if model == "bird":
        zenith = place.get_solarposition(middle)["apparent_zenith"].to_numpy()
        airmass = np.nan_to_num(pvlib.atmosphere.get_relative_airmass(zenith), nan=40.0)
        depth = np.random.default_rng(1).uniform(0.05, 0.35, 367)[middle.day_of_year]
        ghi = np.nan_to_num(
            pvlib.clearsky.bird(zenith, airmass, depth, 1.3 * depth, 1.5)["ghi"]
        ).clip(min=0)
    else:
        ghi = place.get_clearsky(middle, model=model)["ghi"].to_numpy()
    data = record.data[["temp_air", "wind_speed"]].assign(ghi=ghi)
    return replace(record, data=data, source="a sky", label="a sky")


def test_the_label_says_what_share_of_the_climate_a_year_has():
    """Long-term mean of GHI by the Global Solar Atlas; the sum by hand from the file's own
    columns.
    """
    weather = read_weather(POTSDAM_2018, *BERLIN, place=(52.38, 13.06))
    usual = climate(52.38, 13.06).data["ghi"].sum()
    assert weather.label.endswith(f", {100 * 1209400 / usual:.0f} % of the long-term mean")
    assert weather.checks["2018"]["share_of_climate"]["ghi"] == pytest.approx(
        1209400 / usual, rel=2e-3
    )
    assert (
        0 < weather.checks["2018"]["share_of_climate"]["temp_air"] < 3
    )  # the warmest year until then


@pytest.mark.parametrize("file", [ERA5, TMY3, BARROW, STOCKHOLM], ids=lambda file: file.name)
def test_real_records_are_within_what_is_usual(file):
    weather = read_weather(file, *BERLIN)
    assert "of the long-term mean" in weather.label
    assert not [note for note in weather.notes if "climate" in note or "long-term mean:" in note]


@pytest.mark.slow
@pytest.mark.parametrize("place", mark_cases([*WARM.values(), *DULL.values()], kept=2, single=True))
@pytest.mark.parametrize(
    ("freq", "words"), [("h", r"values times (1\.9|2) would fit"), ("30min", "energy per interval")]
)
def test_half_of_the_energy_is_refused(place, freq, words):
    record = year_at(*place, freq)
    assert check_record(record)
    record.data[["ghi", "dhi", "dni"]] *= 0.5
    with pytest.raises(
        InputError, match=rf"of the long-term mean, and that of its clearest days .*{words}"
    ):
        check_record(record)


def test_a_dull_year_is_named_and_not_refused():
    """Half the light by clouds: the clearest days are as clear as ever."""
    record = year_at(*WARM["Lisbon"])
    dull = record.data.index.day_of_year % 4 != 0
    ghi = record.data["ghi"].where(~dull, 0.4 * record.data["ghi"])
    record.data.loc[dull, "dni"] = 0.0
    record.data["dhi"] = record.data["dhi"].where(~dull, ghi)
    record.data["ghi"] = ghi
    weather = check_record(record)
    assert any("of the long-term mean: an unusual year" in note for note in weather.notes)


@pytest.mark.parametrize("model", ["ineichen", "bird"])
@pytest.mark.parametrize("place", mark_cases(DULL.values(), kept=2, single=True))
def test_columns_of_a_clear_sky_are_refused(place, model):
    """Of a model that the check has, and of one that it has not."""
    with pytest.raises(InputError, match="these are columns of a clear sky"):
        check_record(sky_at(*place, model))


def test_a_desert_without_dull_days_is_no_clear_sky():
    record = sky_at(*WARM["Aswan"], "ineichen")
    assert check_record(record)


@pytest.mark.parametrize("place", mark_cases(WARM.values(), kept=2, single=True))
def test_temperature_and_wind_in_each_others_column(place):
    record = year_at(*place)
    assert check_record(record)
    data = record.data.rename(columns={"temp_air": "wind_speed", "wind_speed": "temp_air"})
    with pytest.raises(InputError, match="exchange the columns temp_air and wind_speed"):
        check_record(replace(record, data=data))


def test_exchanged_columns_of_a_place_with_frost(tmp_path):
    table = read_weather(ERA5, *BERLIN).data[COLUMNS].rename_axis("time")
    table = table.rename(columns={"temp_air": "wind_speed", "wind_speed": "temp_air"})
    refuse(
        write_table(tmp_path / "swapped.csv", table),
        "wind_speed is -",
        "check whether these two columns are exchanged",
    )


def test_wind_in_kilometres_an_hour_and_fahrenheit_are_named():
    record = year_at(*DULL["Bergen"])
    weather = check_record(
        replace(record, data=record.data.assign(wind_speed=3.6 * record.data["wind_speed"]))
    )
    assert any("wind_speed is 3.6 times the climate's: km/h" in note for note in weather.notes)


def test_temperatures_are_compared_at_the_altitude_of_the_record():
    """A station 1,000 m above its surroundings is 6.5 K colder than they are."""
    record = year_at(*DULL["Paris"])
    data = record.data.assign(temp_air=record.data["temp_air"] - 6.5)
    weather = check_record(replace(record, data=data, altitude=record.altitude + 1000))
    assert weather.checks["2021"]["share_of_climate"]["temp_air"] == pytest.approx(0, abs=0.05)
    assert not [note for note in weather.notes if "K below" in note]
    assert any("6.5 K below" in note for note in check_record(replace(record, data=data)).notes)


def test_a_year_that_lacks_months_is_held_against_the_same_months():
    year = climate_of_place(*DULL["Paris"])  # the climate itself
    half = replace(year, data=year.data.iloc[90 * 24 : 270 * 24])
    share = compare_with_climate(half, cut_days(half), year)
    assert share.ghi == pytest.approx(1, abs=0.01)
    assert share.temp_air == pytest.approx(0, abs=0.2)


def test_no_comparison_where_there_is_no_climate():
    assert climate_of_place(-75.1, 123.3) is None  # Concordia
    assert climate_of_place(-0.2, -78.5) is None  # Quito, between dry and wet slopes of the Andes
    assert climate_of_place(*BERLIN) is not None
