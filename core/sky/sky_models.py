"""Models of the sky: how each shares its diffuse light out by dome, circumsolar disc and horizon.

             dome: equally bright, (1 + cos tilt)/2 on an unshaded surface
          ▁▂▃▄▅▆▇█ circumsolar: from the place of the sun, like direct light
    ─────────────── horizon: sin tilt on an unshaded surface, traced by itself

A new model is a file beside this one with its `SOURCES` and `split(weather)`, and a line with its
name and words in `settings.request.SKIES`.
"""

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from ..settings.request import BEST_SKY

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


def split_sky(weather, model):
    """Light of the sky in each interval of a weather, by a model of `settings.request.SKIES`:
    SkyParts.
    """
    return import_module(f".{model}", __package__).split(weather)


def sources_of(model):
    """Parts that are traced for a model of the sky, beside its dome: tuple of HorizonBand."""
    return import_module(f".{model}", __package__).SOURCES


def model_traced(names):
    """Model of the sky whose parts were traced, from their names: str."""
    return BEST_SKY if {source.name for source in sources_of(BEST_SKY)} <= {*names} else "isotropic"


def choose_sky(request, transfer):
    """Model of the sky that weighs a Transfer: what is asked for, or else what it was traced for.

    Parameters
    ----------
    request : Request
    transfer : Transfer

    Returns
    -------
    str
    """
    return request.asked_sky or model_traced(transfer.sources)
