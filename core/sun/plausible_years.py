"""Clear and overcast years: what a city may be lit by besides the year of its weather.

What of the light is reflected often depends on where it comes from. A wall to the north gets next to nothing of a clear
sky's sun at first, a court more of an overcast sky than of low suns; the years between lie between.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pvlib

from .sky_models import split_sky
from .terrain_loss import SunlitYear, sunlit_year

OVERCAST = 0.25  # irradiance below a closed cover of clouds over that of a clear sky
HOURS = 8760  # by which suns are counted
MEAN_DISTANCE = pd.Timestamp("2021-04-04", tz="UTC")  # a day at which the sun is as far as on average
TURBIDITY = 3.0  # Linke's, where no place is known: about the mean over land


def clear_irradiance(zenith, middle, place, altitude, pressure):
    """Irradiance under a clear sky.

    Parameters
    ----------
    zenith : (t,) float64
        Apparent zenith angle [°].
    middle : pandas.DatetimeIndex, (t,)
    place : tuple of two float, or None
        Latitude and longitude [°], for pvlib's monthly Linke turbidity.
    altitude : float
        [m]
    pressure : float or (t,) float64
        Of the air [Pa].

    Returns
    -------
    pandas.DataFrame
        Columns ghi, dhi and dni [Wm⁻²], indexed by `middle`.

    References
    ----------
    P. Ineichen, R. Perez (2002), A new airmass independent formulation for the Linke turbidity coefficient.
    :doi:`10.1016/S0038-092X(02)00045-2`
    """
    angle = pd.Series(np.asarray(zenith, float), index=middle)
    airmass = pvlib.atmosphere.get_absolute_airmass(pvlib.atmosphere.get_relative_airmass(angle), pressure)
    turbidity = TURBIDITY if place is None else pvlib.clearsky.lookup_linke_turbidity(middle, *place)
    extra = pvlib.irradiance.get_extra_radiation(middle)
    sky = pvlib.clearsky.ineichen(angle, airmass, turbidity, altitude, extra, perez_enhancement=False)
    return sky[["ghi", "dhi", "dni"]].fillna(0.0)


@dataclass
class SunHours:
    """Hours with the sun where no weather is known: what `split_sky` and `sunlit_year` read of a Weather."""

    data: pd.DataFrame  # apparent_zenith and solar_azimuth [°]
    interval: pd.Timedelta


def plausible_years(hours, model):
    """A clear and an overcast year: list of SunlitYear.

    Parameters
    ----------
    hours : Weather or SunHours
        Of which only the places count, on Earth and of the sun.
    model : str
        Of the sky, a key of `sky_models.MODELS`.
    """
    clear = clear_year(hours)
    return [sunlit_year(one, split_sky(one, model)) for one in (clear, overcast_year(clear))]


def even_year():
    """An evenly bright sky without a sun: SunlitYear."""
    return SunlitYear(np.zeros((0, 3)), np.zeros(0), 1.0, {})


def clear_year(hours):
    """The same hours without a cloud, as `--weather clear-sky` has them."""
    zenith, middle = hours.data["apparent_zenith"], hours.data.index + hours.interval / 2
    nowhere = isinstance(hours, SunHours)
    place, altitude = (None, 0.0) if nowhere else ((hours.latitude, hours.longitude), hours.altitude)
    found = clear_irradiance(zenith, middle, place, altitude, pvlib.atmosphere.alt2pres(altitude))
    return replace(hours, data=hours.data.assign(**{name: found[name].to_numpy() for name in found}))


def overcast_year(clear):
    """A clear year below a closed cover of clouds, which lets a quarter through.

    References
    ----------
    F. Kasten, G. Czeplak (1980), Solar and terrestrial radiation dependent on the amount and type of cloud.
    :doi:`10.1016/0038-092X(80)90391-6`
    """
    below = OVERCAST * clear.data["ghi"]
    return replace(clear, data=clear.data.assign(ghi=below, dni=0.0, dhi=below))


def hours_of_suns(suns):
    """As many hours of each sun as it stands for: SunHours.

    Parameters
    ----------
    suns : Suns
    """
    share = np.cumsum(np.maximum(suns.weight, 0))
    row = np.searchsorted(share / share[-1], (np.arange(HOURS) + 0.5) / HOURS)
    east, north, up = suns.direction[row].T
    zenith, azimuth = np.degrees(np.arccos(np.clip(up, -1, 1))), np.degrees(np.arctan2(east, north)) % 360
    places = {"apparent_zenith": zenith, "solar_azimuth": azimuth}
    return SunHours(pd.DataFrame(places, index=pd.DatetimeIndex([MEAN_DISTANCE] * len(row))), pd.Timedelta(hours=1))
