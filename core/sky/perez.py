"""The sky of Perez: a dome, light from around the sun, and a band above the horizon that is
brighter or darker than the dome.

References
----------
R. Perez, P. Ineichen, R. Seals, J. Michalsky, R. Stewart (1990), Modeling daylight availability and
irradiance components from direct and global irradiance. :doi:`10.1016/0038-092X(90)90055-H`
"""

import numpy as np
import pvlib

from .horizon_band import HORIZON
from .sky_models import SkyParts

SOURCES = (HORIZON,)


def split(weather, *, small_tilt=1.0):
    """Light of the sky in each interval of a weather: SkyParts [Wm⁻²], the dome, the part around
    the sun (normal to the sun and on level ground), and the horizon band.

    The coefficients are "allsitescomposite1990" of pvlib; with the sun below the horizon, where the
    model is not defined, the sky is isotropic.

    Notes
    -----
    On an unshaded surface of tilt β, with a = max(0, cos aoi) and b = max(cos 85°, cos z),

        E = DHI [(1 - F₁) (1 + cos β)/2 + F₁ a/b + F₂ sin β]   # Eq. 9

    pvlib takes the apparent zenith angle and the relative air mass.
    """
    data = weather.data
    dhi, zenith = data["dhi"].to_numpy(float), data["apparent_zenith"].to_numpy(float)
    # pvlib's three parts on a plane that is nearly level, with harmless values where the model is
    # not defined.
    airmass = pvlib.atmosphere.get_relative_airmass(zenith, "kastenyoung1989")
    defined = np.isfinite(airmass) & (dhi > 0)
    # `small_tilt`: [°] of the plane that tells the parts apart: each is positive on it.
    parts = pvlib.irradiance.perez(
        *(small_tilt, 180.0, np.where(defined, dhi, 1.0), data["dni"].to_numpy(float)),
        dni_extra=pvlib.irradiance.get_extra_radiation(
            data.index + weather.interval / 2
        ).to_numpy(),
        solar_zenith=zenith,
        solar_azimuth=data["solar_azimuth"].to_numpy(float),
        airmass=np.where(defined, airmass, 1.0),
        return_components=True,
    )
    # Dome and horizon, (1 - F₁) DHI and F₂ DHI of Eq. 9: pvlib's part divided by its view from that
    # plane. Where the model is not defined all of DHI is dome. F₁ DHI is what the dome leaves.
    tilt = np.radians(small_tilt)
    dome = np.where(defined, parts["poa_isotropic"] / ((1 + np.cos(tilt)) / 2), dhi)
    around = np.maximum(dhi - dome, 0.0)
    # F₁ DHI is what level ground has from the sun's place; normal to it there is 1/b times as much,
    # b = max(cos 85°, cos z): a sun lower than 5° counts as if it stood at 5° (Eq. 9).
    height = np.maximum(np.cos(np.radians(zenith)), np.cos(np.radians(85.0)))
    horizon = np.where(defined, parts["poa_horizon"] / np.sin(tilt), 0.0)
    return SkyParts(dome, around / height, around, {HORIZON.name: horizon})
