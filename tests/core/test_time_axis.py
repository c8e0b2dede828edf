"""Series on whole hours of a calendar year, against exact integration of power that is constant
over each interval.
"""

import numpy as np
import pandas as pd
import pytest
from small_city import write_small_city
from thorough import mark_cases
from weathers import BERLIN, ERA5, HOUR, PVGIS, TMY3

from citypv.__main__ import main
from citypv.core.energy.time_axis import lay_on_axis, read_zone
from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather


def integrate(times, interval, values, edges):
    """Sums between edges of values that are constant over each interval, and 0 elsewhere: by the
    running integral.
    """
    starts = times.as_unit("ns").asi8 / 3.6e12
    length = interval / HOUR
    knots = np.column_stack([starts, starts + length]).ravel()
    total = np.repeat(np.cumsum(np.append(0.0, values * length)), 2)[1:-1]
    return np.diff(np.interp(edges.as_unit("ns").asi8 / 3.6e12, knots, total))


@pytest.mark.parametrize("zone", ["utc", "+01:00", "-05:00", "+05:45", "-12:00", "+14:00"])
@pytest.mark.parametrize(
    "file", mark_cases([ERA5, PVGIS, TMY3], kept=1), ids=lambda file: file.name
)
def test_days_are_those_of_exact_integration(file, zone):
    weather = read_weather(file, *BERLIN)
    times, values = weather.data.index, weather.data["ghi"].to_numpy()
    axis, share = lay_on_axis(times, weather.interval, read_zone(zone))
    year = axis[0].year
    assert len(axis) == 8760
    assert axis[0] == pd.Timestamp(f"{year}-01-01", tz=read_zone(zone))
    assert axis[-1] + HOUR == pd.Timestamp(f"{year + 1}-01-01", tz=read_zone(zone))
    np.testing.assert_allclose(share.sum(axis=1), 1)
    np.testing.assert_allclose(share.sum(axis=0), 1)  # each hour of the weather counts once
    assert (share @ values).sum() == pytest.approx(values.sum())
    days = (share @ values).reshape(365, 24).sum(axis=1)
    edges = pd.date_range(axis[0], periods=366, freq="D")
    # The first and the last day have hours of the other end of the year.
    exact = integrate(times, weather.interval, values, edges)
    np.testing.assert_allclose(days[1:-1], exact[1:-1], atol=1e-6)
    assert days[[0, -1]].sum() == pytest.approx(values.sum() - exact[1:-1].sum())


def test_years_with_a_gap_and_leap_days_that_lack():
    """2016 without 29 February, and 2019, in UTC−5: 8,760 hours each, and none of other years."""
    whole = pd.date_range("2016-01-01", "2017-01-01", freq="h", inclusive="left", tz="UTC")
    later = pd.date_range("2019-01-01", "2020-01-01", freq="h", inclusive="left", tz="UTC")
    times = whole[~((whole.month == 2) & (whole.day == 29))].append(later) + 5 * HOUR
    axis, share = lay_on_axis(times, HOUR, read_zone("-05:00"))
    assert len(axis) == 2 * 8760 and set(axis.year) == {2016, 2019}
    assert not ((axis.month == 2) & (axis.day == 29)).any()
    assert share.nnz >= 2 * 8760 and (share.diagonal() == 1).all()


def test_a_year_from_july_has_no_calendar_year():
    times = pd.date_range("2016-07-01", "2017-07-01", freq="h", inclusive="left", tz="UTC")
    with pytest.raises(InputError, match=r"2016-07-01 to 2017-06-30.*no calendar year"):
        lay_on_axis(times, HOUR, read_zone("utc"))


def test_quarter_hours_of_many_years():
    times = pd.date_range(
        "2005-01-01", "2008-01-01", freq="15min", inclusive="left", tz="UTC"
    ) - pd.Timedelta("7min")
    values = np.random.default_rng(0).random(len(times))
    axis, share = lay_on_axis(times, pd.Timedelta("15min"), read_zone("+02:00"))
    assert len(axis) == len(times)
    hours = (share @ values)[96 * 3 : -96 * 3].reshape(-1, 4).sum(axis=1) / 4
    edges = pd.date_range(axis[96 * 3], periods=len(hours) + 1, freq="h")
    np.testing.assert_allclose(
        hours, integrate(times, pd.Timedelta("15min"), values, edges), atol=1e-9
    )


@pytest.mark.parametrize("text", ["CET", "1", "+1", "+25:00", "Europe/Berlin", "", "+01:07"])
def test_what_is_no_fixed_offset_is_refused(text):
    with pytest.raises(InputError, match=r"--time-axis: .* is no fixed offset from UTC; give utc"):
        read_zone(text)


@pytest.mark.slow
def test_yield_puts_a_traced_city_onto_a_calendar_year(tmp_path):
    """As `simulate`: 8,760 hours from midnight at UTC+1, and the sums of the weather's
    own hours.
    """
    city, base = write_small_city(tmp_path / "small.gml"), tmp_path / "base"
    few = ["--samples", "16", "--suns", "days:2", "--quiet"]
    assert (
        main(
            ["simulate", str(city), "--weather", str(ERA5), "--transfer", "--out", str(base), *few]
        )
        == 0
    )
    faces = pd.read_csv(base / "faces.csv")
    surface = str(faces.loc[faces["full_load_hours"].idxmax(), "surface_id"])
    hours = []
    for zone in ("file", "+01:00"):
        out = tmp_path / zone[-2:]
        options = [
            "--weather",
            str(ERA5),
            "--time-axis",
            zone,
            "--series",
            surface,
            "--out",
            str(out),
        ]
        assert main(["yield", str(base), *options, "--quiet"]) == 0
        hours.append(pd.read_csv(out / "faces.csv")["full_load_hours"].to_numpy())
    np.testing.assert_allclose(hours[1], hours[0], rtol=1e-4)
    series = pd.read_csv(out / "series.csv")
    assert len(series) == 8760
    begin, end = (pd.Timestamp(series["time"].iloc[row]) for row in (0, -1))
    assert begin == pd.Timestamp("2017-01-01 00:00+01:00") and end == pd.Timestamp(
        "2017-12-31 23:00+01:00"
    )
