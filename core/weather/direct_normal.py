"""Split the irradiance on a horizontal plane into its direct and its diffuse part."""

import numpy as np


def compute_dni(ghi, dhi, zenith):
    """Direct normal irradiance of hours with the sun well above the horizon (paper, Eq. 5).

    Parameters
    ----------
    ghi, dhi : array_like, (t,)
        Global and diffuse horizontal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°], below 90.

    Returns
    -------
    numpy.ndarray, (t,)
        Direct normal irradiance [Wm⁻²].
    """
    return (np.asarray(ghi) - np.asarray(dhi)) / np.cos(np.radians(zenith))  # Eq. 5


def compute_dhi(ghi, dni, zenith):
    """Diffuse horizontal irradiance [Wm⁻²] from the global and the direct normal one (paper, Eq. 5).

    Parameters
    ----------
    ghi, dni : array_like, (t,)
        Global horizontal and direct normal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°].

    Returns
    -------
    numpy.ndarray, (t,)
        Diffuse horizontal irradiance [Wm⁻²].
    """
    return np.asarray(ghi) - np.asarray(dni) * np.maximum(np.cos(np.radians(zenith)), 0.0)  # Eq. 5


def compute_ghi(dhi, dni, zenith):
    """Global horizontal irradiance [Wm⁻²] from the diffuse and the direct normal one (paper, Eq. 5).

    Parameters
    ----------
    dhi, dni : array_like, (t,)
        Diffuse horizontal and direct normal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°].

    Returns
    -------
    numpy.ndarray, (t,)
        Global horizontal irradiance [Wm⁻²].
    """
    return np.asarray(dhi) + np.asarray(dni) * np.maximum(np.cos(np.radians(zenith)), 0.0)  # Eq. 5
