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
    inputs.plan.unobstructed, effect = decide_rays(inputs, SKY, "", "no rays: no surface is seen")
    return effect


def decide_shadow(inputs):
    """On where something can stand in the way."""
    plan, to = inputs.plan, " to all suns" if inputs.asked(SHADOW) else " to suns in front of them"
    plan.suns_behind = bool(inputs.asked(SHADOW)) and inputs.request.estimator != "forward"
    plan.open_to_suns, effect = decide_rays(inputs, SHADOW, to, "no rays: no shadow is cast")
    return effect


def decide_rays(inputs, key, to, off):
    """Patches that need no rays of a kind, (p,) bool, and the Effect.

    Parameters
    ----------
    inputs : Inputs
    key : str
    to, off : str
        Where the rays go, and what it means that there are none, in words.
    """
    count, asked = len(inputs.patches), inputs.asked(key)
    if inputs.request.estimator == "forward":
        return np.zeros(count, bool), Effect(key, True, "photons on all patches", FORWARD, 0.0)
    if asked:
        return np.zeros(count, bool), Effect(key, True, f"rays from all {count:,} patches{to}", "switched on", 0.0)
    if asked is False:
        return np.ones(count, bool), Effect(key, False, off, "switched off", None)
    known = key == SHADOW and inputs.asked(SKY) is None
    found = inputs.plan.unobstructed if known else unobstructed_patches(inputs)
    extent = f"rays from {some_of(count - found.sum(), count)}{to}"
    return found, Effect(key, not found.all(), extent, reason_of(found), 0.0)


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
