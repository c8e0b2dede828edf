"""The traced sources of light in the sky: all that is traced beside the dome and the suns.

    SOURCES ─► radiosity, photons: rays and photons of each ─► Transfer.sources[name], per unit of its irradiance
       │                                                              │
       └─► model of the sky: irradiance of each, hour by hour ─────── × ─► energy, world

A new source is one file with its geometry and its SkySource, one line here, and its irradiance in the models of the sky
that have it. Nothing else knows a source by its name.
"""

import numpy as np

from .horizon_source import HORIZON

SOURCES = {one.name: one for one in (HORIZON,)}
RAYS_SHARE = 4  # hemisphere rays for each ray towards a source, which is a small part of the light
MOST_SHARE = 16  # the same of a source that is next to nothing
NOISE_SHARE = 0.1  # of the variance of the dome's light: what that of a source may add to it


def sources_of(model):
    """Sources that a model of the sky has: tuple of SkySource."""
    return tuple(source for source in SOURCES.values() if model in source.skies)


def choose_share(parts):
    """Hemisphere rays for each ray towards the sources, so that their noise hardly adds to that of the dome.

    As many rays find light that is H/D of the dome's with (H/D)² of its variance, a share of them with that many times
    more.

    Parameters
    ----------
    parts : SkyParts
        Of a year.

    Returns
    -------
    int
        A power of two.
    """
    dome = float(parts.dome.sum())
    ratio = max([float(np.abs(light).sum()) / dome for light in parts.sources.values()] if dome > 0 else [], default=1)
    share = RAYS_SHARE
    while 2 * share <= MOST_SHARE and 2 * share * ratio**2 <= NOISE_SHARE:
        share *= 2
    return share


def name_untraced(model, names):
    """Sources that a model of the sky has beside those of some names, in words; "" without any: str."""
    return " and ".join(source.title for source in sources_of(model) if source.name not in names)


def model_traced(names):
    """Model of the sky whose sources were traced, the richest there is; without any, the isotropic one.

    Parameters
    ----------
    names : iterable of str
        Of the traced sources.

    Returns
    -------
    str
    """
    traced, models = set(names), {model: None for source in SOURCES.values() for model in source.skies}
    fitting = [model for model in models if {source.name for source in sources_of(model)} <= traced]
    return max(fitting, key=lambda model: len(sources_of(model)), default="isotropic")
