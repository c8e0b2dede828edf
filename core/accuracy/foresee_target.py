"""Whether a target of accuracy can be reached, told before the run from a pilot.

    surfaces of a square in the middle of the city ─► error that the patch size leaves ──┐
                                                                                         ├─► more than the target?
    patches of the whole city, the suns and every hour's ─► error by the choice of suns ─┘

Both stay, whatever the number of rays. A target is said to be out of reach only where what stays, less its own standard
error, exceeds it.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from ..settings.progress import silent
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from .fill_untraced import fill_untraced
from .pilot import choose_neighbourhood
from .pilot_run import RUNS, trace_part
from .refine import CELLS, unreachable
from .sun_sampling import LOOKED_AT, TracedYear, measure_ways, name_groups, shares_of_names
from .yield_errors import SAMPLED

PATCHES, INNER = 4_000, 2_000  # of the square, and of its inner part
FEW_SUNS = "days:4"
BETTER = ("days:24", "days:52", "hourly")  # choices of suns to propose
FINER = (1, 2, 4, 8)  # divisors of the patch size to propose: its error falls with the length at least


def foresee_target(inputs, progress=silent):
    """Tell that no number of rays reaches the target of a request, and the options that would.

    Parameters
    ----------
    inputs : tuple of Scene, PreparedScene, Weather and Request
        The PreparedScene with its tree, the Request with a target.
    progress : callable

    Returns
    -------
    str
        "" if the target can be reached, or that is not certain.
    """
    scene, *_, request = inputs
    if not np.any(scene.surfaces.eligible):
        return ""
    run, transfer = trace_square(inputs, FEW_SUNS, progress)
    errors = run.errors
    names = name_groups(transfer.surfaces)

    def measure(ways):
        suns, found = measure_suns(inputs, transfer, ways, progress)
        return {
            way: (len(one), with_suns(errors, part, names)) for way, one, part in zip(ways, suns, found, strict=True)
        }

    count, given = measure([request.suns])[request.suns]
    why = unreachable(given, request.target_error, CELLS)
    if why is None:
        return ""
    better = {way: one for way, (many, one) in measure(BETTER).items() if many > count}
    cure = find_cure({request.suns: given, **better}, request)
    return f"{request.target_error:g} % cannot be reached: {why[0]}; {cure}"


def trace_square(inputs, way, progress):
    """PilotRun of a square in the middle of the city under suns chosen in some way, and its Transfer."""
    scene, prepared, weather, request = inputs
    suns = spread_suns(choose_suns(way, *weather.axis, request.seed, position=weather.data))
    square, counted = choose_neighbourhood(prepared, PATCHES, INNER)
    progress("pilot", 0, 1, "runs")
    run, transfer = trace_part((scene, prepared, weather, request, suns), square, RUNS["A"], counted)
    progress("pilot", 1, 1, "runs")
    if request.estimator == "forward":  # photons are not bound to patches
        nothing = np.zeros(len(run.errors.hours))
        run.errors.variance["discretisation"] = nothing
    return run, transfer


def measure_suns(inputs, transfer, ways, progress, patches=LOOKED_AT):
    """Suns of some ways to choose them, and what each does to full load hours, on some patches: two lists."""
    scene, prepared, weather, request = inputs
    suns = [choose_suns(way, *weather.axis, request.seed, position=weather.data) for way in ways]
    whole = fill_untraced(transfer, name_groups(transfer.surfaces))
    traced = TracedYear(scene, weather, whole, request)
    return suns, measure_ways(traced, suns, progress, prepared=prepared, patches=patches)


def with_suns(errors, measured, names):
    """YieldErrors with the error of a choice of suns, as `measure_ways` found it for kinds and orientations."""
    rms, doubt = (shares_of_names(measured, names[errors.rows], part) for part in ("rms", "rms_standard_error"))
    suns = (rms * errors.hours) ** 2
    return replace(
        errors, variance=errors.variance | {"suns": suns}, doubt=np.minimum(doubt / np.maximum(rms, 1e-9), 1)
    )


def find_cure(errors, request):
    """Options that bring what stays below the target, as text.

    Parameters
    ----------
    errors : dict
        Choice of suns -> YieldErrors; first that of the request.
    request : Request
    """
    size = request.patch_size
    for finer, way in product(FINER if size else FINER[:1], errors):
        part = errors[way].variance | {"discretisation": errors[way].variance["discretisation"] / finer**2}
        if replace(errors[way], variance=part).at_share(without=SAMPLED) < request.target_error:
            options = [f"--suns {way}"] * (way != request.suns) + [f"--patch-size {size / finer:g}"] * (finer > 1)
            return f"give {' '.join(options)}"
    left = replace(errors[way], variance=part).at_share(without=SAMPLED)
    words = f"--suns {way}" + (f" --patch-size {size / finer:g}" if size else "")
    return f"even {words} leaves {left:.2f} %, so give a larger target"
