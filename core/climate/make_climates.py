"""Typical years of many places on land, from long-term means and synthetic days.

Monthly sums of GHI are those of the climate; days and hours are random. It is a climatology: neither a forecast nor a
record of any year.
"""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from ..sun.solar_position import is_sunny, solar_position
from .air_temperature import air_temperature
from .climate_grid import look_up_normals
from .draw_clearness import draw_days, draw_hours, draw_normals, rank_days, scale_to_sums

INTERVAL = pd.Timedelta(hours=1)
CLEAN_TURBIDITY = 2.0  # Linke turbidity of very clean, dry air
CLOSEST = 0.97  # largest monthly sum as a share of that of the cleanest sky
ROUNDING = 3  # decimals of the irradiance [Wm⁻²]: processors differ far below that
SINE_ROUNDING = 9  # decimals of the sine of the sun's elevation for splitting it, for the same reason

RAYLEIGH = np.sqrt(np.pi / 4)  # mean over root mean square of wind speeds


def make_climates(latitudes, longitudes, year=2021, seed=0, zenith=None):
    """One typical year of each of many places, with the same random numbers for all.

    Parameters
    ----------
    latitudes, longitudes : array_like, (p,)
        Places [°], all on land.
    year, seed
        As in `weather.climate.climate`.
    zenith : numpy.ndarray, (p, t), optional
        Apparent zenith of the sun at mid-interval [°], if known.

    Returns
    -------
    dict
        times: start of each hour (UTC), (t,); ghi, dhi, dni [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹] and pressure [Pa]:
        (p, t). It takes about 3 MB of memory per place.

    Raises
    ------
    InputError
        If a place is not on land.
    """
    if not 1900 <= year <= 2100:
        raise InputError("--year", f"{year} is not from 1900 to 2100", "give a year in that range")
    places = list(zip(np.atleast_1d(latitudes), np.atleast_1d(longitudes), strict=True))
    normals = [look_up_normals(*place) for place in places]
    for place, found in zip(places, normals, strict=True):
        if found is None:
            problem = f"no land near {place[0]:.2f}°, {place[1]:.2f}°"
            raise InputError("climate", problem, "give a place on land, or clear-sky")
    times = pd.date_range(f"{year}-01-01", f"{year + 1}-01-01", freq=INTERVAL, inclusive="left", tz="UTC")
    altitude = np.array([look_up_altitude(*place) for place in places])[:, None]  # (p, 1) [m]
    annual = np.array([[found.ghi] for found in normals]) * 1000.0 * len(times) / 24  # (p, 1) [Wh/m²]
    sky = raise_sky(cleanest_sky(places, times, altitude, zenith), annual)
    monthly = monthly_sums(annual, normals, sky, times)
    ghi, dhi, dni = draw_irradiance(places, times, sky, monthly, seed)
    shape = ghi.shape
    return {
        "times": times,
        "ghi": ghi,
        "dhi": dhi,
        "dni": dni,
        "temp_air": air_temperature(places, times, normals, sky["outside"], ghi),
        "wind_speed": np.broadcast_to(np.array([[RAYLEIGH * found.wind_speed] for found in normals]), shape).round(2),
        "pressure": np.broadcast_to(sky["pressure"], shape).round(1),
    }


def look_up_altitude(latitude, longitude):
    """Altitude [m] of a place in pvlib's table (5 minutes of arc), 0 at sea."""
    return float(pvlib.location.lookup_altitude(latitude, longitude))


def cleanest_sky(places, times, altitude, zenith=None):
    """Sun position, extraterrestrial irradiance, and irradiance under the cleanest sky.

    Parameters
    ----------
    places : list of (float, float)
        Latitude and longitude [°], p of them.
    times : pandas.DatetimeIndex, (t,)
        Start of each hour.
    altitude : numpy.ndarray, (p, 1)
        [m].
    zenith : numpy.ndarray, (p, t), optional
        Apparent zenith of the sun [°], if known.

    Returns
    -------
    dict
        zenith (apparent) [°], sine (of the elevation, 0 at night), outside (horizontal, outside the atmosphere), ghi
        and dni (clean) [Wm⁻²]: (p, t); pressure [Pa]: (p, 1).

    Notes
    -----
    Model of Ineichen and Perez with a Linke turbidity of 2.
    """
    if zenith is None:
        zenith = np.stack([solar_position(times, INTERVAL, *place)["apparent_zenith"].to_numpy() for place in places])
    sine = np.maximum(np.cos(np.radians(zenith)), 0.0)
    extra = pvlib.irradiance.get_extra_radiation(times + INTERVAL / 2).to_numpy()
    pressure = pvlib.atmosphere.alt2pres(altitude)
    risen = np.minimum(zenith, 89.99)
    airmass = pvlib.atmosphere.get_absolute_airmass(pvlib.atmosphere.get_relative_airmass(risen), pressure)
    clean = pvlib.clearsky.ineichen(risen, airmass, CLEAN_TURBIDITY, altitude, extra)
    ghi, dni = (np.where(zenith < 90, clean[name], 0.0) for name in ("ghi", "dni"))
    return {"zenith": zenith, "sine": sine, "outside": extra * sine, "ghi": ghi, "dni": dni, "pressure": pressure}


def raise_sky(sky, annual):
    """The cleanest sky, scaled up where the climate's annual sum [Wh/m²] exceeds it."""
    factor = np.maximum(1.0, annual / (CLOSEST * sky["ghi"].sum(axis=1, keepdims=True)))
    return sky | {"ghi": sky["ghi"] * factor, "dni": sky["dni"] * factor}


def starts_of_months(times):
    """Index of the first hour of each month: (12,)."""
    return np.searchsorted(times.month.to_numpy(), np.arange(1, 13))


def monthly_sums(annual, normals, sky, times):
    """Sum of GHI of each month [Wh/m²], (p, 12), adding up to the annual sum (p, 1).

    The annual sum is distributed by the clearness of the months; each is limited to 97 % of the cleanest sky, and the
    excess goes to the others.
    """
    starts = starts_of_months(times)
    outside = np.add.reduceat(sky["outside"], starts, axis=1)
    most = CLOSEST * np.add.reduceat(sky["ghi"], starts, axis=1)
    share = np.stack([found.clearness for found in normals]) * outside
    low, high = np.zeros(annual.shape), np.full(annual.shape, 3.0)
    for _ in range(60):
        middle = (low + high) / 2
        short = np.minimum(share * middle, most).sum(axis=1, keepdims=True) < annual
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.minimum(share * (low + high) / 2, most)


def draw_irradiance(places, times, sky, monthly, seed):
    """GHI, DHI and DNI of each hour [Wm⁻²]: three (p, t).

    Notes
    -----
    Days are drawn by Bendt et al. and hours by Aguiar and Collares-Pereira (see `draw_clearness`); the direct part is
    that of DISC (E. L. Maxwell, SERI/TR-215-3087, 1987).
    """
    starts, outside = starts_of_months(times), sky["outside"]
    cleanest = sky["ghi"] / np.maximum(outside, 1e-9)
    shift = np.array([[round(longitude / 15)] for _, longitude in places])
    local = (np.arange(len(times)) - shift) % len(times)  # (p, t) index in UTC of each local hour, cyclic over the year
    by_day = (len(places), len(times) // 24, 24)

    def to_local(values):
        return np.take_along_axis(values, local, axis=1).reshape(by_day)

    month = times.month.to_numpy()[::24] - 1
    normals = draw_normals(seed, (25, by_day[1]))
    mean = monthly / np.maximum(np.add.reduceat(outside, starts, axis=1), 1.0)
    outside_of_day = to_local(outside).sum(axis=2)
    cleanest_day = to_local(sky["ghi"]).sum(axis=2) / np.maximum(outside_of_day, 1e-9)
    days = draw_days(mean, cleanest_day, rank_days(normals[0], month), month)
    hours = draw_hours(days, to_local(cleanest), to_local(sky["sine"]), normals[1:].T)
    flat = [values.reshape(len(places), -1) for values in (hours, to_local(cleanest), to_local(outside))]
    hours = scale_to_sums(*flat, days * outside_of_day, np.arange(0, len(times), 24))
    clearness = np.empty_like(hours)
    np.put_along_axis(clearness, local, hours, axis=1)
    ghi = (scale_to_sums(clearness, cleanest, outside, monthly, starts) * outside).round(ROUNDING)
    return (ghi, *split_irradiance(ghi, sky, times))


def split_irradiance(ghi, sky, times):
    """DHI and DNI [Wm⁻²] of GHI by DISC: two (p, t). GHI = DHI + DNI·cos θ holds in every hour."""
    day = np.broadcast_to(times.dayofyear.to_numpy(), ghi.shape)
    dni = np.nan_to_num(pvlib.irradiance.disc(ghi, sky["zenith"], day, pressure=sky["pressure"])["dni"])
    dni = np.minimum(dni, np.minimum(sky["dni"], 0.97 * ghi / np.maximum(sky["sine"], 1e-3)))
    dni = np.where(is_sunny(sky["zenith"]), dni, 0.0).round(ROUNDING)
    return ghi - dni * sky["sine"].round(SINE_ROUNDING), dni
