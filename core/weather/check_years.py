"""Check the irradiance of each year separately, so that good years do not hide a bad one."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd

from .add_sun import add_sun
from .check_irradiance import check_given, check_irradiance
from .check_sun_times import (
    SunTimes,
    check_closure,
    check_shift,
    cure_of_shift,
    fits_another_sun,
    measure_sun_times,
    round_shift,
)
from .check_weather import skips_leap_day
from .record import IRRADIANCES

SHORTEST_YEAR = pd.Timedelta(days=350)
LONGEST_REST = pd.Timedelta(days=2)  # of an adjacent year, when the record's year is that of another time zone


def check_years(record, interval, position):
    """Check the irradiance of each year against the sun and against physical limits.

    Parameters
    ----------
    record : Record
        Whole years, complete.
    interval : pandas.Timedelta
    position : pandas.DataFrame
        Of `solar_position` for its times and place.

    Returns
    -------
    dict
        Year, as a string -> fields of `SunTimes`.
    """
    given = record.data[[name for name in IRRADIANCES if name in record.data]].clip(lower=0.0)
    found = {}
    for year, rows in cut_years(record, interval).items():
        source = f"{record.source} (year {year})"
        whole = add_sun(replace(record, data=record.data.iloc[rows]), interval, position=position.iloc[rows]).data
        check_given(given.iloc[rows], whole["dni"].to_numpy(), source)
        times = measure_sun_times(given.iloc[rows], interval, record.latitude, record.longitude)
        check_shift(times, source)
        check_irradiance(whole[["ghi", "dhi"]], interval, record.latitude, record.longitude, source)
        check_closure(times, source)
        found[year] = asdict(times)
    return found


def cut_years(record, interval):
    """Rows of each calendar year in mean solar time of the place; all rows in one if it is not in calendar years.

    Parameters
    ----------
    record : Record
    interval : pandas.Timedelta

    Returns
    -------
    dict of str to slice
    """
    times = record.data.index
    years = (times + interval / 2 + pd.Timedelta(hours=record.longitude / 15)).year.to_numpy()
    names, first, count = np.unique(years, return_index=True, return_counts=True)
    spans = count * interval
    if not all(span >= SHORTEST_YEAR or span <= LONGEST_REST for span in spans):
        return {f"{years[0]}-{years[-1]}": slice(None)}
    kept = [number for number, span in enumerate(spans) if span >= SHORTEST_YEAR]
    return {str(names[number]): slice(first[number], first[number] + count[number]) for number in kept}


def describe_leap_days(record, interval):
    """A note if 29 February is missing."""
    days = record.data.index[:-1][skips_leap_day(record.data.index, interval)]
    return [f"29 February {', '.join(str((day + interval).year) for day in days)} is missing"] if len(days) else []


def describe_checks(checks):
    """Notes on how well the irradiance fits the sun, of the worst year of each measure."""
    notes = []
    closures = [one for one in checks.values() if one["closure_residual"] is not None]
    if closures:
        worst = max(closures, key=lambda one: one["closure_residual"])
        notes.append(
            "GHI = DHI + DNI cos z to {:.2f} % of GHI; best with the sun shifted by {:+d} min ({:.2f} %)".format(
                100 * worst["closure_residual"], worst["closure_shift"], 100 * worst["closure_residual_shifted"]
            )
        )
    daylights = [SunTimes(**one) for one in checks.values() if one["daylight_shift"] is not None]
    if daylights:
        worst = max(daylights, key=lambda one: abs(one.daylight_shift))
        note = f"clear days fit the sun best with times shifted by {worst.daylight_shift:+d} min"
        if fits_another_sun(worst):
            note += f": walls to the east and west may be wrong; {cure_of_shift(round_shift(worst.daylight_shift, 5))}"
        notes.append(note)
    return notes
