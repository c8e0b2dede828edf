"""`shadow-rays`: what stands between the patches and the suns.

Patches with nothing in front of their plane see every sun in front of it; suns behind it are never seen.
"""

from dataclasses import dataclass

import numpy as np

from .effect import Effect
from .sky_rays import KEY as SKY_RAYS
from .sky_rays import photons_fall_anywhere, reason_of, some_of, unobstructed_patches

KEY = "shadow-rays"


@dataclass
class ShadowRays:
    """Which shadow rays are sent."""

    unobstructed: np.ndarray  # (p,) bool, patches that see every sun in front of them
    behind: bool  # whether rays are sent to suns behind a patch, to see that this changes nothing


def decide(inputs):
    """On where something can stand in the way; `setting` is a `ShadowRays`."""
    count = len(inputs.patches)
    if inputs.request.estimator == "forward":
        return photons_fall_anywhere(KEY, ShadowRays(np.zeros(count, bool), behind=False))
    if inputs.asked(KEY):
        every = ShadowRays(np.zeros(count, bool), behind=True)
        return Effect(KEY, True, f"rays from all {count:,} patches to all suns", "switched on", 0.0, every)
    if inputs.asked(KEY) is False:
        none = ShadowRays(np.ones(count, bool), behind=False)
        return Effect(KEY, False, "no rays: no shadow is cast", "switched off", None, none)
    known = inputs.asked(SKY_RAYS) is None
    found = inputs.decided[SKY_RAYS].setting if known else unobstructed_patches(inputs)
    extent = f"rays from {some_of(count - found.sum(), count)} to suns in front of them"
    return Effect(KEY, not found.all(), extent, reason_of(found), 0.0, ShadowRays(found, behind=False))
