"""`reflections`: how often light is followed from surface to surface."""

from .effect import Effect

KEY = "reflections"
WHOLE_LIMIT = 0.002  # share of the light of all receivers that reflections may leave out
GROUP_LIMIT = 0.005  # of those of one kind and orientation
MOST_BOUNCES = 50
NONE = "no bounce, no matrix"


def decide(inputs):
    """How many bounces: as asked, or None: until the solver finds that next to no light is left."""
    request = inputs.request
    brightest = max(float(inputs.patches.albedo.max(initial=0)), inputs.far_ground_albedo)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(KEY):
        inputs.plan.max_bounces = 0
        return Effect(KEY, False, NONE, "every albedo is 0", 0.0, share=0.0)
    if not inputs.asked(KEY, count != 0):
        inputs.plan.max_bounces = 0
        return Effect(KEY, False, NONE, "switched off", bound_beyond(0, brightest))
    if count:
        words = f"{count} bounce{'s' if count != 1 else ''}"
        inputs.plan.max_bounces = count
        return Effect(KEY, True, words, "as asked", bound_beyond(count, brightest))
    words = f"until what is left is below {100 * WHOLE_LIMIT:g} %"
    inputs.plan.max_bounces = None
    return Effect(KEY, True, words, "the light that is still on its way tells", GROUP_LIMIT)


def bound_beyond(count, brightest):
    """The largest share of light beyond a number of bounces: ρⁿ⁺¹/(1 - ρ) of the first light; None: no bound exists."""
    return brightest ** (count + 1) / (1 - brightest) if brightest < 1 else None


def count_surely(brightest):
    """The fewest bounces beyond which that bound is below WHOLE_LIMIT, at most MOST_BOUNCES."""
    if brightest >= 1:
        return MOST_BOUNCES
    return next((n for n in range(1, MOST_BOUNCES) if bound_beyond(n, brightest) <= WHOLE_LIMIT), MOST_BOUNCES)
