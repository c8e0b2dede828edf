"""Incidence angle modifier (IAM) of diffuse light, by the tilt of the surface."""

import numpy as np
import pvlib
from scipy.interpolate import PchipInterpolator

STEP = 3.0  # [°] between the tilts that are integrated; cubic interpolation in between


def diffuse_incidence_factors(surface_tilt, system, sources=()):
    """IAM of the light from the sky, of reflected light, and of the light of traced sources in the sky.

    Sky and ground are assumed to be uniform (Marion 2017, :doi:`10.1016/j.solener.2017.02.027`) and unobstructed; light
    reflected by walls is treated like light from the ground.

    Parameters
    ----------
    surface_tilt : numpy.ndarray, (n,)
        [°]
    system : PvSystem
    sources : sequence of SkySource
        k of them.

    Returns
    -------
    numpy.ndarray, (2 + k, n)
        1 if the system has no IAM for diffuse light.
    """
    if not (system.diffuse_incidence and system.aoi):
        return np.ones((2 + len(sources), len(surface_tilt)))
    tilt = np.arange(0.0, 180.0 + STEP, STEP)
    own = {"module": system.module.parameters} if system.incidence == "sapm" else {}
    factors = pvlib.iam.marion_diffuse(system.incidence, tilt, **own)
    regions = ("sky", "ground", *(source.incidence for source in sources))
    shares = np.nan_to_num([factors[region] for region in regions])  # (2 + k, t); 0 where one is not visible
    return PchipInterpolator(tilt, shares, axis=1)(np.clip(surface_tilt, 0.0, 180.0))
