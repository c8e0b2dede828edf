"""Refuse weather from which full load hours cannot be computed, and say how well each of its years
fits the sun.

Years are checked separately, so that good ones do not hide a bad one.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError, first_true
from ..sun.solar_position import is_sunny
from .add_sun import add_sun
from .check_faults import (
    check_diffuse,
    check_direct,
    check_faults,
    check_given,
    check_irradiance,
    check_summer_time,
    check_sums,
    cut_days,
    middle_of_clear_days,
)
from .check_sun_times import (
    CURE_OF_TIMES,
    TimesError,
    check_closure,
    check_shift,
    measure_sun_times,
)
from .compare_climate import check_against_climate, climate_of_place, compare_with_climate
from .weather import IRRADIANCES

DAY = pd.Timedelta(days=1)
HOUR = pd.Timedelta(hours=1)
SHORTEST_YEAR = pd.Timedelta(days=350)

# Values outside are impossible on Earth: another unit, or a marker for missing values.
LIMITS = {
    **dict.fromkeys(IRRADIANCES, (-20.0, 2000.0, "Wm⁻²")),
    "temp_air": (-95.0, 70.0, "°C"),
    "wind_speed": (0.0, 120.0, "ms⁻¹"),
    "pressure": (30e3, 115e3, "Pa"),
}


def check_weather(record):
    """Refuse a record with missing irradiance or values, a broken time axis, or less than whole
    years.

    Upper limits are checked later by `check_values`, after `check_irradiance`, whose message on
    units is more helpful.

    Parameters
    ----------
    record : Record
        Record as read from a file.

    Returns
    -------
    pandas.Timedelta
        Length of the intervals.

    Raises
    ------
    InputError
        With the file, the place in it, and the cure.
    """
    columns = set(record.data.columns)
    light = sorted(columns & set(IRRADIANCES))
    if len(light) < 2 and light != ["ghi"]:
        raise InputError(
            record.source,
            f"missing: ghi, or two of ghi, dhi, dni (there: {', '.join(light) or 'none'})",
            "add these columns to the weather",
        )
    interval = _check_time_axis(record.data.index, record.source)
    for name in sorted(columns & set(LIMITS), key=list(LIMITS).index):
        unknown = ~np.isfinite(record.data[name].to_numpy(dtype=float))
        if (first := first_true(unknown)) is not None:
            place = f"{record.columns.get(name, name)} is missing at {record.data.index[first]}"
            cure = "fill the missing values"
            if name not in IRRADIANCES:
                cure += (
                    ", or leave the whole column out: it is then taken from the built-in climate"
                )
            raise InputError(record.source, f"{place} ({unknown.sum()} values in total)", cure)
    check_values(record.data, record.columns, record.source, lowest_only=True)
    return interval


def _check_time_axis(times, source):
    """Refuse gaps, duplicates, intervals longer than one hour and anything but whole years.

    Whole calendar years may be left out between others.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval.
    source : str
        The file, for the message.

    Returns
    -------
    pandas.Timedelta
        Length of the intervals.
    """
    # Fewer than two stamps have no interval, and are refused.
    if len(times) < 2:
        raise InputError(
            source, f"{len(times)} time stamps", "give at least one full year of hourly weather"
        )
    # Stamps must ascend.
    step = times[1:] - times[:-1]
    if (first := first_true(step <= pd.Timedelta(0))) is not None:
        problem = f"the time {times[first + 1]} is repeated or out of order"
        raise InputError(source, problem, "sort the times and remove duplicates")
    # The commonest step is the interval: at most an hour, and a whole part of a day.
    interval = step.to_series().mode().iloc[0]
    if interval > HOUR or DAY % interval != pd.Timedelta(0):
        raise InputError(
            source,
            f"the times are {interval} apart",
            "give weather of every hour (or a part of one)",
        )
    # Other steps divide the time axis into spans, unless they leave out 29 February only: each span
    # must have whole years.
    breaks = np.flatnonzero((step != interval) & ~_skips_leap_day(times, interval)) + 1
    spans = [(last - first) * interval for first, last in pairwise([0, *breaks, len(times)])]
    whole = [365 * DAY <= span <= 366 * int(span // (365 * DAY)) * DAY for span in spans]
    if len(breaks) and not all(whole):
        end, start = times[breaks[0] - 1] + interval, times[breaks[0]]
        what = "a gap" if start > end else "an overlap"
        raise InputError(
            source,
            f"{what} in the time axis from {end} to {start}",
            "fill the gap, or give whole years",
        )
    if not all(whole):
        problem = f"covers {spans[0] / DAY:.2f} days, from {times[0]} to {times[-1] + interval}"
        raise InputError(
            source, problem, "give one or more full years: full load hours need full years"
        )
    return interval


def _skips_leap_day(times, interval):
    """Where a time axis leaves out 29 February, as calendars of 365 days do.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, ascending.
    interval : pandas.Timedelta

    Returns
    -------
    numpy.ndarray, (t - 1,) bool
        Whether the step to the next time is such a gap, in any time zone.
    """
    middle = times[:-1] + interval + DAY / 2  # of the day that is left out, if it is
    leap_day = middle.is_leap_year & np.isin(middle.day_of_year, (59, 60, 61))
    return np.asarray((times[1:] - times[:-1] == DAY + interval) & leap_day)


def check_values(data, columns, source, *, lowest_only=False, cure=None):
    """Refuse impossible values, naming the first time.

    Parameters
    ----------
    data : pandas.DataFrame
        Of a Record or a Weather.
    columns : dict of str to str
        What the file calls them.
    source : str
        The file, for messages.
    lowest_only : bool
        Check the lower bounds only.
    cure : str, optional
        By default to give values within the bounds.
    """
    for name in [name for name in LIMITS if name in data]:
        lowest, highest, unit = LIMITS[name]
        values = data[name].to_numpy(dtype=float)
        if (
            first := first_true((values < lowest) | ((values > highest) & (not lowest_only)))
        ) is not None:
            problem = (
                f"{columns.get(name, name)} is {values[first]:g} {unit} at {data.index[first]}"
            )
            if name == "wind_speed" and "temp_air" in data and data["temp_air"].min() >= 0:
                problem += f", while {columns.get('temp_air', 'temp_air')} is never below 0 °C"
                cure = "check whether these two columns are exchanged"
            raise InputError(
                source, problem, cure or f"give values from {lowest:g} to {highest:g} {unit}"
            )


def _check_negative(given, year, source, *, least_by_day=-4.0):
    """Refuse light below zero by day, and note what is taken as 0 at night: list of str.

    Parameters
    ----------
    given : pandas.DataFrame
        Columns ghi, dhi and dni as far as the file has them, as they stand there [Wm⁻²].
    year : Weather
    source : str
        The file and the year, for messages.
    """
    day, notes = is_sunny(year.data["apparent_zenith"].to_numpy()), []
    for name, column in given.items():
        values, words = column.to_numpy(float), year.columns[name]
        if (first := first_true(day & (values < least_by_day))) is not None:
            raise InputError(
                source,
                f"{words} is {values[first]:g} Wm⁻² at {given.index[first]}, by day",
                f"give values from {least_by_day:g} Wm⁻²",
            )
        # Down to −1 Wm⁻² files are imprecise by packing, which no note says.
        small = values < -1.0
        if small.any():
            notes.append(
                f"{small.sum():,} values of {words} below zero, down to {values.min():.1f} Wm⁻², "
                "count as 0"
            )
    return notes


def _check_extraterrestrial(given, year, source):
    """Refuse DNI above that outside the atmosphere in more than 20 hours of a sun above 10°; a note
    on others: list.

    DNI that follows from GHI and DHI under a low sun is a quotient of small numbers, and too large
    in a few hours a year; under a higher sun real records have at most 5 h, those with faults 43
    and 59 h.
    """
    outside = pvlib.irradiance.get_extra_radiation(year.data.index + year.interval / 2).to_numpy()
    above = year.data["dni"].to_numpy() >= outside
    hours = above.sum() * (year.interval / HOUR)
    if not hours:
        return []
    problem = f"{year.columns['dni']} is above the extraterrestrial irradiance in {hours:g} h"
    if (above & (year.data["apparent_zenith"].to_numpy() < 80.0)).sum() * (
        year.interval / HOUR
    ) <= 20:
        return [f"{problem}: the excess counts as diffuse"]
    if len(given.columns) == 3:
        raise TimesError(source, problem, "check its unit and its times", without="dni")
    raise InputError(source, problem, "check these columns: unit, and times against the sun")


def check_years(record, interval, position):
    """Check the irradiance of each year against the sun, physical limits, and the climate of its
    place.

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
        Year, as a string -> SunTimes, with notes on what is unlikely.

    Raises
    ------
    InputError
        By the first check that a year fails; TimesError where other settings would mend it.
    """
    # Small negative values at night count as zero.
    raw = record.data[[name for name in IRRADIANCES if name in record.data]]
    given, checks = raw.clip(lower=0.0), {}
    usual = climate_of_place(record.latitude, record.longitude)
    for year, rows in cut_years(record, interval).items():
        source = f"{record.source} (year {year})"
        # Each year by itself, with the Sun's position. First light below zero by day, columns of
        # zeros and sums since a time of day are refused, then summer time and shifted times.
        complete = add_sun(
            replace(record, data=record.data.iloc[rows]), interval, position=position.iloc[rows]
        )
        notes = _check_negative(raw.iloc[rows], complete, source)
        check_given(given.iloc[rows], complete, source)
        check_sums(complete, source)
        times = measure_sun_times(given.iloc[rows], interval, record.latitude, position.iloc[rows])
        # Summer time is looked for before the shift that would fit on average: none mends it.
        days = cut_days(complete)
        times.clear_shift = middle_of_clear_days(days)
        # Beyond 90 minutes light lies in other hours than the sun, and its middle tells nothing.
        if abs(times.daylight_shift or 0) <= 90:
            check_summer_time(days, source)
        check_shift(times, source)
        # The year's sum against the climate of the place, where that is known.
        share = None if usual is None else compare_with_climate(complete, days, usual)
        if share is not None:
            notes += check_against_climate(complete, share, usual, source)
        times.share_of_climate = share
        # Then values beyond physical limits.
        check_irradiance(complete, source)
        # GHI in place of DHI, and a horizontal part in place of DNI, are refused, unless both
        # follow from GHI alone by a model.
        if len(raw.columns) > 1:
            check_diffuse(complete, source)
            check_direct(complete, source)
        # Last, columns that contradict each other, faults of temperature and of single days, and
        # hours with more DNI than outside the atmosphere are refused or, where few or small, noted.
        check_closure(times, source)
        times.unlikely = notes + check_faults(complete, days, source)
        times.unlikely += _check_extraterrestrial(given, complete, source)
        # What was not given but follows must be within limits, too.
        derived = complete.data[[name for name in IRRADIANCES if name not in raw]]
        check_values(derived, complete.columns, source, cure="check these columns at that time")
        checks[year] = times
    return checks


def cut_years(record, interval):
    """Rows of each calendar year in mean solar time of the place; all rows in one if it is not in
    calendar years.

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
    # Two days of an adjacent year are left when the record's year is counted in another time zone.
    if not all(span >= SHORTEST_YEAR or span <= pd.Timedelta(days=2) for span in spans):
        return {f"{years[0]}-{years[-1]}": slice(None)}
    kept = [number for number, span in enumerate(spans) if span >= SHORTEST_YEAR]
    return {
        str(names[number]): slice(first[number], first[number] + count[number]) for number in kept
    }


def describe_checks(record, interval, checks):
    """Notes: whether 29 February is missing, and how well the irradiance fits the sun, of the worst
    years.

    Parameters
    ----------
    record : Record
    interval : pandas.Timedelta
    checks : dict
        Of `check_years`.

    Returns
    -------
    list of str
    """
    notes = [f"{year}: {note}" for year, check in checks.items() for note in check.unlikely]
    days = record.data.index[:-1][_skips_leap_day(record.data.index, interval)]
    if len(days):
        notes.append(
            f"29 February {', '.join(str((day + interval).year) for day in days)} is missing"
        )
    closures = [check for check in checks.values() if check.closure_residual is not None]
    if closures:
        worst = max(closures, key=lambda one: one.closure_residual)
        note = (
            f"GHI = DHI + DNI cos z to {100 * worst.closure_residual:.2f} % of GHI; best with the "
            "sun shifted by"
        )
        notes.append(
            f"{note} {worst.closure_shift:+d} min ({100 * worst.closure_residual_shifted:.2f} %)"
        )
    daylights = [check for check in checks.values() if check.daylight_shift is not None]
    if daylights:
        worst = max(daylights, key=lambda one: abs(one.daylight_shift))
        note = f"clear days fit the sun best with times shifted by {worst.daylight_shift:+d} min"
        if worst.of_another_sun:
            note += f": walls to the east and west may be wrong; {CURE_OF_TIMES}"
        notes.append(note)
    return notes
