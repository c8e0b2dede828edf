"""Share the diffuse light of the sky out by dome, circumsolar disc and horizon.

             dome: equally bright, (1 + cos tilt)/2 on an unshaded surface
          ▁▂▃▄▅▆▇█ circumsolar: from the place of the sun, like direct light
    ─────────────── horizon: sin tilt on an unshaded surface

A new model is one file with one function, one line in MODELS, and one in `request.SKIES`.
"""

from dataclasses import dataclass

import numpy as np

from .isotropic_sky import isotropic_sky
from .perez_sky import perez_sky

MODELS = {"isotropic": isotropic_sky, "perez": perez_sky}
NO_CAP = 1e6  # of a horizon that is never darker than the dome


@dataclass
class SkyParts:
    """Light of the sky in t intervals [Wm⁻²]."""

    dome: np.ndarray  # (t,) part of DHI that comes evenly from the whole sky
    circumsolar: np.ndarray  # (t,) normal irradiance from the place of the sun, DNI not included
    circumsolar_horizontal: np.ndarray  # (t,) what unshaded ground receives of DHI from the place of the sun
    horizon: np.ndarray  # (t,) irradiance of an unshaded wall by the horizon; negative where it is darker than the dome

    @property
    def cap(self):
        """Visible horizon per visible dome up to which no interval's sky is darker than black."""
        dark = self.horizon < 0
        return float((self.dome[dark] / -self.horizon[dark]).min()) if dark.any() else NO_CAP


def split_sky(weather, model):
    """Light of the sky in each interval of a weather.

    Parameters
    ----------
    weather : Weather
    model : str
        A key of MODELS.

    Returns
    -------
    SkyParts
    """
    return SkyParts(**MODELS[model](weather))
