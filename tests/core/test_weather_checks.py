"""What is refused because it contradicts the sun or physics: the faults of real files, and remakes
of them.
"""

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import (
    BARROW,
    BERLIN,
    CAIRO,
    ERA5,
    HOUR,
    POTSDAM_2018,
    POTSDAM_2019,
    PVGIS,
    PVGIS_EPW,
    STOCKHOLM,
    TMY3,
    annual_sums,
    lines_of,
    plain_table,
    refuse,
    write_lines,
    write_table,
    year_of,
)

from citypv.core.settings.errors import InputError
from citypv.core.sun.solar_position import solar_position, sun_direction
from citypv.core.weather.add_sun import complete_irradiance
from citypv.core.weather.check_sun_times import cos_zenith_after, measure_sun_times
from citypv.core.weather.read_weather import read_weather


def worst(weather):
    """Checks of the only year."""
    (checks,) = weather.checks.values()
    return checks


def closure_by_pvlib(weather, shift=0):
    """Mean |GHI - DHI - DNI cos z| / mean GHI with pvlib's sun, so many minutes later."""
    data = weather.data
    middle = data.index + weather.interval / 2 + pd.Timedelta(minutes=shift)
    zenith = pvlib.solarposition.get_solarposition(middle, weather.latitude, weather.longitude)[
        "zenith"
    ].to_numpy()
    residual = data["ghi"] - data["dhi"] - data["dni"] * np.maximum(np.cos(np.radians(zenith)), 0.0)
    return float(residual.abs().sum() / data["ghi"].sum())


# --- times


@pytest.mark.slow
def test_the_quick_sun_is_that_of_pvlib():
    times = year_of(2024)
    for latitude, longitude in ((52.5, 13.4), (-33.9, 151.2), (78.0, -60.0)):
        zenith = pvlib.solarposition.get_solarposition(times, latitude, longitude)[
            "zenith"
        ].to_numpy()
        for shift in (-300, 0, 45):
            earlier = times - pd.Timedelta(minutes=shift)
            position = solar_position(earlier, pd.Timedelta(0), latitude, longitude)
            sun = sun_direction(
                position["solar_zenith"].to_numpy(), position["solar_azimuth"].to_numpy()
            )
            found = cos_zenith_after(sun, latitude, shift)
            # A twelfth of a degree of declination within five hours.
            np.testing.assert_allclose(
                found, np.maximum(np.cos(np.radians(zenith)), 0.0), atol=0.002
            )


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    mark_cases([BARROW, PVGIS, PVGIS_EPW, TMY3, STOCKHOLM], kept=2),
    ids=lambda path: path.name[:12],
)
def test_real_files_close(path):
    weather = read_weather(path, *BERLIN)
    checks = worst(weather)
    assert checks["closure_residual"] == pytest.approx(closure_by_pvlib(weather), abs=2e-4)
    assert abs(checks["closure_shift"]) <= 1
    assert abs(checks["daylight_shift"]) <= 5
    assert closure_by_pvlib(weather) < 0.01
    assert closure_by_pvlib(weather) < 0.5 * min(
        closure_by_pvlib(weather, shift) for shift in (-15, 15)
    )
    assert any("GHI = DHI + DNI cos z" in note for note in weather.notes)


@pytest.mark.slow
def test_epw_of_pvgis_is_the_same_as_its_csv():
    csv, epw = read_weather(PVGIS, *BERLIN), read_weather(PVGIS_EPW, *BERLIN)
    assert abs(epw.data.index[0] - csv.data.index[0]) % pd.Timedelta(hours=1) < pd.Timedelta(
        seconds=2
    )
    both = epw.data.index.round("min").intersection(csv.data.index.round("min"))
    assert len(both) >= 8759
    columns = ["ghi", "dhi", "dni"]
    ours = epw.data.set_axis(epw.data.index.round("min"), axis=0).loc[both]
    theirs = csv.data.set_axis(csv.data.index.round("min"), axis=0).loc[both]
    np.testing.assert_allclose(ours[columns], theirs[columns], atol=0.01)
    np.testing.assert_allclose(ours["apparent_zenith"], theirs["apparent_zenith"], atol=0.01)
    assert any("Irradiance Time Offset" in note for note in epw.notes)


@pytest.mark.slow
def test_epw_of_pvgis_without_its_comment(tmp_path):
    lines = [line.replace("Irradiance Time Offset", "Offset") for line in lines_of(PVGIS_EPW)]
    # 30 + 60 · 0.1761
    refuse(write_lines(tmp_path / "no_comment.epw", lines), "41 min later", "--time-shift 4")


@pytest.mark.slow
def test_direct_light_of_another_sun():
    """Cairo: GHI rises and sets on time, but DNI belongs to the sun of the end of the hour."""
    refuse(CAIRO, "30 min later", "by 0.4 %", "or give --weather-without dni")  # 0.35 % by pvlib
    derived = read_weather(CAIRO, *BERLIN, without="dni")
    assert worst(derived)["closure_residual"] is None
    assert abs(worst(derived)["daylight_shift"]) < 20
    # the sun of DNI, not of GHI
    refuse(CAIRO, "GHI fits the sun 3", "or give --weather-without dni", time_shift=30)


@pytest.mark.slow
def test_weather_of_new_york_used_for_berlin(tmp_path):
    data = read_weather(TMY3, *BERLIN).data
    path = write_table(
        tmp_path / "york.csv",
        data[["ghi", "dhi", "dni", "temp_air", "wind_speed"]].rename_axis("time"),
    )
    # 87° of longitude are 350 min; DNI tells another
    refuse(path, "fits the sun", "--weather-place", "no shift")
    two = write_table(
        tmp_path / "two.csv", data[["ghi", "dhi", "temp_air", "wind_speed"]].rename_axis("time")
    )
    refuse(two, "fits the sun", "--weather-place")
    weather = read_weather(two, *BERLIN, place=(40.65, -73.8))
    assert (weather.latitude, weather.longitude) == (40.65, -73.8)


@pytest.mark.slow
@pytest.mark.parametrize("shift", mark_cases([-30, 0, 30], kept=1))
def test_light_that_closes_at_another_time_is_refused(tmp_path, shift):
    """DNI derived from GHI and DHI with the sun of the stamps closes, however late these are."""
    data = (
        read_weather(ERA5, *BERLIN)
        .data[["ghi", "dhi", "temp_air", "wind_speed"]]
        .rename_axis("time")
    )
    data = data.set_axis(data.index - pd.Timedelta(minutes=shift), axis=0)
    middle = data.index + HOUR / 2
    zenith = pvlib.solarposition.get_solarposition(middle, *BERLIN)["zenith"].to_numpy()
    height = np.cos(np.radians(zenith))
    data["dhi"] = np.where(height < 0.1, data["ghi"], data["dhi"])
    data["dni"] = (data["ghi"] - data["dhi"]) / np.maximum(height, 0.1)
    path, settings = write_table(tmp_path / "closed.csv", data), {}
    if shift:
        refuse(
            path, "DNI seems to be computed", f"or give --weather-without dni --time-shift {shift}"
        )
        settings = {"without": "dni", "time_shift": shift}
    weather = read_weather(path, *BERLIN, **settings)
    assert abs(worst(weather)["daylight_shift"]) < 5
    assert bool(shift) == (worst(weather)["closure_residual"] is None)


@pytest.mark.slow
def test_the_shift_is_found_to_a_few_minutes():
    data = read_weather(ERA5, *BERLIN).data
    closed = read_weather(TMY3, *BERLIN)
    for shift in (-95, -20, 0, 7, 45, 300):
        moved = data.index - pd.Timedelta(minutes=shift)
        position = solar_position(moved, HOUR, *BERLIN)
        times = measure_sun_times(data[["ghi"]].set_axis(moved, axis=0), HOUR, BERLIN[0], position)
        assert times.closure_shift is None
        assert abs(times.daylight_shift - shift) <= 4
        moved = closed.data.index - pd.Timedelta(minutes=shift)
        position = solar_position(moved, HOUR, closed.latitude, closed.longitude)
        times = measure_sun_times(
            closed.data.set_axis(moved, axis=0), HOUR, closed.latitude, position
        )
        assert abs(times.closure_shift - shift) <= 1
        # GHI follows from these and the sun, at any time
        two = closed.data[["dhi", "dni"]].set_axis(moved, axis=0)
        times = measure_sun_times(two, HOUR, closed.latitude, position)
        assert times.closure_residual is None
        assert abs(times.daylight_shift - shift) <= 5


# --- magnitudes


def measured_table():
    """ERA5 of Berlin as columns of a csv."""
    data = read_weather(ERA5, *BERLIN).data
    return data[["ghi", "dhi", "temp_air", "wind_speed"]].rename_axis("time")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "words"),
    mark_cases(
        [
            (1e-3, ["times 1000 would fit", "kWm⁻²"]),
            (3600.0, ["times 1/3600 would fit", "Jm⁻²"]),
            (3.6, ["times 1/3.6 would fit", "kJm⁻²"]),
            (3.6e-3, ["times 277.778 would fit", "MJm⁻²"]),
            (1 / 3600, ["times 3600 would fit"]),
            (0.05, ["check the unit"]),
        ],
        kept=3,
    ),
)
def test_other_units(tmp_path, factor, words):
    table = measured_table()
    table[["ghi", "dhi"]] *= factor
    refuse(write_table(tmp_path / "unit.csv", table), *words)


@pytest.mark.thorough
def test_joules_of_a_quarter_of_an_hour_divided_by_an_hour(tmp_path):
    table = measured_table()
    quarters = pd.date_range(table.index[0], periods=4 * len(table), freq="15min")
    table = table.loc[table.index.repeat(4)].set_axis(quarters.rename("time"), axis=0)
    assert read_weather(write_table(tmp_path / "right.csv", table), *BERLIN).data["ghi"].max() > 800
    table[["ghi", "dhi"]] /= 4.0
    refuse(
        write_table(tmp_path / "joules.csv", table),
        "ghi is 24 % of the long-term mean",
        "times 4 would fit",
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("columns", "dark", "words"),
    mark_cases(
        [
            (
                ["ghi", "dhi", "dni"],
                "dni",
                ["dni is 0 all year, ghi and dhi not", "--weather-without dni"],
            ),
            (["ghi", "dhi", "dni"], "ghi", ["ghi is 0 all year", "--weather-without ghi"]),
            (["ghi", "dni"], "dni", ["dni is 0 all year, ghi not", "give a file that has it"]),
            (["dhi", "dni"], "dni", ["dni is 0 all year", "give a file that has it"]),
            (["ghi", "dhi"], "dhi", ["dhi is 0 all year", "give a file that has it"]),
        ],
        kept=3,
    ),
)
def test_a_column_of_zeros_is_named(tmp_path, columns, dark, words):
    right = read_weather(TMY3, *BERLIN)
    data = (
        right.data[[*columns, "temp_air", "wind_speed"]].rename_axis("time").assign(**{dark: 0.0})
    )
    path = write_table(tmp_path / "zeros.csv", data)
    refuse(path, *words)
    if len(columns) == 3:
        derived = read_weather(path, right.latitude, right.longitude, without=dark)
        assert annual_sums(derived) == pytest.approx(annual_sums(right), rel=0.01)


@pytest.mark.slow
def test_global_light_in_the_diffuse_column(tmp_path):
    data = (
        read_weather(TMY3, *BERLIN)
        .data[["ghi", "dhi", "temp_air", "wind_speed"]]
        .rename_axis("time")
    )
    refuse(
        write_table(tmp_path / "copy.csv", data.assign(dhi=data["ghi"])), "no direct light all year"
    )


@pytest.mark.slow
def test_edges_of_clouds_may_exceed_the_limits_for_minutes(tmp_path):
    table = plain_table(year_of())
    bright = table.index[(table["ghi"] > 400).to_numpy()]
    table.loc[bright[::50], ["ghi", "dhi"]] = [1700.0, 600.0]
    assert read_weather(write_table(tmp_path / "few.csv", table), *BERLIN).data["ghi"].max() == 1700
    table.loc[bright[::3], ["ghi", "dhi"]] = [1700.0, 600.0]
    refuse(write_table(tmp_path / "many.csv", table), "physically possible", "1.5 S cos(z)^1.2")


@pytest.mark.slow
def test_years_too_dark_or_too_bright(tmp_path):
    table = plain_table(year_of())
    for scale, words in (
        (0.25, "of the long-term mean"),
        (2.2, "are plausible"),
        (0.0, "give a file with irradiance"),
    ):
        ghi = scale * table["ghi"]
        refuse(write_table(tmp_path / f"{scale}.csv", table.assign(ghi=ghi, dhi=0.1 * ghi)), words)


@pytest.mark.slow
def test_a_direct_column_that_holds_the_global_irradiance():
    """Potsdam 2019: G_Bh + G_Dh sums up to 1,659 kWh/m²."""
    refuse(POTSDAM_2019, "under overcast skies only 50 %", "direct column", "2019")
    with pytest.raises(InputError, match="year 2019"):  # beside a good one
        read_weather([POTSDAM_2018, POTSDAM_2019], *BERLIN, place=(52.38, 13.06))
    assert annual_sums(read_weather(POTSDAM_2018, *BERLIN))[0] == pytest.approx(1209.4, abs=0.06)


# --- near the horizon


def test_measured_direct_light_near_the_horizon_is_kept():
    given = {"ghi": np.full(4, 30.0), "dhi": np.full(4, 20.0), "dni": np.full(4, 300.0)}
    zenith = np.array([87.0, 88.5, 89.5, 90.5])
    found = complete_irradiance(given, zenith)
    assert list(found["dni"]) == [300, 300, 300, 0]
    assert list(found["dhi"]) == [20, 20, 20, 30]
    derived = complete_irradiance({name: given[name] for name in ("ghi", "dhi")}, zenith)
    assert derived["dni"] == pytest.approx([10 / np.cos(np.radians(87)), 0, 0, 0])
    assert list(derived["dhi"]) == [20, 30, 30, 30]
    neglected = complete_irradiance(given, zenith, "neglect")
    assert [list(neglected[name]) for name in ("ghi", "dhi", "dni")] == [
        [30, 0, 0, 0],
        [20, 0, 0, 0],
        [300, 0, 0, 0],
    ]
