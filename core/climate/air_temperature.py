"""Air temperature of a typical year: an annual cycle from irradiance, and a daily cycle from clearness."""

import numpy as np

# First annual harmonic of air temperature over that of GHI [K/Wm⁻²], for air from the sea and from land.
GAIN_SEA, GAIN_LAND = 0.03, 0.19
LAG = 29.0  # [days] of land temperature behind irradiance (Stine et al. 2009)


def air_temperature(places, times, normals, outside, ghi):
    """Air temperature [°C] of each hour, (p, t): annual mean plus annual and daily cycle.

    Parameters
    ----------
    places : list of (float, float)
        Latitude and longitude [°].
    times : pandas.DatetimeIndex, (t,)
        Start of each hour.
    normals : list of Normals
    outside, ghi : numpy.ndarray, (p, t)
        Irradiance on a horizontal plane, outside the atmosphere and on the ground [Wm⁻²].

    Notes
    -----
    The annual cycle is the first harmonic of GHI times a gain, delayed by 29 days. The gain is interpolated between
    those of air from the sea and from land by the share of land upwind, which explains most of its variance: A. R.
    Stine et al., :doi:`10.1038/nature07675`; K. A. McKinnon et al., :doi:`10.1175/JCLI-D-13-00021.1`.

    The daily cycle is that of D. G. Erbs, S. A. Klein, W. A. Beckman, ASHRAE J. 25 (6), 60 to 65 (1983): its range
    follows from the clearness index, its shape is a sum of four harmonics. They give it for the mean day of a month;
    here each hour uses the clearness of the 24 hours around it, so that sunny days have the warmest afternoons.
    """
    phase = 2j * np.pi * (np.arange(len(times)) + 0.5) / len(times)
    harmonic = 2 * (ghi * np.exp(-phase)).mean(axis=1)  # (p,) [Wm⁻²]
    influence = np.array([found.land_influence for found in normals])
    gain = GAIN_SEA + (GAIN_LAND - GAIN_SEA) * influence  # (p,) [K/Wm⁻²]
    lag = 2j * np.pi * LAG / (len(times) / 24)
    yearly = ((gain * harmonic)[:, None] * np.exp(phase - lag)).real
    clearness = sum_around(ghi) / np.maximum(sum_around(outside), 1.0)
    swing = np.maximum(25.8 * clearness - 5.21, 0.0)  # [K]
    longitude = np.array([[place[1]] for place in places])
    solar = 2 * np.pi * (np.arange(len(times)) + 0.5 + longitude / 15 - 1) / 24  # 1 o'clock is 0
    form = 0.4632 * np.cos(solar - 3.805) + 0.0984 * np.cos(2 * solar - 0.360)
    form += 0.0168 * np.cos(3 * solar - 0.822) + 0.0138 * np.cos(4 * solar - 3.513)
    cycles = yearly + swing * form
    mean = np.array([[found.temp_air] for found in normals])
    return (mean + cycles - cycles.mean(axis=1, keepdims=True)).round(3)


def sum_around(values):
    """Sum of the 24 hours around each hour, cyclic over the year: (p, t)."""
    running = np.cumsum(np.pad(values, ((0, 0), (12, 12)), mode="wrap"), axis=1)
    return running[:, 24:] - running[:, :-24]
