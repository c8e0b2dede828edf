"""DC power from irradiance on a module: the only calls of pvlib's module models."""

import numpy as np
import pvlib

from .pick_module import SANDIA

HIGHEST_AIRMASS = 10.0  # up to which the coefficients of f₁ were fitted; beyond it the polynomials diverge
STANDARD_TEMPERATURE = 25.0  # [°C] of cells at standard test conditions
INCIDENCE_LAWS = {"physical": pvlib.iam.physical, "ashrae": pvlib.iam.ashrae}


def incidence_factor(aoi, system):
    """Incidence angle modifier (IAM) of direct light.

    Parameters
    ----------
    aoi : numpy.ndarray
        Angle of incidence [°].
    system : PvSystem

    Returns
    -------
    numpy.ndarray
        Sandia's polynomial f₂ of the module, Fresnel's equations for a pane (De Soto et al. 2006), or ASHRAE's law;
        1 with the effect switched off.
    """
    if not system.aoi:
        return np.ones_like(aoi)
    if system.incidence == "sapm":
        return pvlib.iam.sapm(aoi, system.module.parameters)
    return INCIDENCE_LAWS[system.incidence](aoi)


def diffuse_share(system):
    """Share FD of diffuse light that the module uses: below 1 for concentrators of the Sandia library."""
    return system.module.parameters["FD"] if system.module.library == SANDIA else 1.0


def spectral_factor(airmass, system):
    """Sandia's f₁, the influence of the spectrum on the current; 1 for modules of the CEC library, which has none.

    Parameters
    ----------
    airmass : numpy.ndarray
        Absolute air mass; NaN with the sun below the horizon.
    system : PvSystem

    Returns
    -------
    numpy.ndarray
        0 with the sun below the horizon, as in pvlib. Held constant beyond an air mass of 10 (sun below 5.4°).
    """
    if system.module.library != SANDIA:
        return np.ones_like(airmass)
    if not system.spectrum:
        return np.where(np.isnan(airmass), 0.0, 1.0)
    return pvlib.spectrum.spectral_factor_sapm(np.minimum(airmass, HIGHEST_AIRMASS), system.module.parameters)


def cell_temperature(poa_global, temp_air, wind_speed, system):
    """Cell temperature by the Sandia model [°C]; that of standard test conditions with the effect switched off.

    Parameters
    ----------
    poa_global : numpy.ndarray
        [Wm⁻²]
    temp_air, wind_speed : numpy.ndarray
        [°C], [ms⁻¹]
    system : PvSystem

    Returns
    -------
    numpy.ndarray
    """
    if not system.temperature:
        return np.full_like(poa_global, STANDARD_TEMPERATURE)
    return pvlib.temperature.sapm_cell(poa_global, temp_air, wind_speed, **system.thermal)


def dc_power(effective, temp_cell, module):
    """Power at the maximum power point over nominal power (paper, Eq. 12).

    Parameters
    ----------
    effective : numpy.ndarray
        Effective irradiance, above 0 [Wm⁻²].
    temp_cell : numpy.ndarray
        [°C]
    module : Module

    Returns
    -------
    numpy.ndarray
        By the Sandia array performance model, or by the single-diode model with CEC parameters.
    """
    own = module.parameters
    if module.library == SANDIA:
        return pvlib.pvsystem.sapm(effective, temp_cell, own)["p_mp"] / module.nominal_power
    names = ("alpha_sc", "a_ref", "I_L_ref", "I_o_ref", "R_sh_ref", "R_s", "Adjust")
    diode = pvlib.pvsystem.calcparams_cec(effective, temp_cell, **{name: own[name] for name in names})
    return pvlib.pvsystem.max_power_point(*diode, method="newton")["p_mp"] / module.nominal_power
