"""The isotropic sky: all diffuse light comes evenly from the dome."""

import numpy as np


def isotropic_sky(weather):
    """Light of the isotropic sky.

    Parameters
    ----------
    weather : Weather

    Returns
    -------
    dict
        Fields of `SkyParts`, [Wm⁻²].
    """
    dhi = weather.data["dhi"].to_numpy(float)
    nothing = np.zeros(len(dhi))
    return {"dome": dhi, "circumsolar": nothing, "circumsolar_horizontal": nothing, "sources": {}}
