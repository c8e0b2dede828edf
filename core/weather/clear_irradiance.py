"""Irradiance under a clear sky, by Ineichen and Perez as pvlib computes it."""

import numpy as np
import pandas as pd
import pvlib


def clear_irradiance(zenith, middle, turbidity, altitude, pressure):
    """Irradiance under a clear sky.

    Parameters
    ----------
    zenith : (t,) float64
        Apparent zenith angle [°].
    middle : pandas.DatetimeIndex, (t,)
    turbidity : float or (t,) float64
        Of Linke: 2 in very clean, dry air; pvlib knows its monthly means everywhere.
    altitude : float
        [m]
    pressure : float or (t,) float64
        Of the air [Pa].

    Returns
    -------
    pandas.DataFrame
        Columns ghi, dhi and dni [Wm⁻²], indexed by `middle`.

    References
    ----------
    P. Ineichen, R. Perez (2002), A new airmass independent formulation for the Linke turbidity
    coefficient. :doi:`10.1016/S0038-092X(02)00045-2`
    """
    angle = pd.Series(np.asarray(zenith, float), index=middle)
    airmass = pvlib.atmosphere.get_absolute_airmass(
        pvlib.atmosphere.get_relative_airmass(angle), pressure
    )
    extra = pvlib.irradiance.get_extra_radiation(middle)
    sky = pvlib.clearsky.ineichen(
        angle, airmass, turbidity, altitude, extra, perez_enhancement=False
    )
    return sky[["ghi", "dhi", "dni"]].fillna(0.0)
