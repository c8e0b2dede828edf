"""Which effects a scene calls for, decided before the first ray, each with a reason and a bound."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .closed_form import find_unobstructed

AUTOMATIC_REMAINDER = 0.005  # share of the first light that automatic bounces may leave out
MOST_BOUNCES = 50
FORWARD_REASON = "the forward estimator follows light from its source"


@dataclass
class Effect:
    """One decision of the plan."""

    key: str
    on: bool
    extent: str  # how far it goes: "3 bounces", "812 of 20,133 patches"
    reason: str
    bound: float | None  # what switching it off or cutting it short leaves out, as a share of the first light


@dataclass
class EffectPlan:
    """What will be traced."""

    effects: list  # of Effect
    unobstructed: np.ndarray  # (p,) bool, patches in closed form
    max_bounces: int
    far_ground: bool
    suns_behind: bool

    @property
    def reflections(self):
        """Whether the matrix of form factors is needed."""
        return self.max_bounces > 0


KEYS = ("closed-form", "suns-behind", "reflections", "far-ground")
SHORTCUTS = ("closed-form", "suns-behind")  # of gather; photons fall wherever they fall


def plan_effects(scene, patches, request):
    """Decide what to trace.

    Parameters
    ----------
    scene : Scene
    patches : Patches
    request : Request

    Raises
    ------
    InputError
        If `request.effects` names an effect that does not exist.
    """
    for key in request.effects:
        if key not in KEYS:
            raise InputError("--effects", f"no effect is called {key!r}", f"use {', '.join(KEYS)}")
        if request.estimator == "forward" and key in SHORTCUTS and request.effects[key]:
            raise InputError("--effects", f"{key} is for gather only", "leave it out or use --estimator gather")
    reflections, max_bounces = plan_reflections(patches, request)
    far_ground = plan_far_ground(patches, request, max_bounces)
    closed_form, unobstructed = plan_closed_form(scene, patches, request)
    suns_behind = plan_suns_behind(request)
    return EffectPlan(
        effects=[closed_form, suns_behind, reflections, far_ground],
        unobstructed=unobstructed,
        max_bounces=max_bounces,
        far_ground=far_ground.on,
        suns_behind=suns_behind.on,
    )


def plan_reflections(patches, request):
    """How many bounces, from the brightest albedo: what n bounces leave out is at most ρⁿ⁺¹/(1 - ρ)."""
    brightest = max(float(patches.albedo.max(initial=0)), request.ground_albedo if request.far_ground else 0.0)
    count = request.max_bounces
    if brightest == 0 and not request.effects.get("reflections"):
        return Effect("reflections", False, "no bounce, no matrix", "every albedo is 0", 0.0), 0
    if not request.effects.get("reflections", count != 0):
        return Effect("reflections", False, "no bounce, no matrix", "switched off", remainder(brightest, 0)), 0
    reason = "as asked"
    if count is None or count == 0:
        # ρⁿ⁺¹/(1 - ρ) ≤ ε, written so that it holds for no n at ρ = 1.
        enough = (n for n in range(1, MOST_BOUNCES) if brightest ** (n + 1) <= AUTOMATIC_REMAINDER * (1 - brightest))
        count = next(enough, None)
        reason = f"the fewest that leave out at most {AUTOMATIC_REMAINDER:.1%} at the brightest albedo {brightest:g}"
        if count is None:
            count, reason = MOST_BOUNCES, f"the most that are followed, for the brightest albedo is {brightest:g}"
    words = f"{count} bounce{'s' if count != 1 else ''}"
    return Effect("reflections", True, words, reason, remainder(brightest, count)), count


def remainder(albedo, bounces):
    """What lies beyond the last bounce at most, as a share of the first light; None where it has no bound."""
    return albedo ** (bounces + 1) / (1 - albedo) if albedo < 1 else None


def plan_far_ground(patches, request, max_bounces):
    """Light from the open ground beyond the scene: half of what a wall's lower hemisphere can see."""
    bound = request.ground_albedo / 2
    if not request.effects.get("far-ground", request.far_ground):
        return Effect("far-ground", False, "none", "switched off: rays that leave downwards carry nothing", bound)
    if max_bounces == 0:
        return Effect("far-ground", False, "none", "it only shines by reflection, and nothing is reflected", 0.0)
    return Effect("far-ground", True, "once reflected", "rays that leave downwards meet unshaded ground", 0.0)


def plan_closed_form(scene, patches, request):
    """Patches with nothing in front of them need no ray."""
    count = len(patches)
    if request.estimator == "forward":
        nothing = np.zeros(count, bool)
        return Effect("closed-form", False, f"photons for all {count:,} patches", FORWARD_REASON, 0.0), nothing
    if not request.effects.get("closed-form", True):
        return Effect("closed-form", False, f"rays for all {count:,} patches", "switched off", 0.0), np.zeros(
            count, bool
        )
    unobstructed = find_unobstructed(patches, scene.vertices)
    extent = f"{unobstructed.sum():,} of {count:,} patches without a ray"
    return Effect("closed-form", bool(unobstructed.any()), extent, "nothing stands in front of them", 0.0), unobstructed


def plan_suns_behind(request):
    """A sun behind a patch cannot be seen from it."""
    if request.estimator == "forward":
        return Effect("suns-behind", False, "photons that meet a back end there", FORWARD_REASON, 0.0)
    if request.effects.get("suns-behind", False):
        return Effect("suns-behind", True, "a shadow ray for every sun", "switched on", 0.0)
    return Effect("suns-behind", False, "no shadow ray for a sun behind a face", "it cannot be seen", 0.0)


def describe_plan(plan):
    """The plan in lines of text."""
    lines = []
    for effect in plan.effects:
        bound = "without bound" if effect.bound is None else f"leaves out at most {effect.bound:.2%}"
        state = "on " if effect.on else "off"
        lines.append(f"{effect.key:<12} {state}  {effect.extent}: {effect.reason} ({bound})")
    return lines
