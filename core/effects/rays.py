"""Which patches send how many rays, `sky-rays`, `shadow-rays` and `receivers`, and `reflections`.

Patches with nothing in front of their plane send no hemisphere rays, since what they see has a
closed form (`closed_form`); they see every sun in front of it. Suns behind the plane are never
seen. Surfaces whose numbers are wanted get all rays, the others as many as the reflections need of
them.
"""

from typing import NamedTuple

import numpy as np

from ..settings.errors import count_of
from .closed_form import find_unobstructed
from .effect import Effect


def decide_rays(inputs, key):
    """Rays to the sky or to the suns: on where something can stand in the way of them.

    Returns the Effect; the plan gets the patches, (p,) bool, that need none.
    """
    # Patches from which nothing is in the way: all where rays are switched off, none where they are
    # switched on or for photons, else by geometry, crowns of trees included. Rays to the suns take
    # the patches found for the sky, unless those were asked for.
    plan, count, asked = inputs.plan, len(inputs.patches), inputs.asked(key)
    forward = inputs.request.estimator == "forward"
    if asked is not None or forward:
        free = np.full(count, not (asked or forward))
    elif key == "sky-rays" or inputs.asked("sky-rays") is not None:
        vertices, foliage = inputs.scene.vertices, plan.foliage
        crowns = vertices[:0] if foliage is None else foliage.crowns.vertices
        free = find_unobstructed(inputs.patches, np.concatenate([vertices, crowns]))
    else:
        free = plan.unobstructed
    # Rays to the sky or to the suns are spared on these. Where rays to the suns are switched on,
    # they also go to suns behind a patch, unless photons are traced.
    if key == "sky-rays":
        plan.unobstructed, to, seen = free, "", "surface is seen"
    else:
        plan.open_to_suns, plan.suns_behind = free, bool(asked) and not forward
        to, seen = " to the suns", "shadow is cast"
    # Photons come from the light, whatever stands in the way.
    if forward:
        return Effect(
            key,
            True,
            "photons on all patches",
            "the forward estimator follows light from its source",
            0.0,
        )
    if asked is False:
        return Effect(key, False, f"no rays: no {seen}", "switched off", None)
    # How many patches send rays, and why.
    some = int(count - free.sum())
    front = (
        "nothing stands in front of the others"
        if some < count
        else "something stands in front of each of them"
    )
    reason = "switched on" if asked else front if some else "nothing stands in front of any patch"
    return Effect(
        key, some > 0 or bool(asked), f"rays from {some:,} of {count:,} patches{to}", reason, 0.0
    )


RECEIVERS, REFLECTIONS = "receivers", "reflections"


def decide_receivers(inputs):
    """All rays for eligible surfaces, flat roofs and racks; a quarter of them for all others."""
    request, count = inputs.request, len(inputs.patches)
    if request.estimator == "forward":
        return Effect(
            RECEIVERS, False, "photons on all surfaces", "photons fall wherever they fall", 0.0
        )
    every = f"all rays from all {count:,} patches"
    if not inputs.asked(RECEIVERS, request.report == "eligible"):
        return Effect(RECEIVERS, False, every, "all are reported in full", 0.0)
    scene, surfaces = inputs.scene, inputs.scene.surfaces
    wanted = surfaces.eligible | np.isin(surfaces.kind, ("flat", "rack"))
    full = np.append(wanted, False)[scene.triangle_surface] & inputs.patches.receives & scene.own
    others = int((inputs.patches.receives & ~full).sum())
    if not others or not (full & inputs.patches.receives).any():
        return Effect(RECEIVERS, False, every, "they are of one kind", 0.0)
    inputs.plan.receivers = full
    extent = (
        f"{fewer_rays(request.samples)} of {request.samples} rays from {others:,} of {count:,} "
        "patches"
    )
    reason = "they carry no modules, and only pass light on"
    # Nothing is passed on to receivers that nothing stands in front of.
    return Effect(RECEIVERS, True, extent, reason, 0.0 if inputs.unshaded else None)


def fewer_rays(samples):
    """Hemisphere rays from each of the others."""
    # The other patches get four times fewer rays, and 64 at least, to resolve the light of 16
    # elements.
    return min(samples, max(64, samples // 4))


class _ReflectionLimits(NamedTuple):
    """Where reflections end."""

    whole: float = 0.002  # share of the light of all receivers that they may leave out
    group: float = 0.005  # of surfaces of one kind and orientation
    bounces: int = 50  # at most


LIMITS = _ReflectionLimits()

NO_BOUNCE = "no bounce, no matrix"


def decide_reflections(inputs):
    """How many bounces: as asked, or None: until the solver finds that next to no light is left."""
    request = inputs.request
    # beyond the scene
    ground = inputs.scene.ground_albedo if inputs.asked("far-ground", request.far_ground) else 0.0
    brightest = max(float(inputs.patches.albedo.max(initial=0)), ground)
    count = request.max_bounces
    if brightest == 0 and not inputs.asked(REFLECTIONS):
        inputs.plan.max_bounces = 0
        return Effect(REFLECTIONS, False, NO_BOUNCE, "every albedo is 0", 0.0, share=0.0)
    if not inputs.asked(REFLECTIONS, count != 0):
        inputs.plan.max_bounces = 0
        return Effect(REFLECTIONS, False, NO_BOUNCE, "switched off", _bound_beyond(0, brightest))
    inputs.plan.max_bounces = count or None
    if count:
        return Effect(
            REFLECTIONS,
            True,
            count_of(count, "bounce"),
            "as asked",
            _bound_beyond(count, brightest),
        )
    words = f"until what is left is below {100 * LIMITS.whole:g} %"
    return Effect(
        REFLECTIONS, True, words, "the light that is still on its way tells", LIMITS.group
    )


def _bound_beyond(count, brightest):
    """The largest share of light beyond a number of bounces: ρⁿ⁺¹/(1 - ρ) of the first light; None:
    no bound exists.
    """
    return brightest ** (count + 1) / (1 - brightest) if brightest < 1 else None


def count_surely(brightest):
    """The fewest bounces beyond which that bound is below LIMITS.whole, at most LIMITS.bounces."""
    if brightest >= 1:
        return LIMITS.bounces
    return next(
        (n for n in range(1, LIMITS.bounces) if _bound_beyond(n, brightest) <= LIMITS.whole),
        LIMITS.bounces,
    )
