"""Errors of the full load hours of single surfaces, apart by their source."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..energy.standard_errors import errors_of_energy
from ..light.transfer import variance_of_mean

# Sources that fall with every round, and the power of the number of samples with which their
# variance does: of digital nets, measured in Berlin and on the town. The others stay.
SAMPLED = {"shadows": 1.6, "rays": 1.3, "passed_on": 1.0}
SOURCES = {  # name -> words
    "shadows": "the shadows",
    "rays": "the sky rays",
    "passed_on": "the light that other surfaces reflect",
    "discretisation": "the patch size",
    "suns": "the choice of suns",
}
CURES = {  # name -> the option that lowers it
    "shadows": "more --shadow-samples",
    "rays": "more --samples",
    "passed_on": "more --samples",
    "discretisation": "a smaller --patch-size",
    "suns": "--suns with more days",
}


@dataclass
class YieldErrors:
    """Variances of the full load hours of e eligible surfaces [h²], by source."""

    variance: dict  # of SOURCES -> (e,) float64 [h²]
    hours: np.ndarray  # (e,) [h]
    area: np.ndarray  # (e,) [m²] counted area
    rounds: int  # samples, in units of the first round's
    rows: np.ndarray | None = None  # (e,) int, their surfaces
    power: dict = field(default_factory=lambda: SAMPLED)  # with which variances fall

    def relative(self, more=1.0, without=()):
        """Standard errors in percent of each surface's hours, with `more` times the samples: (e,)
        float64.
        """
        # Variances of independent sources add up; some fall with a power of the samples.
        total = np.zeros(len(self.hours))
        for source, variance in self.variance.items():
            if source not in without:
                total += variance / more ** self.power.get(source, 0)
        return 100 * np.sqrt(total) / self.hours

    def at_share(self, more=1.0, without=(), share=0.95):
        """Error [%] that this share of the area stays within; NaN if no surface counts."""
        return _quantile_by_area(self.relative(more, without), self.area, share)

    def largest(self):
        """The source without which the error that SHARE of the area stays within would be least, or
        None.

        A few surfaces with a large error of one kind, on less area than the rest, do not decide.
        """
        if not self.at_share() > 0:
            return None
        return min(self.variance, key=lambda source: self.at_share(without=[source]))

    def say_unreachable(self, target):
        """Why no number of rounds reaches a target [%], and the option that would help: str, ""
        where one may.
        """
        # Only what no round lowers decides; the cure is of its largest part.
        left = self.at_share(without=SAMPLED)
        if not CERTAIN * left > target:
            return ""
        fixed = replace(
            self, variance={name: self.variance[name] for name in SOURCES if name not in SAMPLED}
        )
        source = fixed.largest()
        words = f"{SOURCES[source]} alone leaves {left:.2f} % whatever the number of rays"
        return (
            f"{target:g} % cannot be reached: {words}; give {CURES[source]}, or a target above "
            f"{left:.2f}"
        )


def _quantile_by_area(values, area, share):
    """Smallest value that a share of the area does not exceed; NaN without area or if a value is
    unknown.
    """
    if not len(values) or np.isnan(values).any():
        return np.nan
    # Surfaces by their error; the one at which the share of the area is reached.
    order = np.argsort(values)
    covered = np.cumsum(area[order])
    return float(values[order][min(np.searchsorted(covered, share * covered[-1]), len(values) - 1)])


def split_errors(transfer, weather, energy):
    """Errors of the full load hours of eligible surfaces that have a tenth of the mean hours at
    least.

    Parameters
    ----------
    transfer : Transfer
        Its error parts may hold more rounds than `energy` was computed from.
    weather : Weather
    energy : Energy

    Returns
    -------
    YieldErrors
    """
    hours, record = energy.full_load_hours, transfer.record
    parts = _variances_of_hours(transfer, weather, energy)
    chosen, forward = (
        find_lit(energy),
        record is not None and record.request.get("estimator") == "forward",
    )
    return YieldErrors(
        {name: part[chosen] for name, part in parts.items()},
        hours[chosen],
        energy.counted_area[chosen],
        record.rounds if record else 1,
        np.flatnonzero(chosen),
        dict.fromkeys(SAMPLED, 1.0)
        if forward
        else SAMPLED,  # photons are independent from round to round
    )


def _variances_of_hours(transfer, weather, energy):
    """Variances of the full load hours of all surfaces by source: dict of SOURCES to (n,) float64
    [h²].
    """
    errors = errors_of_energy(transfer, weather, energy)
    return {
        "shadows": errors.points,
        "rays": errors.own - errors.points,
        "passed_on": variance_of_mean(errors.passed_on),
        "discretisation": errors.discretisation**2,
        "suns": errors.rms**2,
    }


def find_lit(energy):
    """Eligible surfaces with a tenth of the mean hours at least: (n,) bool."""
    # Mean hours by area; a tenth of it separates surfaces in deep shade, whose relative errors say
    # little.
    hours, area = energy.full_load_hours, np.where(energy.eligible, energy.counted_area, 0)
    counted = (area > 0) & np.isfinite(hours)
    if not counted.any():
        return counted
    # Surfaces with less than a tenth of the mean are left out of the errors of single surfaces.
    return (
        counted & (hours >= 0.1 * np.average(hours[counted], weights=area[counted])) & (hours > 0)
    )


def seconds_of_rounds(transfer):
    """Time that the rounds of a Transfer took, in both states of its trees [s]; NaN if it is not
    known.
    """
    if transfer.record is None:
        return np.nan
    # Rounds do not repeat the first stage.
    stages = transfer.record.seconds.items()
    own = sum(seconds for stage, seconds in stages if stage != "plan and tree")
    return own + (seconds_of_rounds(transfer.bare) if transfer.bare is not None else 0.0)


CERTAIN = 0.8  # of what no round lowers: it is itself an estimate
