"""`reflections`: how often light is followed from surface to surface."""

from .effect import Effect
from .pilot import LONGEST, share_beyond

KEY = "reflections"
WHOLE_TARGET = 0.002  # share of the light of all receivers that automatic reflections may leave out
GROUP_TARGET = 0.005  # of those of one kind and orientation
CERTAINTY = 2  # standard errors added to what the pilot measures
NONE = "no bounce, no matrix"


def decide(inputs):
    """How many bounces: as asked, or the fewest beyond which the pilot finds next to no light."""
    request = inputs.request
    ground_albedo = request.ground_albedo if inputs.asked("far-ground", request.far_ground) else 0.0
    brightest = max(float(inputs.patches.albedo.max(initial=0)), ground_albedo)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(KEY):
        return Effect(KEY, False, NONE, "every albedo is 0", 0.0, setting=0, share=0.0)
    share = expected_share(inputs)
    if not inputs.asked(KEY, count != 0):
        bound = bound_beyond(inputs.pilot_if_wanted, 0, brightest)
        return Effect(KEY, False, NONE, "switched off", bound, setting=0, share=share)
    reason = "as asked"
    if count is None or count == 0:
        count, reason = choose_count(inputs, brightest)
    bound = 0.0 if inputs.unshaded else bound_beyond(inputs.pilot_if_wanted, count, brightest)
    words = f"{count} bounce{'s' if count != 1 else ''}"
    return Effect(KEY, True, words, reason, bound, setting=count, share=share)


def choose_count(inputs, brightest):
    """Number of bounces and the reason for it."""
    if inputs.unshaded:
        return 1, "nothing but the far ground stands in front of the surfaces"
    for count in range(1, LONGEST):
        bound = bound_beyond(inputs.pilot, count, brightest)
        whole = left_out(inputs.pilot, count, brightest)
        if bound is not None and bound <= GROUP_TARGET and whole <= WHOLE_TARGET:
            words = f"a pilot finds at most {100 * whole:.2f} % of the light beyond, {100 * bound:.2f} % of any group's"
            return count, words
    return LONGEST, "the most that are followed; the pilot finds light beyond them"


def left_out(pilot, count, brightest, members=slice(None)):
    """Share of light beyond a number of bounces, with its uncertainty; None if paths are still on their way."""
    share, error = share_beyond(pilot, count, members)
    alive = float(pilot.weight[members] @ pilot.alive[members])
    if alive and brightest >= 1:
        return None
    first = float(pilot.weight[members] @ pilot.sky[members, 0]) or 1.0
    return share + CERTAINTY * error + (alive / (1 - brightest) / first if alive else 0.0)


def bound_beyond(pilot, count, brightest):
    """The largest share of light that any group of receivers loses beyond a number of bounces.

    Without a pilot the worst case: ρⁿ⁺¹/(1 - ρ) of the first light, at the brightest albedo. None: no bound exists.
    """
    if pilot is None:
        return brightest ** (count + 1) / (1 - brightest) if brightest < 1 else None
    found = [left_out(pilot, count, brightest, pilot.group == index) for index in range(len(pilot.groups))]
    return None if None in found else max(found)


def expected_share(inputs):
    """Share of full load hours that reflections between surfaces make, without the far ground's first one."""
    pilot = inputs.pilot_if_wanted
    if pilot is None:
        return None
    ratio = inputs.direct_over_diffuse
    light = pilot.weight @ (pilot.sky.astype(float) + ratio * pilot.sun)
    far = pilot.weight @ (pilot.far_sky.astype(float) + ratio * pilot.far_sun)
    return float((light[1:].sum() - far) / light.sum()) if light.sum() > 0 else None
