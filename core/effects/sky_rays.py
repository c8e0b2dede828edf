"""`sky-rays`: what stands between the patches and the sky.

Patches with nothing in front of their plane send no hemisphere rays: what they see has a closed form.
"""

import numpy as np

from .closed_form import find_unobstructed
from .effect import Effect

KEY = "sky-rays"
FORWARD = "the forward estimator follows light from its source"


def decide(inputs):
    """On where something can stand in the way; `setting` is the mask of unobstructed patches, (p,) bool."""
    count = len(inputs.patches)
    if inputs.request.estimator == "forward":
        return photons_fall_anywhere(KEY, np.zeros(count, bool))
    if inputs.asked(KEY):
        return Effect(KEY, True, f"rays from all {count:,} patches", "switched on", 0.0, np.zeros(count, bool))
    if inputs.asked(KEY) is False:
        return Effect(KEY, False, "no rays: no surface is seen", "switched off", None, np.ones(count, bool))
    found = unobstructed_patches(inputs)
    extent = f"rays from {some_of(count - found.sum(), count)}"
    return Effect(KEY, not found.all(), extent, reason_of(found), 0.0, found)


def unobstructed_patches(inputs):
    """Patches with neither a part of the scene nor a crown in front of them: (p,) bool."""
    vertices, trees = inputs.scene.vertices, inputs.decided["trees"]
    if trees.on:
        vertices = np.concatenate([vertices, trees.setting.crowns.vertices])
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


def photons_fall_anywhere(key, setting):
    """Decision for the forward estimator: Effect."""
    return Effect(key, True, "photons on all patches", FORWARD, 0.0, setting)
