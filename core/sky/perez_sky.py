"""The sky of Perez et al. (1990): dome, circumsolar disc and horizon, with the coefficients of pvlib."""

import numpy as np
import pvlib

LOWEST = 85.0  # [°] zenith angle from which on the circumsolar disc is taken as if it stood there (Eq. 9)
SMALL_TILT = 1.0  # [°] of the plane that tells the parts apart: each is positive on it


def perez_sky(weather):
    """Light of the Perez sky.

    Parameters
    ----------
    weather : Weather

    Returns
    -------
    dict
        Fields of `SkyParts`, [Wm⁻²]. With the sun below the horizon, where the model is not defined, the sky
        is isotropic.

    Notes
    -----
    On an unshaded surface of tilt β, with a = max(0, cos aoi) and b = max(cos 85°, cos z),

        E = DHI [(1 - F₁) (1 + cos β)/2 + F₁ a/b + F₂ sin β]   # Eq. 9

    with the coefficients "allsitescomposite1990" for F₁ and F₂. pvlib takes the apparent zenith angle and the relative
    air mass.

    References
    ----------
    R. Perez, P. Ineichen, R. Seals, J. Michalsky, R. Stewart (1990), Modeling daylight availability and irradiance
    components from direct and global irradiance. :doi:`10.1016/0038-092X(90)90055-H`
    """
    data = weather.data
    dhi, zenith = data["dhi"].to_numpy(float), data["apparent_zenith"].to_numpy(float)
    airmass = pvlib.atmosphere.get_relative_airmass(zenith, "kastenyoung1989")
    defined = np.isfinite(airmass) & (dhi > 0)
    parts = pvlib.irradiance.perez(
        *(SMALL_TILT, 180.0, np.where(defined, dhi, 1.0), data["dni"].to_numpy(float)),
        dni_extra=pvlib.irradiance.get_extra_radiation(data.index + weather.interval / 2).to_numpy(),
        solar_zenith=zenith,
        solar_azimuth=data["solar_azimuth"].to_numpy(float),
        airmass=np.where(defined, airmass, 1.0),
        return_components=True,
    )
    tilt = np.radians(SMALL_TILT)
    dome = np.where(defined, parts["poa_isotropic"] / ((1 + np.cos(tilt)) / 2), dhi)
    around = np.maximum(dhi - dome, 0.0)
    height = np.maximum(np.cos(np.radians(zenith)), np.cos(np.radians(LOWEST)))
    return {
        "dome": dome,
        "circumsolar": around / height,
        "circumsolar_horizontal": around,
        "sources": {"horizon": np.where(defined, parts["poa_horizon"] / np.sin(tilt), 0.0)},
    }
