"""Faults of a year that no single value shows: gaps filled with numbers, wrong columns or units,
summer time.

Each check rests on what sun and air allow, and the closest that real records come to its limit
stands beside it.
"""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError, count_of
from ..sun.solar_position import sun_direction
from .check_sun_times import MINUTE, cos_zenith_after, haurwitz
from .clear_irradiance import clear_irradiance

DAY, HOUR = pd.Timedelta(days=1), pd.Timedelta(hours=1)

# Days on which the sun would give this [Wh/m²] outside the atmosphere have light: of 23 years of 17
# real records the darkest had a clearness of 0.028. Up to three days of zeros a year are in records
# of weather services.
LIT_DAY = 1500.0
# Light [Wm⁻²] while the sun is below civil twilight; none in real records.
NIGHT_LIGHT = 5.0
# Daily GHI over GHI under a very clean, dry sky, of the clearest 2 % of days: 0.87 to 1.03, over
# snow too.
CLEAR_DAY = 2000.0
STRONG, FEWEST = 600.0, 50
# DNI of the clearest tenth over DNI of a clear sky: under a low sun 0.60 to 1.6 times as much as
# under a high one.
LOW_SUN = np.sin(np.radians([12.0, 20.0]))


def check_faults(year, days, source):
    """Refuse a year whose irradiance or temperature cannot be what its columns say.

    Parameters
    ----------
    year : Weather
        Complete, with the sun.
    days : pandas.DataFrame
        Of `cut_days`.
    source : str
        The file and the year, for messages.

    Returns
    -------
    list of str
        Notes on what is unlikely, yet happens.

    Raises
    ------
    InputError
        Names the first day and a cure.
    """
    # A year warmer than any place at its latitude is refused; Fahrenheit or kelvin is named as the
    # cause if it would fit.
    temp_air = year.data["temp_air"]
    # Mean air temperature of a year [°C] by latitude [°], 4 K above the warmest places (Dallol,
    # Ahvaz, Athens, Scilly, Shetland, the Norwegian coast, Svalbard).
    warmest = (0, 25, 30, 40, 50, 60, 70, 80, 90), (39, 39, 32, 25, 17, 13, 8, 0, -8)
    mean, most = float(temp_air.mean()), float(np.interp(abs(year.latitude), *warmest))
    # Tables that are made up may have one temperature all year: with a standard deviation below 1 K
    # they pass.
    if mean > most and temp_air.std() > 1.0:
        problem = (
            f"the mean air temperature is {mean:.0f} °C, above {most:.0f}, the most at "
            f"{year.latitude:.0f}°"
        )
        fahrenheit, kelvin = (mean - 32) / 1.8, mean - 273.15
        # Of the two units the one that a place of this latitude can have.
        if fahrenheit <= most:
            raise InputError(
                source, problem, f"give °C: {mean:.0f} °F would be {fahrenheit:.0f} °C"
            )
        if -60 < kelvin <= most:
            raise InputError(source, problem, f"give °C: {mean:.0f} K would be {kelvin:.0f} °C")
        raise InputError(source, problem, "give °C")
    notes = []
    # Days without light under a sun that rises are noted.
    dark = days.index[(days["extra"] > LIT_DAY) & (days["ghi"] < 0.01 * days["extra"])]
    if len(dark):
        notes.append(
            f"no light on {count_of(len(dark), 'day')}, the first {dark[0].date()}: a gap filled "
            "with zeros"
        )
    # Records of weather services have up to three days of zeros a year; more than five are refused.
    if len(dark) > 5:
        raise InputError(
            source, notes[0], "fill the gap with measured values, or give another year"
        )
    # Light in more than two nights, and unchanging light for 8 h on end, are refused.
    _check_nights(year, source)
    _check_flat(year, source)
    # More light than the cleanest air lets through.
    bright = days["clean"] > CLEAR_DAY
    brightest = (
        # The clearest 2 % of days, where enough days are bright.
        float((days["ghi"] / days["clean"])[bright].quantile(0.98))
        if bright.sum() >= FEWEST
        else 0.0
    )
    # Real records reach 1.03, over snow too: 1.06 is named, 1.15 refused.
    if brightest >= 1.06:
        notes.append(
            f"its clear days have {100 * brightest - 100:.0f} % more light than the cleanest air "
            "lets "
            "through"
        )
    if brightest > 1.15:
        raise InputError(source, notes[-1], "check unit and calibration of the irradiance")
    return notes


def cut_days(year):
    """Days in mean solar time: pandas.DataFrame.

    Columns: sums of ghi, extra (outside the atmosphere) and clean (of a very clean sky) [Wh/m²];
    middle [min], from solar noon to the middle of the light.
    """
    data, hours = year.data, year.interval / HOUR
    middle = data.index + year.interval / 2
    sine = np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0.0)
    minutes = 4 * year.longitude + pvlib.solarposition.equation_of_time_spencer71(
        middle.day_of_year
    )
    noon = (middle.hour * 60 + middle.minute + np.asarray(minutes)) % 1440 - 720
    columns = {
        "ghi": data["ghi"],
        "extra": pvlib.irradiance.get_extra_radiation(middle).to_numpy() * sine,
        # A very clean, dry sky has a Linke turbidity of 2.
        "clean": clear_sky_of(year, 2.0)["ghi"].to_numpy(),
        "moment": data["ghi"] * noon,
    }
    local = (middle + pd.Timedelta(hours=year.longitude / 15)).normalize()
    days = pd.DataFrame(columns).groupby(local).sum() * hours
    return days.assign(middle=days["moment"] / np.maximum(days["ghi"], 1e-9))


def middle_of_clear_days(days):
    """From the middle of the light to solar noon [min], median of the clearest 5 % of days; None
    for fewer than ten.

    `days` comes from `cut_days`. Neither fog of mornings nor clouds of afternoons move it.
    """
    bright = days[days["clean"] > CLEAR_DAY]
    clearness = bright["ghi"] / bright["clean"]
    clear = bright["middle"][clearness >= clearness.quantile(0.95)]
    return -float(clear.median()) if len(clear) >= 10 else None


def clear_sky_of(year, turbidity):
    """Irradiance under a clear sky in each interval, as of `clear_irradiance`."""
    data, middle = year.data, year.data.index + year.interval / 2
    return clear_irradiance(
        data["apparent_zenith"], middle, turbidity, year.altitude, data["pressure"].to_numpy()
    )


def _check_nights(year, source):
    """Refuse light at night."""
    # Below civil twilight, real records have no light; two lit nights may be faults of an
    # instrument.
    night = np.cos(np.radians(year.data["solar_zenith"].to_numpy())) < np.cos(np.radians(96.0))
    night &= np.roll(night, 1) & np.roll(night, -1)  # all of the interval
    lit = year.data.index[night & (year.data["ghi"].to_numpy() > NIGHT_LIGHT)]
    nights = (lit + pd.Timedelta(hours=year.longitude / 15 - 12)).normalize().unique()
    if len(nights) > 2:
        raise InputError(
            source,
            f"light in {len(nights)} nights, first at {lit[0]} with the sun far below the horizon",
            "fill gaps with values of the same hour, not with a mean",
        )


def _check_flat(year, source):
    """Refuse the same light for hours on end, as of gaps filled with a mean under a sun that does
    not set.
    """
    ghi = year.data["ghi"].to_numpy()
    # Real records repeat one value for less than 4 h: 8 h are a fault.
    width = int(pd.Timedelta(hours=8) / year.interval)
    changes = np.flatnonzero(np.diff(ghi)) + 1
    starts, ends = np.append(0, changes), np.append(changes, len(ghi))
    flat = np.flatnonzero((ends - starts >= width) & (ghi[starts] > NIGHT_LIGHT))
    if len(flat):
        first = starts[flat[0]]
        hours = (ends[flat[0]] - first) * (year.interval / HOUR)
        problem = f"{year.columns['ghi']} is {ghi[first]:.0f} Wm⁻² for {hours:.0f} h on end"
        raise InputError(
            source, f"{problem}, from {year.data.index[first]}", "fill the gap with measured values"
        )


def check_sums(year, source):
    """Refuse irradiance that is a sum since a time of day, as reanalyses deliver it: it falls but
    once a day.
    """
    ghi = year.data["ghi"].to_numpy()
    rises, falls = np.diff(ghi) > 0, np.diff(ghi) < 0
    changes = rises.sum() + falls.sum()
    # Real light falls in nearly half of all steps; sums do so in one of some seven to fourteen.
    if changes and falls.sum() < 0.2 * changes:
        begins = year.data.index[1:][falls]
        usual = (begins.hour * 60 + begins.minute).to_series().mode().iloc[0]
        raise InputError(
            source,
            f"{year.columns['ghi']} rises all day and falls at {usual // 60}:{usual % 60:02d} UTC",
            f"these are sums since {usual // 60}:{usual % 60:02d} UTC: give the differences from "
            "hour to hour",
        )


def check_summer_time(days, source):
    """Refuse times that stand otherwise in summer than in winter."""
    month, lit = days.index.month, days["ghi"] > LIT_DAY / 3
    northern = days["middle"][month.isin([5, 6, 7, 8, 9]) & lit]
    southern = days["middle"][month.isin([11, 12, 1, 2]) & lit]
    # With 15 days of each half-year its median is known to some 9 minutes.
    if min(len(northern), len(southern)) < 15:
        return
    moved = float(northern.median() - southern.median())
    # The middle of the light moves from winter to summer by −8 to +12 minutes; a change of the
    # clock, by 60.
    if abs(moved) > 35.0:
        when = "May to September" if moved > 0 else "November to February"
        raise InputError(
            source,
            f"light comes {abs(moved):.0f} min later from {when} than in the other half-year: "
            "summer time",
            "give times without summer time; --time-shift cannot mend it",
        )


def check_diffuse(year, source):
    """Refuse global irradiance in place of DHI."""
    data = year.data
    # Hours of strong DNI from a sun above 20°.
    strong = (data["dni"] > STRONG) & (
        np.cos(np.radians(data["apparent_zenith"])) > np.sin(np.radians(20.0))
    )
    if strong.sum() <= FEWEST:
        return
    share = float((data["dhi"] / data["ghi"])[strong].median())
    # The share's median is 0.13 to 0.25 in real records.
    if share > 0.45:
        raise InputError(
            source,
            f"{100 * share:.0f} % of the light is diffuse where {year.columns['dni']} is above "
            f"{STRONG:.0f} Wm⁻²",
            f"check {year.columns['dhi']}: it may be GHI",
        )


def check_direct(year, source):
    """Refuse the horizontal part of direct light in place of DNI."""
    data = year.data
    sine = np.maximum(np.cos(np.radians(data["apparent_zenith"].to_numpy())), 0.0)
    middle = data.index + year.interval / 2
    turbidity = pvlib.clearsky.lookup_linke_turbidity(middle, year.latitude, year.longitude)
    ratio = data["dni"].to_numpy() / np.maximum(
        clear_sky_of(year, turbidity)["dni"].to_numpy(), 1.0
    )
    low = (sine > LOW_SUN[0]) & (sine < LOW_SUN[1])
    high = sine > max(np.quantile(sine[sine > 0], 0.85), LOW_SUN[1])
    if min(low.sum(), high.sum()) < FEWEST:
        return
    below, above = (float(np.quantile(ratio[chosen], 0.9)) for chosen in (low, high))
    # Real records have at least 0.60 times as much.
    if below < 0.5 * above:
        light = f"{below:.2f} of a clear sky's under a low sun, {above:.2f} under a high one"
        raise InputError(
            source,
            f"{year.columns['dni']} of clear hours is {light}",
            "check this column: it may be the direct light on a horizontal plane",
        )


DARKEST_YEAR, BRIGHTEST_YEAR = 0.2, 0.85  # of a year: GHI per irradiation outside of the atmosphere
NO_FACTOR = (0.6, 1.7)  # for ratios in this range the unit is right
NEAR = 1.3  # a known factor is suggested if it explains the values to within this ratio


def check_irradiance(year, source):
    """Refuse irradiance beyond physical limits, years too dark or bright, and direct light from
    overcast skies.

    Parameters
    ----------
    year : Weather
        Complete, with the sun.
    source : str
        The file and the year, for messages.

    Raises
    ------
    InputError
        If more than 1 % of the daytime values exceed BSRN's physically possible limits, or the
        year's clearness does not lie between 0.2 and 0.85 (with the factor that would fit); or,
        under skies with a clearness below 0.25, less than 0.6 of the light is diffuse.

    References
    ----------
    C. N. Long, Y. Shi (2008), An automated quality assessment and control algorithm for surface
    radiation measurements, The Open Atmospheric Science Journal 2, 23-37,
    :doi:`10.2174/1874282300802010023`. D. G. Erbs et al. (1982),
    :doi:`10.1016/0038-092X(82)90302-4`: with a clearness below 0.22 the diffuse fraction is at
    least 0.98.
    """
    # The sun in the middle and at both ends of each interval; the highest of the three counts.
    data, interval = year.data, year.interval
    middle = data.index + interval / 2
    sun, half = (
        sun_direction(data["solar_zenith"].to_numpy(), data["solar_azimuth"].to_numpy()),
        interval / MINUTE / 2,
    )
    cos_zenith, *ends = (
        cos_zenith_after(sun, year.latitude, shift) for shift in (0.0, -half, half)
    )
    highest = np.maximum(cos_zenith, np.maximum(*ends))
    # (t,) [Wm⁻²]
    normal = np.asarray(
        # The solar constant [Wm⁻²].
        pvlib.irradiance.get_extra_radiation(middle.day_of_year, 1361.0)
    )
    # GHI and DHI, against the highest sun of the interval: no more than a factor times the sun's
    # light outside the atmosphere, by a power of its height (Long and Shi). The year's sum and
    # overcast skies, further below, go by the sun in the middle.
    ghi, outside, day = data["ghi"].to_numpy(), normal * cos_zenith, highest > 0
    # Physically possible limits of BSRN, a S cos(z)^b + c: factor a, exponent b, offset c.
    limits = {"ghi": (1.5, 1.2, 100.0), "dhi": (0.95, 1.2, 50.0)}
    for name, (factor, exponent, offset) in limits.items():
        above = (data[name].to_numpy() > factor * normal * highest**exponent + offset) & day
        # Cloud edges exceed the limits for minutes: at most 1 % of daytime values may.
        if above.sum() > 0.01 * max(day.sum(), 1):
            limit = f"{factor:g} S cos(z)^{exponent:g} + {offset:g} Wm⁻²"
            share = 100 * above.sum() / day.sum()
            problem = (
                f"{share:.0f} % of daytime {year.columns[name]} exceeds what is physically "
                f"possible ({limit})"
            )
            raise InputError(source, problem, _cure_of_factor(ghi, highest, interval))
    # The whole year against what arrives outside the atmosphere: its clearness.
    found, most = (values.sum() * (interval / HOUR) / 1000.0 for values in (ghi, outside))
    if most and not DARKEST_YEAR <= found / most <= BRIGHTEST_YEAR:
        plausible = f"{DARKEST_YEAR * most:.0f} to {BRIGHTEST_YEAR * most:.0f}"
        problem = (
            f"{found:.3g} kWh/m² of {year.columns['ghi']} per year; at this latitude {plausible} "
            "are plausible"
        )
        raise InputError(source, problem, _cure_of_factor(ghi, cos_zenith, interval))
    # A direct column that contains GHI gives one half under skies whose diffuse fraction is at
    # least 0.98.
    # Overcast is a clearness below 0.25 with the sun above 10°.
    dull = (cos_zenith > np.sin(np.radians(10.0))) & (ghi < 0.25 * outside) & (ghi > 0)
    # The check needs 24 overcast hours.
    if dull.sum() * (interval / HOUR) >= 24:
        share = float(np.median(data["dhi"].to_numpy()[dull] / ghi[dull]))
        # The median share of diffuse light under an overcast sky is near 1.
        if share < 0.6:
            problem = (
                f"under overcast skies only {100 * share:.0f} % of the light is diffuse, but "
                "nearly all should be"
            )
            raise InputError(
                source, problem, "check the direct column: it may contain global irradiance"
            )


def check_given(given, year, source):
    """Refuse columns that are 0 in a year in which others show light, and a year without any direct
    light.

    Parameters
    ----------
    given : pandas.DataFrame
        Columns ghi, dhi and dni as far as the file has them [Wm⁻²].
    year : Weather
        Made of them.
    source : str
        The file and the year, for messages.

    Raises
    ------
    InputError
    """
    lit = [name for name in given if given[name].any()]
    dark = [name for name in given if name not in lit]
    if lit and dark:
        enough = (
            f"leave it out with --weather-without {dark[0]}"
            if len(lit) > 1
            else "give a file that has it"
        )
        shining = " and ".join(year.columns[name] for name in lit)
        raise InputError(source, f"{year.columns[dark[0]]} is 0 all year, {shining} not", enough)
    if lit and not year.data["dni"].any():
        raise InputError(
            source,
            f"no direct light all year: {year.columns['dhi']} is never less than "
            f"{year.columns['ghi']}",
            "check these columns",
        )


def _cure_of_factor(ghi, cos_zenith, interval, *, quantile=0.99):
    """Cure that names the factor with which GHI would be plausible, and the wrong unit that it
    results from.
    """
    day = cos_zenith > 0
    # This quantile of daytime GHI is compared with the clear sky to find a factor.
    bright = float(np.quantile(ghi[day], quantile)) if day.any() else 0.0
    if not bright > 0:
        return "give a file with irradiance"
    wanted = float(np.quantile(haurwitz(cos_zenith[day]), quantile)) / bright
    if NO_FACTOR[0] < wanted < NO_FACTOR[1]:
        return "check the place and the times of the weather"
    return name_factor(wanted, interval)


def name_factor(wanted, interval):
    """Cure for values that a factor would mend: the wrong unit that it results from, where one is
    near.
    """
    seconds = interval.total_seconds()
    factors = {
        1000.0: "they look like kWm⁻²",
        1e-3: "they look like mWm⁻²",
        seconds: "they look like Wm⁻² that were read as Jm⁻² (units are missing or wrong)",
        1 / seconds: "they look like Jm⁻² per interval",
        1e3 / seconds: "they look like kJm⁻² per interval",
        1e6 / seconds: "they look like MJm⁻² per interval",
        1e4 / seconds: "they look like J/cm² per interval",
        11356.5 / seconds: "they look like BTU/ft² per interval",
        41868.0 / seconds: "they look like cal/cm² per interval",
    }
    if interval < HOUR:
        factors[HOUR / interval] = (
            "they look like energy per interval that was read as energy per hour"
        )
        factors[interval / HOUR] = "they look like hourly sums repeated in every interval"
    # The unit whose factor is nearest, if it is near enough.
    nearest = min(factors, key=lambda factor: abs(np.log(factor / wanted)))
    if abs(np.log(nearest / wanted)) > np.log(NEAR):
        return f"check the unit; values times {wanted:.2g} would fit"
    number = f"{nearest:g}" if nearest >= 1 else f"1/{1 / nearest:g}"
    return f"values times {number} would fit: {factors[nearest]}"
