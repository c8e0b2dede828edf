"""`reflections`: how often light is followed from surface to surface."""

from .effect import Effect

KEY = "reflections"
AUTOMATIC_REMAINDER = 0.005  # share of the first light that automatic bounces may leave out
MOST_BOUNCES = 50
NONE = "no bounce, no matrix"


def decide(inputs):
    """How many bounces, from the brightest albedo: what n bounces leave out is at most ρⁿ⁺¹/(1 - ρ)."""
    request = inputs.request
    ground_albedo = request.ground_albedo if request.far_ground else 0.0
    brightest = max(float(inputs.patches.albedo.max(initial=0)), ground_albedo)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(KEY):
        return Effect(KEY, False, NONE, "every albedo is 0", 0.0, setting=0)
    if not inputs.asked(KEY, count != 0):
        return Effect(KEY, False, NONE, "switched off", remainder(brightest, 0), setting=0)
    reason = "as asked"
    if count is None or count == 0:
        # ρⁿ⁺¹/(1 - ρ) ≤ ε, written so that it holds for no n at ρ = 1.
        enough = (n for n in range(1, MOST_BOUNCES) if brightest ** (n + 1) <= AUTOMATIC_REMAINDER * (1 - brightest))
        count = next(enough, None)
        reason = f"the fewest that leave out at most {AUTOMATIC_REMAINDER:.1%} at the brightest albedo {brightest:g}"
        if count is None:
            count, reason = MOST_BOUNCES, f"the most that are followed, for the brightest albedo is {brightest:g}"
    words = f"{count} bounce{'s' if count != 1 else ''}"
    return Effect(KEY, True, words, reason, remainder(brightest, count), setting=count)


def remainder(albedo, bounces):
    """What lies beyond the last bounce at most, as a share of the first light; None where it has no bound."""
    return albedo ** (bounces + 1) / (1 - albedo) if albedo < 1 else None
