"""Refuse impossible irradiance: wrong unit, wrong time step, or a column with another quantity."""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from .check_sun_times import haurwitz, sun_track

HOUR = pd.Timedelta(hours=1)
SOLAR_CONSTANT = 1361.0  # [Wm⁻²]

# Physically possible limits of BSRN, a S cos(z)^b + c: factor a, exponent b, offset c.
POSSIBLE = {"ghi": (1.5, 1.2, 100.0), "dhi": (0.95, 1.2, 50.0)}
MOST_ABOVE = 0.01  # share of daytime values that may exceed them, as cloud edges do for minutes
LEAST_CLEARNESS, MOST_CLEARNESS = 0.2, 0.85  # of a year: GHI per irradiation outside of the atmosphere
BRIGHT = 0.99  # quantile of daytime GHI that is compared with the clear sky to find a factor
NO_FACTOR = (0.6, 1.7)  # for ratios in this range the unit is right
NEAR = 1.3  # a known factor is suggested if it explains the values to within this ratio
OVERCAST, HIGH = 0.25, np.sin(np.radians(10.0))  # clearness below, and sine of elevation above which it is overcast
LEAST_DIFFUSE = 0.6  # share of diffuse light under an overcast sky, median
FEWEST_DULL = 24  # overcast hours needed for the check


def check_irradiance(year, source):
    """Refuse irradiance beyond physical limits, years too dark or bright, and direct light from overcast skies.

    Parameters
    ----------
    year : Weather
        Complete, with the sun.
    source : str
        The file and the year, for messages.

    Raises
    ------
    InputError
        If more than 1 % of the daytime values exceed BSRN's physically possible limits, or the year's clearness does
        not lie between 0.2 and 0.85 (with the factor that would fit); or, under skies with a clearness below 0.25, less
        than 0.6 of the light is diffuse.

    References
    ----------
    C. N. Long, Y. Shi (2008), An automated quality assessment and control algorithm for surface radiation measurements,
    The Open Atmospheric Science Journal 2, 23-37, :doi:`10.2174/1874282300802010023`. D. G. Erbs et al. (1982),
    :doi:`10.1016/0038-092X(82)90302-4`: with a clearness below 0.22 the diffuse fraction is at least 0.98.
    """
    data, interval = year.data, year.interval
    middle = data.index + interval / 2
    track = sun_track(middle, year.latitude, year.longitude)
    cos_zenith = track.cos_zenith()
    half = interval / pd.Timedelta(minutes=2)
    highest = np.maximum(cos_zenith, np.maximum(track.cos_zenith(-half), track.cos_zenith(half)))
    normal = np.asarray(pvlib.irradiance.get_extra_radiation(middle.day_of_year, SOLAR_CONSTANT))  # (t,) [Wm⁻²]
    ghi, outside, day = data["ghi"].to_numpy(), normal * cos_zenith, highest > 0
    for name, (factor, exponent, offset) in POSSIBLE.items():
        above = (data[name].to_numpy() > factor * normal * highest**exponent + offset) & day
        if above.sum() > MOST_ABOVE * max(day.sum(), 1):
            limit = f"{factor:g} S cos(z)^{exponent:g} + {offset:g} Wm⁻²"
            share = 100 * above.sum() / day.sum()
            problem = f"{share:.0f} % of daytime {year.columns[name]} exceeds what is physically possible ({limit})"
            raise InputError(source, problem, cure_of_factor(ghi, highest, interval))
    found, most = (values.sum() * (interval / HOUR) / 1000.0 for values in (ghi, outside))
    if most and not LEAST_CLEARNESS <= found / most <= MOST_CLEARNESS:
        plausible = f"{LEAST_CLEARNESS * most:.0f} to {MOST_CLEARNESS * most:.0f}"
        problem = f"{found:.3g} kWh/m² of {year.columns['ghi']} per year; at this latitude {plausible} are plausible"
        raise InputError(source, problem, cure_of_factor(ghi, cos_zenith, interval))
    # A direct column that contains GHI gives one half under skies whose diffuse fraction is at least 0.98.
    dull = (cos_zenith > HIGH) & (ghi < OVERCAST * outside) & (ghi > 0)
    if dull.sum() * (interval / HOUR) >= FEWEST_DULL:
        share = float(np.median(data["dhi"].to_numpy()[dull] / ghi[dull]))
        if share < LEAST_DIFFUSE:
            problem = f"under overcast skies only {100 * share:.0f} % of the light is diffuse, but nearly all should be"
            raise InputError(source, problem, "check the direct column: it may contain global irradiance")


def check_given(given, year, source):
    """Refuse columns that are 0 in a year in which others show light, and a year without any direct light.

    Parameters
    ----------
    given : pandas.DataFrame
        Those of ghi, dhi and dni that the file has [Wm⁻²].
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
        enough = f"leave it out with --weather-without {dark[0]}" if len(lit) > 1 else "give a file that has it"
        shining = " and ".join(year.columns[name] for name in lit)
        raise InputError(source, f"{year.columns[dark[0]]} is 0 all year, {shining} not", enough)
    if lit and not year.data["dni"].any():
        problem = f"no direct light all year: {year.columns['dhi']} is never less than {year.columns['ghi']}"
        raise InputError(source, problem, "check these columns")


def cure_of_factor(ghi, cos_zenith, interval):
    """Cure that names the factor with which GHI would be plausible, and the wrong unit that it results from."""
    day = cos_zenith > 0
    bright = float(np.quantile(ghi[day], BRIGHT)) if day.any() else 0.0
    if not bright > 0:
        return "give a file with irradiance"
    wanted = float(np.quantile(haurwitz(cos_zenith[day]), BRIGHT)) / bright
    if NO_FACTOR[0] < wanted < NO_FACTOR[1]:
        return "check the place and the times of the weather"
    seconds = interval.total_seconds()
    factors = {
        1000.0: "they look like kWm⁻²",
        1e-3: "they look like mWm⁻²",
        seconds: "they look like Wm⁻² that were read as Jm⁻² (units are missing or wrong)",
        1 / seconds: "they look like Jm⁻² per interval",
        1e3 / seconds: "they look like kJm⁻² per interval",
        1e6 / seconds: "they look like MJm⁻² per interval",
        41868.0 / seconds: "they look like cal/cm² per interval",
    }
    if interval < HOUR:
        factors[HOUR / interval] = "they look like energy per interval that was read as energy per hour"
        factors[interval / HOUR] = "they look like hourly sums repeated in every interval"
    nearest = min(factors, key=lambda factor: abs(np.log(factor / wanted)))
    if abs(np.log(nearest / wanted)) > np.log(NEAR):
        return f"check the unit; values times {wanted:.2g} would fit"
    number = f"{nearest:g}" if nearest >= 1 else f"1/{1 / nearest:g}"
    return f"values times {number} would fit: {factors[nearest]}"
