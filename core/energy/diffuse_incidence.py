"""What diffuse light loses by its angles of incidence, by the tilt of the surface."""

import numpy as np
import pvlib
from scipy.interpolate import PchipInterpolator

STEP = 3.0  # [°] between the tilts that are integrated; cubics through them


def diffuse_incidence_factors(surface_tilt, system):
    """Shares of the light from the sky, and of reflected light, that are not lost by their angles of incidence.

    Sky and ground are taken as evenly bright (Marion 2017, :doi:`10.1016/j.solener.2017.02.027`), whatever of them is
    seen; light that walls reflect counts as from the ground.

    Parameters
    ----------
    surface_tilt : numpy.ndarray, (n,)
        [°]
    system : PvSystem

    Returns
    -------
    numpy.ndarray, (2, n)
        1 where the system counts no such loss.
    """
    if not system.diffuse_incidence:
        return np.ones((2, len(surface_tilt)))
    tilt = np.arange(0.0, 180.0 + STEP, STEP)
    own = {"module": system.module.parameters} if system.incidence == "sapm" else {}
    factors = pvlib.iam.marion_diffuse(system.incidence, tilt, **own)
    shares = np.nan_to_num([factors["sky"], factors["ground"]])  # (2, t); of nothing seen is 0
    return PchipInterpolator(tilt, shares, axis=1)(np.clip(surface_tilt, 0.0, 180.0))
