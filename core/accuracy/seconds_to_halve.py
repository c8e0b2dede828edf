"""Seconds of further rounds after which the standard error of each surface is half of what it is."""

import numpy as np

from ..energy.standard_errors import carry_to_hours, sun_sampling_share
from ..light.transfer import variance_of_mean
from ..sky.sky_models import split_sky

ONCE = ("plan and tree",)  # stages that rounds do not repeat


def seconds_to_halve(transfer, weather, energy):
    """Time of further rounds that halve the standard error of the full load hours of each surface.

    Rounds lower the variance S from rays and shadow points; that of patch sizes and of the choice of suns, F, stays.
    After k times the rounds so far it is S / k + F, which is a quarter of S + F for k = 4 S / (S - 3 F): where F is
    nothing, after three times the time so far.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    energy : Energy
        Of both.

    Returns
    -------
    numpy.ndarray, (n,)
        [s] of the computer that traced; inf where no number of rounds is enough, NaN without full load hours, without
        an error, or where no times are known.
    """
    hours = energy.full_load_hours
    own, passed_on, discretisation, _ = carry_to_hours(
        transfer, weather, hours, energy.poa_global_annual, energy.years, sky=split_sky(weather, energy.sky)
    )
    names = zip(np.asarray(transfer.surfaces.kind), np.asarray(transfer.surfaces.orientation), strict=True)
    rms = np.array([sun_sampling_share(transfer.record, name, "rms") for name in names])
    sampled = own + variance_of_mean(passed_on)
    return times_more(sampled, discretisation**2 + (rms * hours) ** 2) * seconds_of_rounds(transfer)


def times_more(sampled, fixed):
    """How many times the rounds so far have to be added to halve √(sampled + fixed): (n,), NaN for no error."""
    spare = sampled - 3.0 * fixed
    with np.errstate(divide="ignore", invalid="ignore"):
        more = np.where(spare > 0, 4.0 * sampled / spare - 1.0, np.inf)
    return np.where(sampled + fixed > 0, more, np.nan)


def seconds_of_rounds(transfer):
    """Time that the rounds of a Transfer took, in both states of its trees [s]; NaN if it is not known."""
    if transfer.record is None:
        return np.nan
    own = sum(seconds for stage, seconds in transfer.record.seconds.items() if stage not in ONCE)
    return own + (seconds_of_rounds(transfer.bare) if transfer.bare is not None else 0.0)
