"""`sky-rays` and `shadow-rays`: what stands between the patches and the sky, and between them and the suns.

Patches with nothing in front of their plane send no hemisphere rays, since what they see has a closed form
(`closed_form`); they see every sun in front of it. Suns behind the plane are never seen.
"""

import numpy as np

from .closed_form import find_unobstructed
from .effect import Effect

SKY, SHADOW = "sky-rays", "shadow-rays"
FORWARD = "the forward estimator follows light from its source"


def decide_sky(inputs):
    """On where something can stand in the way."""
    count, plan = len(inputs.patches), inputs.plan
    if inputs.request.estimator == "forward":
        plan.unobstructed = np.zeros(count, bool)
        return Effect(SKY, True, "photons on all patches", FORWARD, 0.0)
    if inputs.asked(SKY):
        plan.unobstructed = np.zeros(count, bool)
        return Effect(SKY, True, f"rays from all {count:,} patches", "switched on", 0.0)
    if inputs.asked(SKY) is False:
        plan.unobstructed = np.ones(count, bool)
        return Effect(SKY, False, "no rays: no surface is seen", "switched off", None)
    plan.unobstructed = found = unobstructed_patches(inputs)
    extent = f"rays from {some_of(count - found.sum(), count)}"
    return Effect(SKY, not found.all(), extent, reason_of(found), 0.0)


def decide_shadow(inputs):
    """On where something can stand in the way."""
    count, plan = len(inputs.patches), inputs.plan
    if inputs.request.estimator == "forward":
        plan.open_to_suns = np.zeros(count, bool)
        return Effect(SHADOW, True, "photons on all patches", FORWARD, 0.0)
    if inputs.asked(SHADOW):
        plan.open_to_suns, plan.suns_behind = np.zeros(count, bool), True
        return Effect(SHADOW, True, f"rays from all {count:,} patches to all suns", "switched on", 0.0)
    if inputs.asked(SHADOW) is False:
        plan.open_to_suns = np.ones(count, bool)
        return Effect(SHADOW, False, "no rays: no shadow is cast", "switched off", None)
    plan.open_to_suns = found = plan.unobstructed if inputs.asked(SKY) is None else unobstructed_patches(inputs)
    extent = f"rays from {some_of(count - found.sum(), count)} to suns in front of them"
    return Effect(SHADOW, not found.all(), extent, reason_of(found), 0.0)


def unobstructed_patches(inputs):
    """Patches with neither a part of the scene nor a crown in front of them: (p,) bool."""
    vertices, foliage = inputs.scene.vertices, inputs.plan.foliage
    if foliage is not None:
        vertices = np.concatenate([vertices, foliage.crowns.vertices])
    return find_unobstructed(inputs.patches, vertices)


def some_of(some, count):
    """How many of all patches, in words."""
    if some == count:
        return f"all {count:,} patches"
    return f"{some:,} of {count:,} patches" if some else f"none of {count:,} patches"


def reason_of(unobstructed):
    """Why all patches, some or none of them need rays."""
    if unobstructed.all():
        return "nothing stands in front of any patch"
    return "nothing stands in front of the others" if unobstructed.any() else "something stands in front of all of them"
