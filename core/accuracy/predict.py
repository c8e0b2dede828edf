"""Seconds and errors of any settings, predicted from a pilot.

Cost: a run's time is that of its rays, shadow rays, and products with the matrix of form factors,

    t = overhead · suns + a₀ patches + a rays + suns · (b₀ patches + b shadow points + c entries · (1 + reflections))

where patches, rays, shadow points and entries of the matrix are those of the whole city (`survey`).

Error: the variance of each source falls with a power of the number of rays or points that the pilot shows; what the
size of patches leaves falls with the square of their length.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from .survey import work_of_city, work_of_patches
from .yield_errors import SOURCES, YieldErrors

USUAL = {"shadows": 1.6, "rays": 1.3, "passed_on": 1.0}  # exponents of variance where the pilot shows none
LEAST, MOST = 0.5, 2.0
LEAST_SECONDS = 0.05  # of the longest run's: shorter ones count no more
WRITING = 20e6  # [B/s] of tables and transfer.nc


@dataclass
class Knobs:
    """Settings whose price is asked."""

    samples: int
    shadow_samples: int
    suns: int  # number of positions
    way: str
    bounces: int
    patch_size: float | None
    rounds: int = 1


@dataclass
class Prices:
    """What a pilot says on processor time [s], which depends less on what else the machine does."""

    overhead: np.ndarray  # (2,) of the size of the city: once, and per sun
    sky: np.ndarray  # (2,) per patch; per hemisphere ray
    suns: np.ndarray  # (3,) per patch and sun; per shadow point and sun; per entry, sun and product with the matrix
    survey: object  # Survey
    wall: float  # of `wall_of`
    fixed: float  # reading, preparing, sun sampling, electricity: all but tracing
    size: float | None  # patch size of the pilot [m]
    bytes_per_sun: float  # of the matrices


def price_pilot(pilot, fixed, patch_size, surfaces):
    """Prices from the runs of a pilot.

    Parameters
    ----------
    pilot : Pilot
    fixed : float
        What does not depend on the settings of tracing [s].
    patch_size : float or None
    surfaces : int
    """
    runs, survey = pilot.timed, pilot.survey
    works = [work_of_patches(survey, run.counts, run.samples, run.shadow_samples) for run in runs]
    terms = np.array([terms_of_suns(work, run.bounces, run.suns) for work, run in zip(works, runs, strict=True)])
    # Threads go through arrays of all patches for every sun, the main thread once.
    whole = {stage: time_of_arrays(pilot.empty, stage) for stage in (of_sky, of_suns, threads_of_suns)}
    per_sun = whole[threads_of_suns] / runs[0].suns
    overhead = np.array([whole[of_sky] + whole[of_suns] - whole[threads_of_suns], per_sun])
    return Prices(
        overhead=overhead,
        sky=fit_costs(np.array([(work.patches, work.rays) for work in works]), beyond_arrays(pilot, threads_of_sky)),
        suns=fit_costs(terms, beyond_arrays(pilot, threads_of_suns)),
        survey=survey,
        wall=wall_of(runs),
        fixed=fixed,
        size=patch_size,
        bytes_per_sun=8.0 * surfaces,
    )


def terms_of_suns(work, bounces, suns):
    """What the costs of the suns are multiplied with."""
    return work.patches * suns, work.points * suns, work.entries * suns * (1 + bounces)


def of_suns(run):
    """Processor time of the suns [s]."""
    return run.processor_seconds["suns"]


def of_sky(run):
    """Processor time of everything else that grows with the patches traced [s]."""
    seconds = run.processor_seconds
    return sum(seconds.values()) - seconds["suns"] - seconds["plan and tree"]


def threads_of_suns(run):
    """The same without the main thread."""
    return max(of_suns(run) - run.main_seconds[1], 0.0)


def threads_of_sky(run):
    """The same without the main thread."""
    return max(of_sky(run) - run.main_seconds[0], 0.0)


def time_of_arrays(empty, stage, share=1.0):
    """Time of a stage of a run of hardly a patch, with rows of a share of the city's patches: float [s].

    It grows linearly with the rows.
    """
    few, many = empty
    growth = (stage(many) - stage(few)) / max(many.share - few.share, 1e-9)
    return stage(few) + max(growth, 0.0) * (share - few.share)


def beyond_arrays(pilot, stage):
    """Time of a stage of each timed run, less what its arrays take whatever is traced: (runs,) float64 [s]."""
    return np.array([max(stage(run) - time_of_arrays(pilot.empty, stage, run.share), 0.0) for run in pilot.timed])


def wall_of(runs):
    """Wall time of the threads over their processor time, without what the main thread does alone: float.

    It is that of the part of the runs, sky or suns, in which the threads shared their work best, as if each of them had
    had work all the time: in a run of the whole city they have.
    """
    ratios = []
    for run in runs:
        (wall, wall_of_suns), (processor, of_them) = map(split_stages, (run.seconds, run.processor_seconds))
        alone, alone_with_suns = run.main_seconds
        ratios.append(run.shared[0] * (wall - alone) / max(processor - alone, 1e-9))
        ratios.append(run.shared[1] * (wall_of_suns - alone_with_suns) / max(of_them - alone_with_suns, 1e-9))
    return max(min(ratios), 1 / runs[0].threads)


def split_stages(seconds):
    """Seconds of all stages before the suns, and of the suns: two float."""
    return sum(seconds.values()) - seconds["suns"], seconds["suns"]


def fit_costs(terms, seconds):
    """Costs that are not negative and explain the seconds of some runs; relative deviations count alike."""
    scale = np.maximum(seconds, LEAST_SECONDS * max(seconds.max(), 1e-6))
    return nnls(terms / scale[:, None], seconds / scale)[0]


def predict_seconds(prices, knobs):
    """Wall and processor time of tracing, and wall time of the whole run [s]: three float."""
    growth = 1.0 if None in (prices.size, knobs.patch_size) else max((prices.size / knobs.patch_size) ** 2, 0.3)
    work = work_of_city(prices.survey, knobs.samples, knobs.shadow_samples)
    sky = prices.sky @ (work.patches, work.rays)
    suns = prices.suns @ terms_of_suns(work, knobs.bounces, knobs.suns)
    alone, per_sun = prices.overhead
    threads = growth * (sky + suns) + per_sun * knobs.suns
    processor, wall = knobs.rounds * (threads + alone), knobs.rounds * (threads * prices.wall + alone)
    return wall, processor, wall + prices.fixed + prices.bytes_per_sun * knobs.suns / WRITING


def predict_errors(pilot, knobs, sampling, patch_size):
    """Errors of the surfaces of the pilot with other settings.

    Parameters
    ----------
    pilot : Pilot
    knobs : Knobs
    sampling : (e,) float
        Error of this choice of suns for each surface, as a share of its hours.
    patch_size : float or None
        Of the pilot [m].

    Returns
    -------
    YieldErrors
    """
    fine, coarse = pilot.runs["A"], pilot.runs["C"]
    variance = fine.errors.variance
    rays, points = (samples_factor(fine, coarse, source) for source in ("rays", "shadows"))
    passed_on = samples_factor(fine, coarse, "passed_on") / 2  # rays and points together: each alone half of it
    length = 1.0 if None in (patch_size, knobs.patch_size) else knobs.patch_size / patch_size
    elements = fine if knobs.shadow_samples >= fine.shadow_samples else coarse
    more = knobs.samples / fine.samples, knobs.shadow_samples / fine.shadow_samples
    # A patch of half the length has a quarter of the area, and a surface four times the patches.
    parts = {
        "rays": variance["rays"] * more[0] ** -rays * length**2 / knobs.rounds,
        "shadows": variance["shadows"] * more[1] ** -points * length**2 / knobs.rounds,
        "passed_on": variance["passed_on"] * (more[0] * more[1]) ** -passed_on * length**2 / knobs.rounds,
        "discretisation": shared_rows(pilot, elements) * length**2,
        "suns": (sampling * fine.errors.hours) ** 2,
    }
    hours, area = fine.errors.hours, fine.errors.area
    return YieldErrors({name: parts[name] for name in SOURCES}, hours, area, knobs.rounds)


def shared_rows(pilot, run):
    """Discretisation variance of a run on the surfaces of run A: its own, or that of A grown like the mean."""
    fine = pilot.runs["A"].errors
    if run.errors is fine or len(run.errors.hours) == len(fine.hours):
        return run.errors.variance["discretisation"]
    return (
        fine.variance["discretisation"]
        * mean_variance(run, "discretisation")
        / max(mean_variance(pilot.runs["A"], "discretisation"), 1e-12)
    )


def samples_factor(more, fewer, source):
    """Exponent with which a variance falls from a run to one of as many times the rays as points, LEAST to MOST."""
    ratio = more.samples / fewer.samples
    high, low = mean_variance(fewer, source), mean_variance(more, source)
    if not (high > 0 and low > 0):
        return USUAL[source]
    return float(np.clip(np.log(high / low) / np.log(ratio), LEAST, MOST))


def mean_variance(run, source):
    """Mean relative variance by area, without the worst hundredth of the surfaces."""
    errors = run.errors
    if not len(errors.hours):
        return 0.0
    relative = errors.variance[source] / errors.hours**2
    usual = relative <= np.quantile(relative, 0.99)
    return float(np.average(relative[usual], weights=errors.area[usual]))


def left_by_bounces(pilot, bounces):
    """Share of the light that reflections after so many would add, from the last of runs A and C: float.

    From reflection to reflection light falls by the same factor.
    """
    one, many = pilot.runs["C"], pilot.runs["A"]
    if not (one.last_bounce > 0 and many.bounces > one.bounces):
        return one.last_bounce
    factor = min((many.last_bounce / one.last_bounce) ** (1 / (many.bounces - one.bounces)), 0.99)
    return one.last_bounce * factor ** (bounces - one.bounces + 1) / (1 - factor)
