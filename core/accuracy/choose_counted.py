"""Adaptive sampling: which surfaces further rounds are for.

A surface whose error is well within the target gets no more samples: it only passes light on. Whether it is, rounds
before tell. Few samples may tell too small an error, and surfaces would be left out just where they do; so the variance
of each is drawn towards that of the others, the limit is below the target, and none is left out after few samples.
"""

import numpy as np

from .yield_errors import SAMPLED, quantile_by_area

LEAST_RAYS, LEAST_POINTS = 256, 16  # of all rounds, and of one: patches are resolved into as many elements as points
SAFETY = 0.7  # of the target
FREEDOM = 3  # degrees of freedom of a surface's own estimate, from four replicates
TYPICAL = 3  # the same, of the median of all surfaces
BY_OTHERS = 0.3  # of the sampled variance: more is lowered by tracing all surfaces again
HOPELESS = 0.3  # of the variance that no sample lowers


def choose_counted(errors, request, target, surfaces, before=None):
    """Surfaces whose error further samples are to lower.

    Parameters
    ----------
    errors : YieldErrors
        By the rounds so far.
    request : Request
    target : float
        [%] of full load hours, on 95 % of the eligible area.
    surfaces : Surfaces
    before : (n,) bool, optional
        Surfaces that the last round was for; all if not given. None of the others is taken up again, since its samples
        would not go on.

    Returns
    -------
    (n,) bool or None
        Those to be traced alone; None: all, also where light that others pass on makes much of their error.
    """
    last = max(errors.rounds // 2, 1) * request.shadow_samples  # points of the last round, and so its elements
    few = errors.rounds * request.samples < LEAST_RAYS or last < LEAST_POINTS
    if few:
        return None
    relative = {name: 1e4 * part / errors.hours**2 for name, part in errors.variance.items()}  # [%²]
    sampled = sum(relative[name] for name in SAMPLED)
    fixed = sum(part for name, part in relative.items() if name not in SAMPLED)
    typical = quantile_by_area(sampled, errors.area, 0.5)
    smooth = (FREEDOM * sampled + TYPICAL * typical) / (FREEDOM + TYPICAL)
    allowed = np.maximum((SAFETY * target) ** 2 - fixed, HOPELESS * fixed)
    counted = np.zeros(len(surfaces), bool) if request.report == "eligible" else ~surfaces.eligible
    counted[errors.rows] = smooth > allowed
    counted = counted if before is None else counted & before
    rows = counted[errors.rows]
    by_others, of_all = (errors.area[rows] @ part[rows] for part in (relative["passed_on"], sampled))
    return counted if by_others < BY_OTHERS * of_all or not rows.any() else None
