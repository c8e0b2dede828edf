"""Weather of places without a file: the built-in climate, and the clear sky.

The climate is a climatology, neither a forecast nor a record of any year: monthly sums of GHI are
the long-term means, days and hours are random.
"""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from ..sun.solar_position import is_sunny, solar_position
from .clear_irradiance import clear_irradiance
from .climate_grid import look_up_normals
from .draw_clearness import bisect, draw_days, draw_hours, draw_normals, rank_days, scale_to_sums
from .weather import IRRADIANCES, Record

INTERVAL = pd.Timedelta(hours=1)
LABEL = "built-in climate (climatology: long-term monthly means, synthetic days)"
CLOSEST = 0.97  # largest monthly sum as a share of the cleanest sky's


def climate(latitude, longitude, year=2021, seed=0):
    """One typical year of a place.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    year : int
        Calendar year, in UTC: determines sun positions and dates, not the weather.
    seed : int
        Seed of the random days and hours.

    Returns
    -------
    Record
        Hourly; the altitude follows pvlib's table.

    Raises
    ------
    InputError
        The place lies south of 60° S.
    """
    return make_climates([latitude], [longitude], year, seed)[0]


def clear_sky(latitude, longitude, altitude, year, sun=None):
    """One year of the clear-sky model of Ineichen and Perez with pvlib's monthly Linke turbidity.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    altitude : float
        Of the place [m].
    year : int
        Calendar year, in UTC.
    sun : pandas.DataFrame, optional
        Of `solar_position` for the place and the year's hours, if known.

    Returns
    -------
    Record
        Hourly, with the irradiance at mid-interval, 15 °C and 1 ms⁻¹ throughout.

    Notes
    -----
    :doi:`10.1016/S0038-092X(02)00045-2`; an upper bound of a real year.
    """
    # Irradiance of a clear sky at the middle of each hour, from the sun, the haze of the month
    # (Linke turbidity) and the height of the place.
    times = hours_of_year(year)
    zenith = (solar_position(times, INTERVAL, latitude, longitude) if sun is None else sun)[
        "apparent_zenith"
    ]
    pressure = pvlib.atmosphere.alt2pres(altitude)
    turbidity = pvlib.clearsky.lookup_linke_turbidity(times + INTERVAL / 2, latitude, longitude)
    data = clear_irradiance(zenith, times + INTERVAL / 2, turbidity, altitude, pressure).set_axis(
        times
    )
    # A clear sky has air of 15 °C and a wind of 1 ms⁻¹.
    data = data.assign(temp_air=15.0, wind_speed=1.0, pressure=pressure)
    label = f"clear sky {year} (upper bound)"
    return Record(data, latitude, longitude, altitude, "clear-sky", label)


def hours_of_year(year):
    """Starts of the hours of a calendar year in UTC, which must be from 1900 to 2100:
    pandas.DatetimeIndex.
    """
    if not 1900 <= year <= 2100:
        raise InputError("--year", f"{year} is not from 1900 to 2100", "give a year in that range")
    return pd.date_range(
        f"{year}-01-01", f"{year + 1}-01-01", freq=INTERVAL, inclusive="left", tz="UTC"
    )


def make_climates(latitudes, longitudes, year=2021, seed=0, zenith=None):
    """One typical year of each of many places, with the same random numbers for all.

    Parameters
    ----------
    latitudes, longitudes : sequence of float, (p,)
        Places [°].
    year, seed
        As in `climate`.
    zenith : numpy.ndarray, (p, t), optional
        Apparent zenith of the sun at mid-interval [°], if known.

    Returns
    -------
    list of Record
        Hourly GHI, DHI and DNI [Wm⁻²] and air temperature [°C]; one wind speed [ms⁻¹] and one
        pressure [Pa] for all hours. It takes about 3 MB of memory per place.

    Raises
    ------
    InputError
        If a place lies south of 60° S.
    """
    # The long-term means of each place, and the sum of GHI that its year shall have.
    times = hours_of_year(year)
    places = list(zip(latitudes, longitudes, strict=True))
    normals = [look_up_normals(*place) for place in places]
    altitude = np.array([look_up_altitude(*place) for place in places])[:, None]  # (p, 1) [m]
    # (p, 1) [Wh/m²]
    annual = np.array([[found.ghi] for found in normals]) * 1000.0 * len(times) / 24
    # GHI from coarse to fine: the year's sum is shared among months, theirs among days, theirs
    # among hours; temperature follows from what the ground receives.
    sky = cleanest_sky(places, times, altitude, annual, zenith)
    monthly = monthly_sums(annual, normals, sky, times)
    drawn = draw_irradiance(places, times, sky, monthly, seed)
    temp_air = _air_temperature(places, times, normals, sky["outside"], drawn[0])
    # One Record a place; the mean wind speed follows from the root of the mean square if speeds
    # have a Rayleigh distribution.
    records = []
    for row, (place, found) in enumerate(zip(places, normals, strict=True)):
        data = pd.DataFrame(
            {name: values[row] for name, values in zip(IRRADIANCES, drawn, strict=True)},
            index=times,
        )
        wind_speed, pressure = (
            # Wind speeds follow Rayleigh's distribution: mean over root mean square is √(π/4).
            round(np.sqrt(np.pi / 4) * found.wind_speed, 2),
            sky["pressure"][row, 0].round(1),
        )
        data = data.assign(temp_air=temp_air[row], wind_speed=wind_speed, pressure=pressure)
        records.append(Record(data, *place, float(altitude[row, 0]), "climate", LABEL))
    return records


def look_up_altitude(latitude, longitude):
    """Altitude [m] of a place in pvlib's table (5 minutes of arc), 0 at sea."""
    return float(pvlib.location.lookup_altitude(latitude, longitude))


def cleanest_sky(places, times, altitude, annual, zenith=None):
    """Sun position, extraterrestrial irradiance, and irradiance under the cleanest sky.

    Parameters
    ----------
    places : list of (float, float)
        Latitude and longitude [°], p of them.
    times : pandas.DatetimeIndex, (t,)
        Start of each hour.
    altitude : numpy.ndarray, (p, 1)
        [m].
    annual : numpy.ndarray, (p, 1)
        Sum of GHI of the climate [Wh/m²]; where it is more than the cleanest sky gives, this sky is
        scaled up.
    zenith : numpy.ndarray, (p, t), optional
        Apparent zenith of the sun [°], if known.

    Returns
    -------
    dict
        zenith (apparent) [°], sine (of the elevation, 0 at night), outside (horizontal, outside the
        atmosphere), ghi and dni (clean) [Wm⁻²]: (p, t); pressure [Pa]: (p, 1).

    Notes
    -----
    Model of Ineichen and Perez with a Linke turbidity of 2.
    """
    # sine  of the sun's elevation [–]; extra  normal irradiance outside the atmosphere [Wm⁻²].
    if zenith is None:
        zenith = np.stack(
            [
                solar_position(times, INTERVAL, *place)["apparent_zenith"].to_numpy()
                for place in places
            ]
        )
    sine = np.maximum(np.cos(np.radians(zenith)), 0.0)
    extra = pvlib.irradiance.get_extra_radiation(times + INTERVAL / 2).to_numpy()
    pressure = pvlib.atmosphere.alt2pres(altitude)
    # Clean air's irradiance, with the sun just above the horizon for the air mass and dark below
    # it.
    risen = np.minimum(zenith, 89.99)
    airmass = pvlib.atmosphere.get_absolute_airmass(
        pvlib.atmosphere.get_relative_airmass(risen), pressure
    )
    # Very clean, dry air has a Linke turbidity of 2.
    clean = pvlib.clearsky.ineichen(risen, airmass, 2.0, altitude, extra)
    ghi, dni = (np.where(zenith < 90, clean[name], 0.0) for name in ("ghi", "dni"))
    # factor  by which this sky is scaled up where the climate has more light in a year than it
    # gives.
    factor = np.maximum(1.0, annual / (CLOSEST * ghi.sum(axis=1, keepdims=True)))
    sky = {"ghi": ghi * factor, "dni": dni * factor, "outside": extra * sine, "pressure": pressure}
    return sky | {"zenith": zenith, "sine": sine}


def _starts_of_months(times):
    """Index of the first hour of each month: (12,)."""
    return np.searchsorted(times.month.to_numpy(), np.arange(1, 13))


def monthly_sums(annual, normals, sky, times):
    """Sum of GHI of each month [Wh/m²], (p, 12), adding up to the annual sum (p, 1).

    The annual sum is distributed by the clearness of the months; each is limited to 97 % of the
    cleanest sky, and the excess goes to the others.
    """
    # outside  Sum of each month outside the atmosphere; most  what it may have at most [Wh/m²].
    starts = _starts_of_months(times)
    outside = np.add.reduceat(sky["outside"], starts, axis=1)
    most = CLOSEST * np.add.reduceat(sky["ghi"], starts, axis=1)
    # One factor for all months brings the year to its sum, although those at their limit stay
    # there: it is found by bisection, as the sum only grows with it.
    share = np.stack([found.clearness for found in normals]) * outside
    factor = bisect(
        lambda factor: np.minimum(share * factor, most).sum(axis=1, keepdims=True) < annual,
        np.zeros(annual.shape),
        np.full(annual.shape, 3.0),
    )
    return np.minimum(share * factor, most)


def draw_irradiance(places, times, sky, monthly, seed, *, rounding=3):
    """GHI, DHI and DNI of each hour [Wm⁻²]: three (p, t), with GHI = DHI + DNI·cos θ in every hour.

    Notes
    -----
    Days are drawn by Bendt et al. and hours by Aguiar and Collares-Pereira (see `draw_clearness`);
    the direct part follows from DISC (E. L. Maxwell, SERI/TR-215-3087, 1987).
    """
    # Days are local ones, of the whole hours that the longitude tells: hours are moved to local
    # time, drawn in days of 24, and moved back.
    starts, outside = _starts_of_months(times), sky["outside"]
    cleanest = sky["ghi"] / np.maximum(outside, 1e-9)
    shift = np.array([[round(longitude / 15)] for _, longitude in places])
    # (p, t) index in UTC of each local hour, cyclic over the year
    local = (np.arange(len(times)) - shift) % len(times)
    by_day = (len(places), len(times) // 24, 24)

    def to_local(values):
        return np.take_along_axis(values, local, axis=1).reshape(by_day)

    # Random numbers by the seed, the same for all places; mean is the clearness index of each month
    # [–], GHI over irradiance outside the atmosphere.
    month = times.month.to_numpy()[::24] - 1
    normals = draw_normals(seed, (25, by_day[1]))
    mean = monthly / np.maximum(np.add.reduceat(outside, starts, axis=1), 1.0)
    # Days: clearness between a dull day's and the cleanest sky's, by the month's distribution.
    outside_of_day = to_local(outside).sum(axis=2)
    cleanest_day = to_local(sky["ghi"]).sum(axis=2) / np.maximum(outside_of_day, 1e-9)
    days = draw_days(mean, cleanest_day, rank_days(normals[0], month), month)
    # Hours: drawn around the clearness of their day, then scaled so that the day keeps its sum.
    hours = draw_hours(days, to_local(cleanest), to_local(sky["sine"]), normals[1:].T)
    flat = [
        values.reshape(len(places), -1) for values in (hours, to_local(cleanest), to_local(outside))
    ]
    hours = scale_to_sums(*flat, days * outside_of_day, np.arange(0, len(times), 24))
    # Back in UTC, months are scaled once more to their exact sums, as local days cross their ends.
    clearness = np.empty_like(hours)
    np.put_along_axis(clearness, local, hours, axis=1)
    # `rounding`: decimals of the irradiance [Wm⁻²]: processors differ far below that.
    ghi = (scale_to_sums(clearness, cleanest, outside, monthly, starts) * outside).round(rounding)
    # Direct light by DISC from GHI and the air mass; no more than the cleanest sky lets through,
    # nor than leaves 3 % of GHI diffuse, and none at night.
    day = np.broadcast_to(times.day_of_year.to_numpy(), ghi.shape)
    dni = np.nan_to_num(
        pvlib.irradiance.disc(ghi, sky["zenith"], day, pressure=sky["pressure"])["dni"]
    )
    dni = np.minimum(dni, np.minimum(sky["dni"], 0.97 * ghi / np.maximum(sky["sine"], 1e-3)))
    dni = np.where(is_sunny(sky["zenith"]), dni, 0.0).round(rounding)
    # Processors differ in the last digits of the sine: nine decimals split the light the same
    # everywhere.
    return ghi, ghi - dni * sky["sine"].round(9), dni


def _air_temperature(places, times, normals, outside, ghi):
    """Air temperature [°C] of each hour, (p, t): annual mean plus annual and daily cycle.

    Parameters
    ----------
    places : list of (float, float)
        Latitude and longitude [°].
    times : pandas.DatetimeIndex, (t,)
        Start of each hour.
    normals : list of Normals
    outside, ghi : numpy.ndarray, (p, t)
        Irradiance on a horizontal plane, outside the atmosphere and on the ground [Wm⁻²].

    Notes
    -----
    The annual cycle is the first harmonic of GHI times a gain, delayed by 29 days. The gain is
    interpolated between the ones for air from the sea and from land by the share of land upwind,
    which explains most of its variance: A. R. Stine et al., :doi:`10.1038/nature07675`; K. A.
    McKinnon et al., :doi:`10.1175/JCLI-D-13-00021.1`.

    The daily cycle is taken from D. G. Erbs, S. A. Klein, W. A. Beckman, ASHRAE J. 25 (6), 60 to 65
    (1983): its range follows from the clearness index, its shape is a sum of four harmonics. They
    give it for the mean day of a month; here each hour uses the clearness of the 24 hours around
    it, so that sunny days have the warmest afternoons.
    """
    # Annual cycle: first Fourier coefficient of GHI, times the gain, turned back by the lag.
    phase = 2j * np.pi * (np.arange(len(times)) + 0.5) / len(times)
    harmonic = 2 * (ghi * np.exp(-phase)).mean(axis=1)  # (p,) [Wm⁻²]
    influence = np.array([found.land_influence for found in normals])
    # First annual harmonic of air temperature over the first one of GHI: 0.03 for air from the sea,
    # 0.19 for air from land.
    gain = 0.03 + (0.19 - 0.03) * influence  # (p,) [K/Wm⁻²]
    # Land temperature follows irradiance after 29 days (Stine et al. 2009).
    lag = 2j * np.pi * 29.0 / (len(times) / 24)
    yearly = ((gain * harmonic)[:, None] * np.exp(phase - lag)).real
    # Daily cycle (Erbs et al.): swing  range of a day from its clearness [K].
    clearness = _sum_day_around(ghi) / np.maximum(_sum_day_around(outside), 1.0)
    swing = np.maximum(25.8 * clearness - 5.21, 0.0)  # [K]
    # solar  hour angle from one o'clock in the afternoon, local solar time [rad]; form  course of a
    # day, with a range of about 1 [–].
    longitude = np.array([[place[1]] for place in places])
    solar = 2 * np.pi * (np.arange(len(times)) + 0.5 + longitude / 15 - 1) / 24  # 1 o'clock is 0
    form = 0.4632 * np.cos(solar - 3.805) + 0.0984 * np.cos(2 * solar - 0.360)
    form += 0.0168 * np.cos(3 * solar - 0.822) + 0.0138 * np.cos(4 * solar - 3.513)
    # The cycles average to nothing, so that the year has its mean.
    cycles = yearly + swing * form
    mean = np.array([[found.temp_air] for found in normals])
    return (mean + cycles - cycles.mean(axis=1, keepdims=True)).round(3)


def _sum_day_around(hourly):
    """Sums of the 24 hours around the end of each hour, (p, t); a year follows upon itself."""
    sums = np.cumsum(np.pad(hourly, ((0, 0), (12, 12)), "wrap"), axis=1)
    return sums[:, 24:] - sums[:, :-24]
