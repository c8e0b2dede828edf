"""Share the diffuse light of the sky out by dome, circumsolar disc and traced sources such as the horizon.

             dome: equally bright, (1 + cos tilt)/2 on an unshaded surface
          ▁▂▃▄▅▆▇█ circumsolar: from the place of the sun, like direct light
    ─────────────── horizon: sin tilt on an unshaded surface

A new model is one file with one function, one line in MODELS, and one in `request.SKIES`. Sources are those of
`light_sources.py`.
"""

from dataclasses import dataclass, replace

import numpy as np

from .isotropic_sky import isotropic_sky
from .light_sources import sources_of
from .perez_sky import perez_sky

MODELS = {"isotropic": isotropic_sky, "perez": perez_sky}
NO_CAP = 1e6  # of a source that is never darker than the dome


@dataclass
class SkyParts:
    """Light of the sky in t intervals [Wm⁻²]."""

    dome: np.ndarray  # (t,) part of DHI that comes evenly from the whole sky
    circumsolar: np.ndarray  # (t,) normal irradiance from the place of the sun, DNI not included
    circumsolar_horizontal: np.ndarray  # (t,) what unshaded ground receives of DHI from the place of the sun
    sources: dict  # name -> (t,) irradiance by a traced source, in its unit; negative where it is darker than the dome

    @property
    def of_sources(self):
        """Irradiance by each of k sources, in the order of `sources`: (t, k)."""
        return np.array([*self.sources.values()]).reshape(len(self.sources), len(self.dome)).T

    @property
    def caps(self):
        """Visible light of each source per visible dome up to which no interval's sky is darker than black: (k,)."""
        return np.array([self._cap(light) for light in self.sources.values()])

    def _cap(self, light):
        dark = light < 0
        return float((self.dome[dark] / -light[dark]).min()) if dark.any() else NO_CAP


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
    parts = SkyParts(**MODELS[model](weather))
    return replace(parts, sources={source.name: parts.sources[source.name] for source in sources_of(model)})
