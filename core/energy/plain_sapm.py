"""The Sandia array performance model, as pvlib has it."""

import numpy as np
import pvlib

from .hours import MOUNTING
from .pick_module import nominal_power


def plain_sapm(poa_direct, poa_diffuse, aoi_projection, hours, module):
    """Capacity factor of surfaces at hours, by pvlib called directly.

    Angle-of-incidence loss on the direct part, spectral loss, cell temperature on an open rack with glass/polymer
    modules, power at the maximum power point over Impo · Vmpo (paper, Eq. 12).

    Parameters
    ----------
    poa_direct, poa_diffuse : numpy.ndarray, (h, n)
        Irradiance on the surfaces [Wm⁻²].
    aoi_projection : numpy.ndarray, (h, n)
        Cosine of the angle of incidence, not negative.
    hours : Hours
        The h hours.
    module : dict
        From `pick_module`.

    Returns
    -------
    numpy.ndarray, (h, n)
        0 where no irradiance is effective (pvlib's logarithm of zero may give NaN there).
    """
    aoi = np.degrees(np.arccos(np.minimum(aoi_projection, 1.0)))
    effective = pvlib.pvsystem.sapm_effective_irradiance(poa_direct, poa_diffuse, hours.airmass, aoi, module)
    temp_cell = pvlib.temperature.sapm_cell(poa_direct + poa_diffuse, hours.temp_air, hours.wind_speed, **MOUNTING)
    lit = effective > 0
    power = np.zeros_like(effective)
    power[lit] = pvlib.pvsystem.sapm(effective[lit], temp_cell[lit], module)["p_mp"]
    return power / nominal_power(module)  # Eq. 12
