"""`reflections`: how often light is followed from surface to surface."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from ..sun.plausible_years import even_year, hours_of_suns, plausible_years
from ..sun.sky_models import split_sky
from ..sun.terrain_loss import sunlit_year
from .effect import Effect

KEY = "reflections"
LEFT = 0.002  # share of light that automatic reflections may leave out
LONGEST = 50
NONE = "no bounce, no matrix"


def decide(inputs):
    """How many bounces: as asked, or as many as the brightest albedo calls for."""
    request, plan = inputs.request, inputs.plan
    brightest = max(float(inputs.patches.albedo.max(initial=0)), inputs.far_ground_albedo)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(KEY):
        return Effect(KEY, False, NONE, "every albedo is 0", 0.0, share=0.0)
    if not inputs.asked(KEY, count != 0):
        return Effect(KEY, False, NONE, "switched off", bound_beyond(0, brightest))
    reason = "as asked"
    if not count:
        count, reason = 1, "nothing but the far ground stands in front of the surfaces"
        if not inputs.unshaded:
            counts = range(1, LONGEST)
            count = next((one for one in counts if (bound_beyond(one, brightest) or 1) <= LEFT), LONGEST)
            reason = f"at an albedo of {brightest:g} no more matter"
    plan.max_bounces = count
    bound = 0.0 if inputs.unshaded else bound_beyond(count, brightest)
    return Effect(KEY, True, f"{count} bounce{'s' if count != 1 else ''}", reason, bound)


def bound_beyond(count, brightest):
    """Share of light beyond a number of bounces at most, ρⁿ⁺¹/(1 - ρ) of the first light; None: no bound exists."""
    return brightest ** (count + 1) / (1 - brightest) if brightest < 1 else None
