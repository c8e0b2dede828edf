"""Faults of a year that no single value shows: gaps filled with numbers, wrong columns, a factor, summer time.

Each check rests on what sun and air allow, and the closest that real records come to its limit stands beside it.
"""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from ..sun.sky_models import clear_irradiance

DAY, HOUR = pd.Timedelta(days=1), pd.Timedelta(hours=1)

# Days on which the sun would give this [Wh/m²] outside the atmosphere have light: of 23 years of 17 real records the
# darkest had a clearness of 0.028. Up to three days of zeros a year are in records of weather services.
LIT_DAY, LEAST_CLEARNESS, MOST_DARK_DAYS = 1500.0, 0.01, 5
# Light [Wm⁻²] while the sun is below civil twilight; none in real records.
TWILIGHT, NIGHT_LIGHT, MOST_LIT_NIGHTS = np.cos(np.radians(96.0)), 5.0, 2
FLAT = pd.Timedelta(hours=8)  # of the same light; in real records less than 4 h
# Daily GHI over that of a very clean, dry sky, of the clearest 2 % of days: 0.87 to 1.03, over snow too.
CLEAN_TURBIDITY, CLEAR_DAY, CLEAREST, NAMED_BRIGHT, REFUSED_BRIGHT = 2.0, 2000.0, 0.98, 1.06, 1.15
# Share of DHI in GHI while DNI is strong, median: 0.13 to 0.25.
HIGH_SUN, STRONG, MOST_DIFFUSE, FEWEST = np.sin(np.radians(20.0)), 600.0, 0.45, 50
# DNI of the clearest tenth over that of a clear sky: under a low sun 0.60 to 1.6 times that under a high one.
LOW_SUN, LEAST_LOW = np.sin(np.radians([12.0, 20.0])), 0.5
# Minutes by which the middle of the light moves from winter to summer: −8 to +12.
SUMMER_TIME, FEWEST_DAYS = 35.0, 15  # of each half-year, whose median is then known to some 9 min
# Mean air temperature of a year [°C] by latitude [°], 4 K above the warmest places (Dallol, Ahvaz, Athens, Scilly,
# Shetland, the Norwegian coast, Svalbard).
LEAST_SPREAD = 1.0  # [K] standard deviation over a year; tables that are made up may have one temperature
WARMEST = (0, 25, 30, 40, 50, 60, 70, 80, 90), (39, 39, 32, 25, 17, 13, 8, 0, -8)


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
    check_temperature(year.data["temp_air"], year.latitude, source)
    notes = check_dark_days(days, source)
    check_nights(year, source)
    check_flat(year, source)
    check_direct(year, source)
    return notes + check_brightness(days, source)


def cut_days(year):
    """Days in mean solar time: pandas.DataFrame.

    Columns: sums of ghi, extra (outside the atmosphere) and clean (of a very clean sky) [Wh/m²]; middle [min], from
    solar noon to the middle of the light.
    """
    data, hours = year.data, year.interval / HOUR
    middle = data.index + year.interval / 2
    sine = np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0.0)
    minutes = 4 * year.longitude + pvlib.solarposition.equation_of_time_spencer71(middle.day_of_year)
    noon = (middle.hour * 60 + middle.minute + np.asarray(minutes)) % 1440 - 720
    columns = {
        "ghi": data["ghi"],
        "extra": pvlib.irradiance.get_extra_radiation(middle).to_numpy() * sine,
        "clean": clear_sky_of(year, CLEAN_TURBIDITY)["ghi"].to_numpy(),
        "moment": data["ghi"] * noon,
    }
    local = (middle + pd.Timedelta(hours=year.longitude / 15)).normalize()
    days = pd.DataFrame(columns).groupby(local).sum() * hours
    return days.assign(middle=days["moment"] / np.maximum(days["ghi"], 1e-9))


def clear_sky_of(year, turbidity):
    """Irradiance under a clear sky in each interval, as of `clear_irradiance`."""
    data, middle = year.data, year.data.index + year.interval / 2
    return clear_irradiance(data["apparent_zenith"], middle, turbidity, year.altitude, data["pressure"].to_numpy())


def check_dark_days(days, source):
    """Refuse, or note, days without light under a sun that rises."""
    dark = days.index[(days["extra"] > LIT_DAY) & (days["ghi"] < LEAST_CLEARNESS * days["extra"])]
    if not len(dark):
        return []
    count = f"{len(dark)} day{'s' if len(dark) > 1 else ''}"
    problem = f"no light on {count}, the first {dark[0].date()}: a gap filled with zeros"
    if len(dark) > MOST_DARK_DAYS:
        raise InputError(source, problem, "fill the gap with measured values, or give another year")
    return [problem]


def check_nights(year, source):
    """Refuse light at night."""
    night = np.cos(np.radians(year.data["solar_zenith"].to_numpy())) < TWILIGHT
    night &= np.roll(night, 1) & np.roll(night, -1)  # all of the interval
    lit = year.data.index[night & (year.data["ghi"].to_numpy() > NIGHT_LIGHT)]
    nights = (lit + pd.Timedelta(hours=year.longitude / 15 - 12)).normalize().unique()
    if len(nights) > MOST_LIT_NIGHTS:
        problem = f"light in {len(nights)} nights, first at {lit[0]} with the sun far below the horizon"
        raise InputError(source, problem, "fill gaps with values of the same hour, not with a mean")


def check_flat(year, source):
    """Refuse the same light for hours on end, as of gaps filled with a mean under a sun that does not set."""
    ghi = year.data["ghi"].to_numpy()
    width = int(FLAT / year.interval)
    changes = np.flatnonzero(np.diff(ghi)) + 1
    starts, ends = np.append(0, changes), np.append(changes, len(ghi))
    flat = np.flatnonzero((ends - starts >= width) & (ghi[starts] > NIGHT_LIGHT))
    if len(flat):
        first = starts[flat[0]]
        hours = (ends[flat[0]] - first) * (year.interval / HOUR)
        problem = f"{year.columns['ghi']} is {ghi[first]:.0f} Wm⁻² for {hours:.0f} h on end"
        raise InputError(source, f"{problem}, from {year.data.index[first]}", "fill the gap with measured values")


def check_summer_time(days, source):
    """Refuse times that stand otherwise in summer than in winter."""
    month, lit = days.index.month, days["ghi"] > LIT_DAY / 3
    northern = days["middle"][month.isin([5, 6, 7, 8, 9]) & lit]
    southern = days["middle"][month.isin([11, 12, 1, 2]) & lit]
    if min(len(northern), len(southern)) < FEWEST_DAYS:
        return
    moved = float(northern.median() - southern.median())
    if abs(moved) > SUMMER_TIME:
        when = "May to September" if moved > 0 else "November to February"
        problem = f"light comes {abs(moved):.0f} min later from {when} than in the other half-year: summer time"
        raise InputError(source, problem, "give times without summer time; --time-shift cannot mend it")


def check_diffuse(year, source):
    """Refuse global irradiance in place of DHI."""
    data = year.data
    strong = (data["dni"] > STRONG) & (np.cos(np.radians(data["apparent_zenith"])) > HIGH_SUN)
    if strong.sum() <= FEWEST:
        return
    share = float((data["dhi"] / data["ghi"])[strong].median())
    if share > MOST_DIFFUSE:
        problem = f"{100 * share:.0f} % of the light is diffuse where {year.columns['dni']} is above {STRONG:.0f} Wm⁻²"
        raise InputError(source, problem, f"check {year.columns['dhi']}: it may be GHI")


def check_direct(year, source):
    """Refuse the horizontal part of direct light in place of DNI."""
    data = year.data
    sine = np.maximum(np.cos(np.radians(data["apparent_zenith"].to_numpy())), 0.0)
    middle = data.index + year.interval / 2
    turbidity = pvlib.clearsky.lookup_linke_turbidity(middle, year.latitude, year.longitude)
    ratio = data["dni"].to_numpy() / np.maximum(clear_sky_of(year, turbidity)["dni"].to_numpy(), 1.0)
    low = (sine > LOW_SUN[0]) & (sine < LOW_SUN[1])
    high = sine > max(np.quantile(sine[sine > 0], 0.85), LOW_SUN[1])
    if min(low.sum(), high.sum()) < FEWEST:
        return
    below, above = (float(np.quantile(ratio[chosen], 0.9)) for chosen in (low, high))
    if below < LEAST_LOW * above:
        problem = f"{below:.2f} of a clear sky's under a low sun, {above:.2f} under a high one"
        problem = f"{year.columns['dni']} of clear hours is {problem}"
        raise InputError(source, problem, "check this column: it may be the direct light on a horizontal plane")


def check_brightness(days, source):
    """Refuse, or note, more light than the cleanest air lets through."""
    bright = days["clean"] > CLEAR_DAY
    if bright.sum() < FEWEST:
        return []
    found = float((days["ghi"] / days["clean"])[bright].quantile(CLEAREST))
    if found < NAMED_BRIGHT:
        return []
    problem = f"its clear days have {100 * found - 100:.0f} % more light than the cleanest air lets through"
    if found > REFUSED_BRIGHT:
        raise InputError(source, problem, "check unit and calibration of the irradiance")
    return [problem]


def check_temperature(temp_air, latitude, source):
    """Refuse a mean air temperature that no place of the latitude has."""
    mean, most = float(temp_air.mean()), float(np.interp(abs(latitude), *WARMEST))
    if mean > most and temp_air.std() > LEAST_SPREAD:
        problem = (
            f"the mean air temperature is {mean:.0f} °C, above {most:.0f}, which no place at {latitude:.0f}° exceeds"
        )
        cure = f"give °C: {mean:.0f} °F would be {(mean - 32) / 1.8:.0f} °C"
        raise InputError(source, problem, cure)
