"""`reflectors`: generated ground that no surface sees stays out of the matrix of form factors."""

import numpy as np

from ..city.scene import FAR
from .effect import Effect

KEY = "reflectors"


def decide(inputs):
    """Ground that no ray from a surface of the city meets needs no rays of its own."""
    if inputs.request.estimator == "forward":
        return Effect(KEY, False, "all surfaces", "photons fall wherever they fall", 0.0, setting=False)
    if not inputs.decided["reflections"].on:
        return Effect(KEY, False, "none", "nothing is reflected", 0.0, setting=False)
    if not inputs.asked(KEY, inputs.request.report == "eligible"):
        return Effect(KEY, False, "all patches", "switched off", 0.0, setting=False)
    only = find_optional(inputs.scene)
    ground = int((only & inputs.patches.receives).sum())
    if not ground:
        return Effect(KEY, False, "all patches", "the ground is not generated", 0.0, setting=False)
    rays = inputs.request.samples * int((~only & inputs.patches.receives).sum())
    # A patch with view factor f is missed by all rays with (1 - f)^rays; f (1 - f)^rays is at most 1/(e rays).
    bound = float(inputs.patches.albedo.max(initial=0) * ground / (np.e * max(rays, 1)))
    words = f"of {ground:,} patches of generated ground only those that a ray from the city meets"
    return Effect(KEY, True, words, "ground that no surface sees reflects no light onto any", bound, setting=only)


def find_optional(scene):
    """Patches that count only where a ray meets them: generated ground, and what lies far from a tile: (p,) bool."""
    ground = scene.triangle_surface < 0
    return ground if scene.halo is None else ground | (scene.halo == FAR)
