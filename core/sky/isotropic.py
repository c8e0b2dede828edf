"""The sky that is equally bright all over: all of DHI comes from the dome."""

import numpy as np

from .sky_models import SkyParts

SOURCES = ()


def split(weather):
    """Light of the sky in each interval of a weather: SkyParts."""
    dhi = weather.data["dhi"].to_numpy(float)
    return SkyParts(dhi, np.zeros(len(dhi)), np.zeros(len(dhi)), {})
