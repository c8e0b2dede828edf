"""One or several years of weather at one place, as read from files and as used; how far that place
is from the city.
"""

from dataclasses import dataclass, field, replace
from datetime import timezone

import numpy as np
import pandas as pd
import pyproj

from ..settings.errors import InputError, first_true
from ..sun.suns import TimeAxis

IRRADIANCES = ("ghi", "dhi", "dni")
TYPICAL_YEAR = 2021  # a year without a leap day


@dataclass
class Record:
    """The values of weather at one place, as they were read."""

    # index: UTC start of each interval; any of ghi, dhi, dni, temp_air, wind_speed, pressure
    data: pd.DataFrame
    latitude: float  # [°] of the sun: the requested place, or the station
    longitude: float  # [°]
    altitude: float  # [m]
    source: str  # the file, for messages
    label: str  # shown with the results: "ERA5 era5_berlin_2017.nc", "clear sky (upper bound)"
    notes: list = field(default_factory=list)  # of str: findings on the file, for the user
    # column of data -> what the file calls it, or what it follows from
    columns: dict = field(default_factory=dict)

    def change(self, time_shift=0.0, without="none"):
        """Shift the times and drop a column, as requested, with notes on it.

        Parameters
        ----------
        time_shift : float
            [min] added to the times.
        without : {"none", "ghi", "dhi", "dni"}
            Column to drop.

        Returns
        -------
        Record
        """
        data, notes = self.data, list(self.notes)
        if without in data:
            data = data.drop(columns=without)
            notes.append(f"{without} of the file is not used")
        if time_shift:
            data = data.set_axis(data.index + pd.Timedelta(minutes=time_shift), axis=0)
            notes.append(f"times shifted by {time_shift:+g} min")
        return replace(self, data=data, notes=notes)


@dataclass
class Weather(Record):
    """A Record that was checked, complete and with the sun, independent of any surface."""

    # Columns of data, all float64:
    # ghi, dhi, dni [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹], pressure [Pa]
    # and, of the sun at mid-interval, solar_zenith, apparent_zenith, solar_azimuth [°].
    # Below 2° of apparent elevation dni is the measured one, or 0 if it would have to be derived;
    # see add_sun.

    interval: pd.Timedelta = field(kw_only=True)  # length of every interval
    # year -> fields of SunTimes: how well the irradiance fits the sun
    checks: dict = field(default_factory=dict)
    # offset of the calendar of sums and series; None: the times of data
    zone: timezone | None = None

    @property
    def axis(self):
        """Its intervals and its place: TimeAxis."""
        return TimeAxis(self.data.index, self.interval, self.latitude, self.longitude)

    @property
    def year_count(self):
        """Number of years: whole ones, or a fraction if it is shorter than one."""
        span = len(self.data) * self.interval / pd.Timedelta(days=365)
        return float(int(span)) if span >= 1 else span

    def check_distance(self, site, allowed=None, suns=None):
        """Refuse weather from a place too far from the city, or from the latitude of the traced
        suns.

        Parameters
        ----------
        site : Site
            latitude and longitude of the city [°].
        allowed : float, optional
            [km] Default 150.
        suns : Suns, optional
            Suns of a Transfer, which can be used with any weather of about the same latitude, or of
            any place if they are a sky grid.

        Raises
        ------
        InputError
        """
        if suns is not None and suns.sampling.startswith("sky-grid"):
            return
        if suns is None:
            away, words = (
                self.distance_to(site),
                f"city ({site.latitude:.2f}°, {site.longitude:.2f}°)",
            )
            cure = "give weather of the city's own place"
        else:
            # A degree along a meridian has 111.2 km.
            away, words = (
                111.2 * abs(self.latitude - site.latitude),
                f"latitude {site.latitude:.2f}°",
            )
            words += " that was traced"
            cure = "give weather of that latitude, trace --suns sky-grid:N"
        # Unless the user allows more, the weather lies within 150 km of the city.
        if away > (150.0 if allowed is None else allowed):
            raise InputError(
                self.label,
                f"its place ({self.latitude:.2f}°, {self.longitude:.2f}°) is {away:,.0f} km from "
                f"the {words}",
                f"{cure}, or --allow-distance {int(np.ceil(away / 10) * 10)}",
            )

    def darken(self, dark):
        """Make it night in some hours, (t,) bool: no irradiance, and the sun at the nadir."""
        night = {"ghi": 0.0, "dni": 0.0, "dhi": 0.0, "apparent_zenith": 180.0}
        data = self.data.assign(
            **{name: self.data[name].mask(dark, value) for name, value in night.items()}
        )
        return replace(self, data=data)

    def describe_distance(self, site):
        """Where the weather comes from as text, "" if it is the city's own place (within 1 km)."""
        away = self.distance_to(site)
        return f"from a place {away:,.0f} km away, whose sun is used" if away >= 1 else ""

    def distance_to(self, site):
        """[km] from the city to the place of the weather, along the ellipsoid."""
        globe = pyproj.Geod(ellps="WGS84")
        return globe.inv(site.longitude, site.latitude, self.longitude, self.latitude)[2] / 1000


def join_records(records):
    """One record of several, in the order of time.

    Parameters
    ----------
    records : list of Record

    Returns
    -------
    Record
        With place and altitude of the first in the list; a single record is returned as it is.

    Raises
    ------
    InputError
        If their places or columns differ.
    """
    first = records[0]
    if len(records) == 1:
        return first
    # Only years of one place with the same columns belong together.
    for other in records[1:]:
        # The places of joined files may differ by 0.05°.
        if max(abs(other.latitude - first.latitude), abs(other.longitude - first.longitude)) > 0.05:
            problem = (
                f"its place {other.latitude:g}°, {other.longitude:g}° is not that of {first.source}"
            )
            problem += f" ({first.latitude:g}°, {first.longitude:g}°)"
            raise InputError(
                other.source,
                problem,
                "give years of one place, or --weather-place LATITUDE LONGITUDE",
            )
        if set(other.data) != set(first.data):
            differing = ", ".join(sorted(set(other.data) ^ set(first.data)))
            raise InputError(
                other.source, f"not all files have {differing}", "give files with the same columns"
            )
    # In the order of time, with all their notes.
    records = sorted(records, key=lambda record: record.data.index[0])
    return replace(
        first,
        data=pd.concat([record.data for record in records]),
        source=", ".join(record.source for record in records),
        label=", ".join(record.label for record in records),
        notes=[note for record in records for note in record.notes],
    )


DAMAGED = "correct it, or download it again if it is cut"


def read_numbers(path, column):
    """Numbers of one column; empty fields are missing values.

    Parameters
    ----------
    path : path-like
        The file, for messages.
    column : pandas.Series
        One column of the table, one row for each interval.

    Returns
    -------
    numpy.ndarray, (t,)
    """
    numbers = pd.to_numeric(column, errors="coerce")
    if (row := first_true(numbers.isna() & column.notna())) is not None:
        raise InputError(
            path,
            f"{column.iloc[row]!r} (row {row + 1}, column {column.name!r}) is not a number",
            "correct it",
        )
    return numbers.to_numpy(dtype=float)


def coerce_year(data):
    """Put the rows of a typical year into one calendar year, in order.

    One real year, or several consecutive ones, are unchanged.

    Parameters
    ----------
    data : pandas.DataFrame
        Indexed by the tz-aware start of each interval in the file's own standard time.

    Returns
    -------
    data : pandas.DataFrame
        Indexed in UTC, ascending in the file's own time zone.
    typical : bool
        Whether the year was changed.
    """
    times = data.index
    leap_day = bool(((times.month == 2) & (times.day == 29)).any())
    steps = times[1:] - times[:-1]
    if len(set(times.year)) == 1 or len(set(steps)) == 1:
        return data.tz_convert("UTC"), False
    year = 2020 if leap_day else TYPICAL_YEAR
    days = pd.to_datetime(pd.DataFrame({"year": year, "month": times.month, "day": times.day}))
    moved = pd.DatetimeIndex(days).tz_localize(times.tz) + (times - times.normalize())
    return data.set_axis(moved, axis=0).sort_index(kind="stable").tz_convert("UTC"), True
