"""Share the diffuse light of the sky out by dome, circumsolar disc and horizon: an isotropic sky,
or Perez'.

             dome: equally bright, (1 + cos tilt)/2 on an unshaded surface
          ▁▂▃▄▅▆▇█ circumsolar: from the place of the sun, like direct light
    ─────────────── horizon: sin tilt on an unshaded surface, traced by itself

References
----------
R. Perez, P. Ineichen, R. Seals, J. Michalsky, R. Stewart (1990), Modeling daylight availability and
irradiance components from direct and global irradiance. :doi:`10.1016/0038-092X(90)90055-H`
"""

from dataclasses import dataclass

import numpy as np
import pvlib

from .horizon_band import HORIZON

MODELS = ("isotropic", "perez")
# hemisphere rays for each ray towards the horizon, which is a small part of the light
RAYS_SHARE = 4


@dataclass
class SkyParts:
    """Light of the sky in t intervals [Wm⁻²]."""

    dome: np.ndarray  # (t,) part of DHI that comes evenly from the whole sky
    circumsolar: np.ndarray  # (t,) normal irradiance from the place of the sun, DNI not included
    # (t,) what unshaded ground receives of DHI from the place of the sun
    circumsolar_horizontal: np.ndarray
    # name -> (t,) irradiance by a traced part, in its unit; negative where it is darker than the
    # dome
    sources: dict

    @property
    def of_sources(self):
        """Irradiance by each of k traced parts, in the order of `sources`: (t, k)."""
        return np.array([*self.sources.values()]).reshape(len(self.sources), len(self.dome)).T

    @property
    def caps(self):
        """Visible light of each part per visible dome up to which no interval's sky is darker than
        black: (k,).
        """
        dark = [(self.dome[light < 0], -light[light < 0]) for light in self.sources.values()]
        # A horizon that is never darker than the dome has a cap beyond all rays.
        return np.array([float((dome / less).min(initial=1e6)) for dome, less in dark])

    def rays_share(self):
        """Hemisphere rays for each ray towards the horizon, so that its noise hardly adds to the
        dome's.

        As many rays find light that is H/D of the dome's with (H/D)² of its variance, a share of
        them with that many times more.

        Returns
        -------
        int
            A power of two.
        """
        # ratio  H/D, light of the horizon over light of the dome [–].
        dome, share = float(self.dome.sum()), RAYS_SHARE
        ratio = float(np.abs(self.of_sources).sum()) / dome if dome > 0 else 1.0
        # A horizon that gives next to nothing has a ray for 16 of the hemisphere; the horizon's
        # noise may add a tenth to the variance of the dome's light.
        while 2 * share <= 16 and 2 * share * ratio**2 <= 0.1:
            share *= 2
        return share


def split_sky(weather, model, *, small_tilt=1.0):
    """Light of the sky in each interval of a weather.

    Parameters
    ----------
    weather : Weather
    model : str
        Of MODELS. Perez' has the coefficients "allsitescomposite1990" of pvlib; with the sun below
        the horizon, where it is not defined, the sky is isotropic.

    Returns
    -------
    SkyParts

    Notes
    -----
    On an unshaded surface of tilt β, with a = max(0, cos aoi) and b = max(cos 85°, cos z),

        E = DHI [(1 - F₁) (1 + cos β)/2 + F₁ a/b + F₂ sin β]   # Eq. 9

    pvlib takes the apparent zenith angle and the relative air mass.
    """
    data = weather.data
    dhi, zenith = data["dhi"].to_numpy(float), data["apparent_zenith"].to_numpy(float)
    if model == "isotropic":
        return SkyParts(dhi, np.zeros(len(dhi)), np.zeros(len(dhi)), {})
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
    # Each part per its view from that plane: (1 - F₁) DHI, F₁ DHI, and F₂ DHI of Eq. 9.
    tilt = np.radians(small_tilt)
    dome = np.where(defined, parts["poa_isotropic"] / ((1 + np.cos(tilt)) / 2), dhi)
    around = np.maximum(dhi - dome, 0.0)
    # F₁ DHI is what level ground has from the sun's place; normal to it there is 1/b times as much,
    # b = max(cos 85°, cos z).
    # From a zenith angle of 85° on the circumsolar disc is taken as if it stood there (Eq. 9).
    height = np.maximum(np.cos(np.radians(zenith)), np.cos(np.radians(85.0)))
    horizon = np.where(defined, parts["poa_horizon"] / np.sin(tilt), 0.0)
    return SkyParts(dome, around / height, around, {HORIZON.name: horizon})


def sources_of(model):
    """Parts that are traced for a model of the sky, beside its dome: tuple of HorizonBand."""
    return (HORIZON,) if model == "perez" else ()


def model_traced(names):
    """Model of the sky whose parts were traced, from their names: str."""
    return "perez" if HORIZON.name in names else "isotropic"


def choose_sky(request, transfer):
    """Model of the sky that weighs a Transfer: what is asked for, or else what it was traced for.

    Parameters
    ----------
    request : Request
        Its `sky` and `effects` count.
    transfer : Transfer

    Returns
    -------
    {"isotropic", "perez"}
    """
    asked = request.effects.get("perez")
    if asked is None:
        return model_traced(transfer.sources) if request.sky == "auto" else request.sky
    return "perez" if asked else "isotropic"
