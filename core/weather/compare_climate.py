"""Hold each year of a record against the built-in climate of its place.

The climate alone refuses nothing: a year may be unusual, a valley cloudier than its surroundings. A
year is refused where something that does not rest on the climate says the same: its clearest days,
the shape of its days, or the course of a column over day and year.

Ratios over 56 real records: GHI 0.75 to 1.13, air temperature −3.4 to +3.0 K, wind speed 0.12 to
2.16.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError, show_number
from .add_sun import add_sun
from .check_faults import clear_sky_of, cut_days, name_factor
from .check_sun_times import haurwitz
from .climate import INTERVAL, climate
from .climate_grid import LAPSE, LEAST_LATITUDE, spread_of_ghi


@dataclass
class _ClimateShare:
    """A year beside the climate of the same months."""

    ghi: float  # share of the climate's sum
    temp_air: float  # [K] above the climate's mean, at the record's altitude
    wind_speed: float  # share of the climate's mean
    clear_days: float  # GHI of the clearest 2 % of days, share of a very clean sky
    dull_days: int  # with less than half of a very clean sky
    dull_days_of_climate: int


def climate_of_place(latitude, longitude):
    """The built-in climate of a place as Weather, to hold records against; None where it says
    nothing.

    It says nothing south of 60° S, and where the four cells around differ by more than 20 %: there
    the climate of the place itself is not known well enough.
    """
    if latitude < LEAST_LATITUDE or spread_of_ghi(latitude, longitude) > 0.2:
        return None
    return add_sun(climate(latitude, (longitude + 180.0) % 360.0 - 180.0), INTERVAL)


def compare_with_climate(year, days, usual, *, lit_day=2000.0, dull=0.5):
    """A year beside the climate of the same months: ClimateShare.

    Parameters
    ----------
    year : Weather
        A year, or most of it, with the sun.
    days : pandas.DataFrame
        Of `cut_days`.
    usual : Weather
        Of `climate_of_place`.
    """
    # Each interval has the climate's mean of its month, so that months that lack count in neither.
    means = usual.data.groupby((usual.data.index + INTERVAL / 2).month).mean()
    expected = means.loc[(year.data.index + year.interval / 2).month]
    lapse = LAPSE * (usual.altitude - year.altitude)  # [K]
    # Clear and dull days, told by the share of a clean sky that they let through, where there is
    # enough light to tell; the climate's in the same months beside them.
    # `lit_day`: [Wh/m²] of a clean sky, from which on a day is told clear or dull.
    bright = days["clean"] > lit_day
    clearness = (days["ghi"] / days["clean"])[bright]
    months = set(days.index.month)
    usual_days = cut_days(usual)
    usual_days = usual_days[usual_days.index.month.isin(months) & (usual_days["clean"] > lit_day)]
    return _ClimateShare(
        ghi=float(year.data["ghi"].sum() / expected["ghi"].sum()),
        temp_air=float(year.data["temp_air"].mean() - expected["temp_air"].mean() - lapse),
        wind_speed=float(year.data["wind_speed"].mean() / expected["wind_speed"].mean()),
        clear_days=float(clearness.quantile(0.98)) if len(clearness) else np.nan,
        dull_days=int((clearness < dull).sum()),
        dull_days_of_climate=int((usual_days["ghi"] < dull * usual_days["clean"]).sum()),
    )


def check_against_climate(year, share, usual, source):
    """Refuse a year in which the climate and something else name the same fault; say what only the
    climate finds.

    Parameters
    ----------
    year : Weather
    share : ClimateShare
    usual : Weather
        Of `climate_of_place`.
    source : str
        The file and the year, for messages.

    Returns
    -------
    list of str
        What is unusual, with the likely cause.

    Raises
    ------
    InputError
    """
    columns = year.columns
    # Too little light in sum and under the clearest skies, which real records show at 0.87 to 1.03
    # of a clean one.
    if share.ghi < 0.6 and 0 < share.clear_days < 0.65:
        problem = (
            f"{columns['ghi']} is {_percent(share.ghi)} of the long-term mean, and that of its "
            "clearest days"
        )
        problem += f" {_percent(share.clear_days)} of what a clean sky lets through"
        # Real records have 0.95 of a clean sky on such days.
        raise InputError(source, problem, name_factor(0.95 / share.clear_days, year.interval))
    _check_clear_sky(year, share, source)
    _check_exchanged(year, share, usual, source)
    return _describe_unusual(share, columns)


def _check_clear_sky(year, share, source):
    """Refuse columns of a clear sky in place of the sky as it was."""
    # A real year has dull days where the climate has many; without any, the shape of the hours
    # decides.
    if share.dull_days or share.dull_days_of_climate <= 20:
        return
    clear = _share_of_clear_shape(year)
    if clear >= 0.95:
        problem = (
            f"{_percent(clear)} of its sunny hours have the shape of a clear sky's, and no day is "
            "dull where the"
        )
        problem += f" climate has {share.dull_days_of_climate}: these are columns of a clear sky"
        raise InputError(
            source,
            problem,
            "give those of the sky with its clouds (GHI, DHI, DNI without 'clear sky')",
        )


def _share_of_clear_shape(year):
    """Share of sunny hours whose GHI lies within 3 % of a clear sky's, scaled to the day.

    Any of five will do, as services use other models: Ineichen and Perez with pvlib's monthly
    turbidity, with 2 and with 5, Haurwitz, and the simplified Solis. Sunny is an elevation above
    10°. Real records show 0.16 to 0.60, the last one in a desert; columns of a sixth model (Bird)
    0.98 to 1.
    """
    # Sunny hours, and what each model of a clear sky says for them.
    middle = year.data.index + year.interval / 2
    zenith, ghi = year.data["apparent_zenith"].to_numpy(), year.data["ghi"].to_numpy()
    sunny = zenith < 80.0
    if not sunny.any():
        return 0.0
    turbidity = pvlib.clearsky.lookup_linke_turbidity(middle, year.latitude, year.longitude)
    skies = [clear_sky_of(year, value)["ghi"].to_numpy() for value in (turbidity, 2.0, 5.0)]
    skies.append(haurwitz(np.maximum(np.cos(np.radians(zenith)), 0.0)))
    skies.append(np.nan_to_num(pvlib.clearsky.simplified_solis(90.0 - zenith)["ghi"]))
    # One factor for each day, as the air changes from day to day.
    day = pd.factorize((middle + pd.Timedelta(hours=year.longitude / 15)).normalize())[0]
    near = np.zeros(len(ghi), bool)
    for sky in skies:
        light, clear = (np.bincount(day, values * sunny) for values in (ghi, sky))
        scaled = sky * (light / np.maximum(clear, 1.0))[day]
        near |= (np.abs(ghi - scaled) <= 0.03 * scaled) & (scaled > 0)
    return float(near[sunny].mean())


def _check_exchanged(year, share, usual, source):
    """Refuse air temperature and wind speed that stand in each other's column."""
    # What the two columns would be against the climate if they were exchanged.
    temp_air, wind_speed = (year.data[name].to_numpy() for name in ("temp_air", "wind_speed"))
    mean_temp, mean_wind = temp_air.mean(), wind_speed.mean()
    as_temp = share.temp_air - mean_temp + mean_wind  # [K] above the climate, were they exchanged
    as_wind = share.wind_speed * mean_temp / mean_wind if mean_wind else np.inf
    unusual = abs(share.temp_air) > 5.0 or share.wind_speed > 2.5
    nearer = abs(as_temp) < 6.0 and 0.1 < as_wind < 2.5
    if not (unusual and nearer):
        return
    # Temperature follows the sun over day and year; wind does so much less.
    slot = usual.data.index.month * 24 + usual.data.index.hour
    course = usual.data["temp_air"].groupby(slot).mean()
    middle = year.data.index + year.interval / 2
    course = course.reindex(middle.month * 24 + middle.hour).to_numpy()
    of_temp, of_wind = (_correlation(course, values) for values in (temp_air, wind_speed))
    if of_wind > of_temp + 0.2:
        names = year.columns["temp_air"], year.columns["wind_speed"]
        problem = (
            f"mean {names[0]} is {mean_temp:.1f} °C, {names[1]} {mean_wind:.1f} ms⁻¹ and follows "
            "the sun as a"
        )
        raise InputError(
            source, f"{problem} temperature does", f"exchange the columns {names[0]} and {names[1]}"
        )


def _correlation(one, other):
    """Correlation of two series, 0 where one of them is constant."""
    return float(np.corrcoef(one, other)[0, 1]) if np.ptp(one) > 0 and np.ptp(other) > 0 else 0.0


def _describe_unusual(share, columns):
    """What lies outside of what records show against the climate, with the likely cause: list of
    str.
    """
    notes = []
    if not 0.75 <= share.ghi <= 1.15:
        causes = "another unit, shade on the instrument, or columns of another place or sky"
        notes.append(
            f"{columns['ghi']} is {_percent(share.ghi)} of the long-term mean: an unusual year, "
            f"{causes}"
        )
    if abs(share.temp_air) > 4.0:
        more = "above" if share.temp_air > 0 else "below"
        causes = "°F, another altitude, or columns exchanged"
        words = f"mean {columns['temp_air']} is {abs(share.temp_air):.1f} K {more} the climate's"
        notes.append(f"{words}: {causes}")
    if not 0.1 <= share.wind_speed <= 2.5:
        cause = "another unit, or a sheltered instrument"
        if share.wind_speed > 1:
            cause = "km/h (3.6 times m/s), knots or mph"
        notes.append(
            f"mean {columns['wind_speed']} is {share.wind_speed:.2g} times the climate's: {cause}"
        )
    return notes


def label_of_shares(shares):
    """Words for a label: "97 % of the long-term mean", of each of up to eight years, or their
    range.

    `shares` are ClimateShare by year, as text; "" where there are none.
    """
    if not shares:
        return ""
    mean = "of the long-term mean"
    if len(shares) == 1:
        return f"{_percent(next(iter(shares.values())).ghi)} {mean}"
    if len(shares) <= 8:
        return (
            ", ".join(f"{year}: {_percent(share.ghi)}" for year, share in shares.items())
            + f" {mean}"
        )
    least, most = (pick(share.ghi for share in shares.values()) for pick in (min, max))
    return f"{len(shares)} years, {show_number(100 * least, 0)} to {_percent(most)} {mean}"


def _percent(share):
    """A share in whole percent, as text."""
    return f"{100 * share:.0f} %"
