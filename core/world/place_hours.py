"""The lit hours of one place: sun, weather and grid directions, as the loop over surfaces needs them."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pvlib

from ..energy.power import HALF, MIDDLE, spectral_factor
from ..results.write_groups import split_hours
from ..sun.sky_models import split_sky
from ..sun.solar_position import local_middle, sun_direction

MONTHS, HOURS = 12, 24
SINGLE = np.float32


@dataclass
class PlaceHours:
    """The h intervals of a place with any light."""

    interval: np.ndarray  # (h,) int, index into the weather's time axis
    direction: np.ndarray  # (h, 3) float64, towards the sun at mid-interval
    light: np.ndarray  # (h, 2 + k) float32: from the sun's place (normal), the dome, and k traced sources [Wm⁻²]
    dni: np.ndarray  # (h,) [Wm⁻²]
    ground: np.ndarray  # (h,) [Wm⁻²] of unshaded ground by circumsolar light
    caps: np.ndarray  # (k,) of `SkyParts`
    heating: np.ndarray  # (h, 2) float32: cell temperature per POA irradiance, and without any; both on -1 to 1
    spectral_factor: np.ndarray  # (h,) float32
    month: np.ndarray  # (h,) int, 0 to 11, UTC, of mid-interval
    hour: np.ndarray  # (h,) int, of the day, UTC, of mid-interval
    solar_hours: list  # of (hour (h,) int, share (h,)): hours of local mean solar time that each overlaps
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
        Model of the diffuse sky, of `sky_models.MODELS`.

    Returns
    -------
    PlaceHours
    """
    data, interval = weather.data, weather.interval
    lit = np.flatnonzero((data["ghi"].to_numpy() > 0) | (data["dni"].to_numpy() > 0))
    column = {name: data[name].to_numpy(float)[lit] for name in data}
    parts = split_sky(weather, sky)
    relative = pvlib.atmosphere.get_relative_airmass(column["apparent_zenith"], "kastenyoung1989")
    airmass = pvlib.atmosphere.get_absolute_airmass(relative, column["pressure"])
    # The thermal model is linear in the irradiance: 1 Wm⁻² in air of 0 °C gives the slope.
    slope = pvlib.temperature.sapm_cell(1.0, 0.0, column["wind_speed"], **system.thermal)
    times = data.index[lit]
    middle = times.tz_convert("UTC") + interval / 2
    begin = local_middle(times, interval, weather.longitude) - interval / 2
    return PlaceHours(
        interval=lit,
        direction=sun_direction(column["apparent_zenith"], column["solar_azimuth"]),
        light=np.stack(
            [column["dni"] + parts.circumsolar[lit], parts.dome[lit], *parts.of_sources[lit].T], axis=1
        ).astype(SINGLE),
        dni=column["dni"],
        ground=parts.circumsolar_horizontal[lit],
        caps=parts.caps,
        heating=np.stack([slope / HALF, (column["temp_air"] - MIDDLE) / HALF], axis=1).astype(SINGLE),
        spectral_factor=spectral_factor(airmass, system).astype(SINGLE),
        month=middle.month.to_numpy() - 1,
        hour=middle.hour.to_numpy(),
        solar_hours=split_hours(begin, interval),
        length=interval / pd.Timedelta(hours=1) / years,
    )


def sum_periods(capacity_factor, hours):
    """Full load hours of the year, its months, hours of the day (UTC) and hours of local mean solar time.

    Parameters
    ----------
    capacity_factor : numpy.ndarray, (h, k)
    hours : PlaceHours

    Returns
    -------
    numpy.ndarray, (61, k)
        [h] per year: annual, 12 months, 24 hours, 24 solar hours.
    """
    rows = np.arange(len(capacity_factor))
    share = np.zeros((1 + MONTHS + 2 * HOURS, len(rows)))
    share[0] = 1.0
    share[1 + hours.month, rows] = 1.0
    share[1 + MONTHS + hours.hour, rows] = 1.0
    for hour, part in hours.solar_hours:
        share[1 + MONTHS + HOURS + hour, rows] += part
    return hours.length * (share @ capacity_factor)
