"""The lit hours of one place, as the loop over surfaces needs them: sun, weather, and the
directions of the sky grid that stand for the sun, exactly or as in the paper (section 2.4).
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..energy.power import conditions_of_modules
from ..results.write_tables import share_periods
from ..sky.sky_models import split_sky
from ..sun import solar_position
from .sum_groups import Sunlight

MONTHS, HOURS = 12, 24  # of `PlaceHours.share`, behind the year; hours twice
SINGLE = np.float32


@dataclass
class _PlaceHours:
    """The h intervals of a place with any light."""

    interval: np.ndarray  # (h,) int, index into the weather's time axis
    direction: np.ndarray  # (h, 3) float64, towards the sun at mid-interval
    # (h, 2 + k) float32: from the sun's place (normal), the dome, and k traced sources [Wm⁻²]
    light: np.ndarray
    dni: np.ndarray  # (h,) [Wm⁻²]
    ground: np.ndarray  # (h,) [Wm⁻²] of unshaded ground by circumsolar light
    caps: np.ndarray  # (k,) of `SkyParts`
    # two (h,): cell temperature without irradiance [°C], and per irradiance on the plane [Km²W⁻¹]
    heating: tuple
    spectral_factor: np.ndarray  # (h,) float32
    # (61, h) of `share_periods`: year, months, hours of the day (UTC) and of local mean solar time
    share: np.ndarray
    length: float  # of an interval, over the number of years [h]


def prepare_place(weather, system, years, sky="isotropic"):
    """Lit hours of a place.

    Parameters
    ----------
    weather : Weather
    system : PvSystem
    years : float
        Number of years that the weather covers.
    sky : str
        Model of the diffuse sky, of `settings.request.SKIES`.

    Returns
    -------
    PlaceHours
    """
    data, interval = weather.data, weather.interval
    lit = np.flatnonzero((data["ghi"].to_numpy() > 0) | (data["dni"].to_numpy() > 0))
    column = {name: data[name].to_numpy(float)[lit] for name in data}
    parts = split_sky(weather, sky)
    spectral, dark, slope = conditions_of_modules(data.iloc[lit], system)
    return _PlaceHours(
        interval=lit,
        direction=solar_position.sun_direction(column["apparent_zenith"], column["solar_azimuth"]),
        light=np.stack(
            [column["dni"] + parts.circumsolar[lit], parts.dome[lit], *parts.of_sources[lit].T],
            axis=1,
        ).astype(SINGLE),
        dni=column["dni"],
        ground=parts.circumsolar_horizontal[lit],
        caps=parts.caps,
        heating=(dark, slope[:, 0]),
        spectral_factor=spectral.astype(SINGLE),
        share=share_periods(data.index[lit], interval, weather.longitude),
        length=interval / pd.Timedelta(hours=1) / years,
    )


def match_hours(sky, hours):
    """The three grid directions around the place's own sun.

    Hours without direct light, or with the sun below the horizon, have weights of zero.

    Parameters
    ----------
    sky : SkyTriangles
    hours : PlaceHours

    Returns
    -------
    Sunlight
        Of one sun.
    """
    bright = (hours.light[:, 0] > 0) & (hours.direction[:, 2] >= 0)
    index, weight = _match_some(sky, hours.direction, bright)
    level = hours.dni * np.maximum(hours.direction[:, 2], 0.0) + hours.ground
    return Sunlight(
        index[:, None],
        weight[:, None],
        hours.direction[:, None].astype(SINGLE),
        level.astype(SINGLE),
    )


def match_shifted(sky, hours, weather):
    """Suns of Greenwich at the nearest whole degree of latitude, shifted in time (paper, section
    2.4 and Fig. 3).

    What each surface gets relative to DNI is taken at Greenwich, longitude/15 hours later, from a
    parabola through the three nearest intervals. Below 2° of elevation it is zero there. The year
    is cyclic.

    Parameters
    ----------
    sky : SkyTriangles
    hours : PlaceHours
    weather : Weather
        Of the place.

    Returns
    -------
    Sunlight
        Of three suns.
    """
    sun = solar_position.geocentric_sun(weather.data.index, weather.interval)
    greenwich = solar_position.sun_of_place(sun, float(np.round(weather.latitude)), 0.0)
    direction = solar_position.sun_direction(
        greenwich["apparent_zenith"], greenwich["solar_azimuth"]
    )
    index, weight = _match_some(
        sky, direction, solar_position.is_sunny(greenwich["apparent_zenith"])
    )
    step = (sun.times[1] - sun.times[0]) / pd.Timedelta(hours=1)
    later = weather.longitude / 15.0 / step
    middle = int(np.floor(later + 0.5))
    nodes = (hours.interval[:, None] + middle + np.array([-1, 0, 1])) % len(direction)  # (h, 3)
    place = later - middle  # between -0.5 and 0.5
    # parabola through -1, 0 and 1
    share = np.array([place * (place - 1) / 2, 1 - place**2, place * (place + 1) / 2])
    suns = direction[nodes]
    used = share * weight[nodes].any(axis=2)  # suns that are too low have no light
    level = hours.dni * (used * np.maximum(suns[:, :, 2], 0.0)).sum(axis=1) + hours.ground
    shares = (weight[nodes] * share[:, None]).astype(SINGLE)
    return Sunlight(index[nodes], shares, suns.astype(SINGLE), level.astype(SINGLE))


def _match_some(sky, direction, chosen):
    """Grid directions around some suns, index and weight 0 for the others: (t, 3) int64, (t, 3)
    float32.
    """
    index, weight = np.zeros((len(direction), 3), np.int64), np.zeros((len(direction), 3), SINGLE)
    index[chosen], weight[chosen] = sky.match(direction[chosen])
    return index, weight
