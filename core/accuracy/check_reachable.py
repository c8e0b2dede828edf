"""Whether a target of accuracy can be reached, told before the run from a pilot.

    a run of the whole city with few rays ─► error that the patch size leaves ───────────┐
                                                                                         ├─► more than the target?
    some patches of the city, the suns    and every hour's ─► error by the choice of suns ─┘

Both stay, whatever the number of rays. A target is said to be out of reach only where what stays exceeds it clearly.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from ..settings.progress import silent
from .price_list import price_city
from .refine import CELLS, unreachable
from .sun_sampling import LOOKED_AT
from .yield_errors import SAMPLED

BETTER = ("days:24", "days:52", "hourly")  # choices of suns to propose
FINER = (1, 2, 4, 8)  # divisors of the patch size to propose: its error falls with the length at least


def check_reachable(inputs, progress=silent):
    """Tell that no number of rays reaches the target of a request, and the options that would.

    Parameters
    ----------
    inputs : CityYear
        The Request with a target.
    progress : callable

    Returns
    -------
    str
        "" if the target can be reached, or that is not certain.
    """
    request = inputs.request
    if not np.any(inputs.scene.surfaces.eligible):
        return ""
    city = price_city(inputs, list(dict.fromkeys([request.suns, *BETTER])), progress, LOOKED_AT)
    count, errors, run = len(city.suns[request.suns]), {}, city.pilot.run
    of_pilot = replace(request, samples=run.samples, shadow_samples=run.shadow_samples)
    for way, suns in city.suns.items():
        if way != request.suns and len(suns) <= count:
            continue
        errors[way] = city.predict_errors(city.knobs_of(of_pilot, way))
        if request.estimator == "forward":  # photons are not bound to patches
            errors[way].variance["discretisation"] = np.zeros(len(errors[way].hours))
    why = unreachable(errors[request.suns], request.target_error, CELLS)
    if why is None:
        return ""
    return f"{request.target_error:g} % cannot be reached: {why[0]}; {find_cure(errors, request)}"


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
