"""Draw days and hours of a climate: sunny and dull ones in the proportions that the months' sums
tell.

Everything is relative to the sky at its cleanest, which no hour exceeds. Arrays are (p, d, 24):
place, local day, local hour; the numbers drawn are the same for all places, so that neighbours have
the same days.
"""

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri


def draw_normals(seed, shape):
    """Standard normal random numbers from a counter-based generator, the same on every machine.

    Parameters
    ----------
    seed : int
    shape : tuple of int

    Returns
    -------
    numpy.ndarray
    """
    # Inverse of the normal distribution at whole numbers of 53 bits, moved off 0 and 1.
    words = np.random.Philox(key=seed % 2**64).random_raw(int(np.prod(shape)))
    return ndtri(((words >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53).reshape(shape)


def rank_days(normals, month, *, day_memory=0.29):
    """Rank of each day within its month as a quantile, evenly spread over 0 to 1.

    The set of quantiles of a month does not depend on the seed, only their order, which follows an
    autoregressive sequence of first order (Graham et al. 1988,
    :doi:`10.1016/0038-092X(88)90019-8`).

    Parameters
    ----------
    normals : numpy.ndarray, (d,)
        Independent standard normal numbers.
    month : numpy.ndarray, (d,)
        Of each day.

    Returns
    -------
    numpy.ndarray, (d,)
    """
    # Autoregression of first order: each day keeps a share of the day before, and the variance
    # stays 1.
    chain = np.empty(len(normals))
    last = normals[0]
    for day, fresh in enumerate(normals):
        # `day_memory`: correlation of a day with the day before (Graham et al. 1988).
        last = chain[day] = day_memory * last + np.sqrt(1 - day_memory**2) * fresh
    # Ranks in a month, at the middles of equal shares of 0 to 1.
    of_month = pd.Series(chain).groupby(month)
    return ((of_month.rank(method="first") - 0.5) / of_month.transform("size")).to_numpy()


def draw_days(mean, cleanest, quantile, month, *, least_day=0.05):
    """Daily clearness indices with the exponential distribution of Bendt et al.

    Parameters
    ----------
    mean : numpy.ndarray, (p, 12)
        Clearness index of the months.
    cleanest : numpy.ndarray, (p, d)
        Clearness index of each day under the cleanest sky.
    quantile : numpy.ndarray, (d,)
        Of `rank_days`.
    month : numpy.ndarray, (d,)
        Of each day, from 0.

    Returns
    -------
    numpy.ndarray, (p, d)
        Clearness index of each day.

    Notes
    -----
    P. Bendt, M. Collares-Pereira, A. Rabl, :doi:`10.1016/0038-092X(81)90062-2`: a density
    proportional to exp(γK) between the least and the largest clearness index, where γ follows from
    the mean. The largest one, which they take from data, follows from the cleanest sky here.
    """
    # Clearness as a share of the cleanest sky, from `least` on the dullest day to 1.
    # (p, 12)
    largest = np.stack([cleanest[:, month == each].mean(axis=1) for each in range(12)], axis=1)
    share = np.clip(mean / np.maximum(largest, 1e-6), 0.0, 1.0)
    # `least_day`: clearness index of the cloudiest day (Bendt et al. 1981).
    least = np.minimum(least_day / np.maximum(largest, least_day), 0.3 * share)
    # γ gives the month its mean; each day stands at its quantile of that distribution.
    gamma = solve_exponential((share - least) / (1 - least))
    relative = exponential_quantile(gamma[:, month], quantile)
    return cleanest * (least[:, month] + (1 - least[:, month]) * relative)


def solve_exponential(mean):
    """γ of the density ∝ exp(γx) on 0 to 1 with a given mean, which is clipped to 0.02 to 0.98.

    Parameters
    ----------
    mean : numpy.ndarray

    Returns
    -------
    numpy.ndarray
        Never 0.
    """
    mean = np.clip(mean, 0.02, 0.98)
    ends = np.full(mean.shape, -60.0), np.full(mean.shape, 60.3)
    return bisect(lambda gamma: 1 / -np.expm1(-gamma) - 1 / gamma <= mean, *ends)


def bisect(is_low, low, high):
    """Numbers between two ends, arrays, below which `is_low` of such numbers is true, and above
    which it is false.
    """
    for _ in range(60):
        middle = (low + high) / 2
        below = is_low(middle)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return (low + high) / 2


def exponential_quantile(gamma, quantile):
    """Quantile function of the density ∝ exp(γx) on 0 to 1."""
    return np.log1p(quantile * np.expm1(gamma)) / gamma


def draw_hours(days, cleanest, sine, normals):
    """Hourly clearness indices of days, by the TAG model.

    Parameters
    ----------
    days : numpy.ndarray, (p, d)
        Clearness index of each day.
    cleanest : numpy.ndarray, (p, d, 24)
        Clearness index of each hour under the cleanest sky.
    sine : numpy.ndarray, (p, d, 24)
        Sine of the sun's elevation, 0 at night.
    normals : numpy.ndarray, (d, 24)
        Independent standard normal numbers.

    Returns
    -------
    numpy.ndarray, (p, d, 24)
        From 0 to `cleanest`. They do not add up to the sums of the days yet.

    Notes
    -----
    R. Aguiar, M. Collares-Pereira, :doi:`10.1016/0038-092X(92)90068-L`: mean, standard deviation
    and autocorrelation of a truncated normal distribution by day and elevation. It is truncated by
    its quantiles, without resampling, and at the cleanest sky instead of a cosine of the hour.
    """
    # Mean and standard deviation of the hours of a day, by its clearness and the sun's height.
    # above 1 only by rounding, on days with the sun hardly above the horizon
    day = np.minimum(days, 1.0)[..., None]
    offset = -0.19 + 1.12 * day + 0.24 * np.exp(-8 * day)  # λ
    height = 0.32 - 1.6 * (day - 0.5) ** 2  # ε
    depth = 0.19 + 2.27 * day**2 - 2.51 * day**3  # κ
    mean = offset + height * np.exp(-depth / np.maximum(sine, 1e-3))
    spread = (
        0.14
        * np.exp(-20 * (day - 0.35) ** 2)
        * np.exp((3 * (day - 0.45) ** 2 + 16 * day**5) * (1 - sine))
    )
    # Autoregression of first order within the day: standard normal numbers that remember the hour
    # before.
    memory = 0.38 + 0.06 * np.cos(7.4 * days - 2.5)  # φ
    chain = np.empty(mean.shape)
    last = np.broadcast_to(normals[:, 0], days.shape)
    for hour in range(24):
        last = chain[..., hour] = memory * last + np.sqrt(1 - memory**2) * normals[:, hour]
    # They become quantiles of the normal distribution cut off at 0 and at the cleanest sky: `below`
    # is its share under 0, `up_to` its share under the cleanest.
    below, up_to = ndtr(-mean / spread), ndtr((cleanest - mean) / spread)
    quantile = np.clip(below + ndtr(chain) * (up_to - below), 1e-12, 1 - 1e-12)
    return np.clip(mean + spread * ndtri(quantile), 0.0, cleanest)


def scale_to_sums(clearness, cleanest, outside, sums, starts):
    """Scale clearness indices by one factor for each period, limited to the cleanest sky's.

    Parameters
    ----------
    clearness, cleanest, outside : numpy.ndarray, (p, t)
        Clearness index, its upper limit, and the corresponding extraterrestrial irradiance [Wm⁻²].
    sums : numpy.ndarray, (p, k)
        Wanted sum of clearness · outside of each period; limited to the cleanest sky's.
    starts : numpy.ndarray, (k,)
        First index of each period.

    Returns
    -------
    numpy.ndarray, (p, t)
    """
    length = np.diff(np.append(starts, clearness.shape[1]))
    # Periods without any light are not scaled; those that were drawn completely dark get a small
    # value to scale.
    clearness = np.minimum(np.maximum(clearness, 1e-3), cleanest)

    # The sum of a period grows with its factor, whose logarithm is found by bisection.
    def scale(logarithm):
        return np.minimum(clearness * np.repeat(np.exp(logarithm), length, axis=1), cleanest)

    ends = np.full(sums.shape, -8.0), np.full(sums.shape, 8.0)
    return scale(
        bisect(lambda one: np.add.reduceat(scale(one) * outside, starts, axis=1) < sums, *ends)
    )
