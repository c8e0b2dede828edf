"""`receivers` and `reflectors`: patches whose numbers are not wanted get fewer rays, or none.

Surfaces whose numbers are wanted get all rays, the others as many as the reflections need of them. Generated ground
that no ray from the city meets stays out of the matrix of form factors.
"""

import numpy as np

from ..city.scene import FAR, OWN
from .effect import Effect

RECEIVERS, REFLECTORS = "receivers", "reflectors"
FEWER = 4  # times fewer rays from the others
ENOUGH = 64  # of them to resolve the light of 16 elements
FULL_KINDS = ("flat", "rack")  # sampled in full whether or not they are eligible
HARDLY_SEEN = 0.25  # share of a patch's hemisphere that receivers fill


def decide_receivers(inputs):
    """All rays for eligible surfaces, flat roofs and racks; a quarter of them for all others."""
    request, count = inputs.request, len(inputs.patches)
    if request.estimator == "forward":
        return Effect(RECEIVERS, False, "photons on all surfaces", "photons fall wherever they fall", 0.0)
    every = f"all rays from all {count:,} patches"
    if not inputs.asked(RECEIVERS, request.report == "eligible"):
        return Effect(RECEIVERS, False, every, "all are reported in full", 0.0)
    surfaces, halo = inputs.scene.surfaces, inputs.scene.halo
    wanted = surfaces.eligible | np.isin(surfaces.kind, FULL_KINDS)
    full = np.append(wanted, False)[inputs.scene.triangle_surface] & inputs.patches.receives
    full = full if halo is None else full & (halo == OWN)
    others = int((inputs.patches.receives & ~full).sum())
    if not others or not (full & inputs.patches.receives).any():
        return Effect(RECEIVERS, False, every, "they are of one kind", 0.0)
    inputs.plan.receivers = full
    extent = f"{fewer_rays(request.samples)} of {request.samples} rays from {others:,} of {count:,} patches"
    reason = "they are ground, downward or not eligible, and only pass light on"
    # Nothing is passed on to receivers that nothing stands in front of.
    return Effect(RECEIVERS, True, extent, reason, 0.0 if inputs.unshaded else None)


def decide_reflectors(inputs):
    """Ground that no ray from a surface of the city meets needs no rays of its own."""
    if inputs.request.estimator == "forward":
        return Effect(REFLECTORS, False, "all surfaces", "photons fall wherever they fall", 0.0)
    if not inputs.plan.reflections:
        return Effect(REFLECTORS, False, "none", "nothing is reflected", 0.0)
    if not inputs.asked(REFLECTORS, inputs.request.report == "eligible"):
        return Effect(REFLECTORS, False, "all patches", "switched off", 0.0)
    only, halo = inputs.scene.triangle_surface < 0, inputs.scene.halo
    only = only if halo is None else only | (halo == FAR)  # of a tile also what lies far from it
    ground = int((only & inputs.patches.receives).sum())
    if not ground:
        return Effect(REFLECTORS, False, "all patches", "the ground is not generated", 0.0)
    inputs.plan.optional = only
    rays = inputs.request.samples * int((~only & inputs.patches.receives).sum())
    # A patch with view factor f is missed by all rays with (1 - f)^rays; f (1 - f)^rays is at most 1/(e rays).
    bound = float(inputs.patches.albedo.max(initial=0) * ground / (np.e * max(rays, 1)))
    words = f"of {ground:,} patches of generated ground only those that a ray from the city meets"
    return Effect(REFLECTORS, True, words, "ground that no surface sees reflects no light onto any", bound)


def fewer_rays(samples):
    """Hemisphere rays from each of the others."""
    return min(samples, max(ENOUGH, samples // FEWER))


def fewer_points(points):
    """Shadow points of each of the others that look at one sun: a quarter, but no fewer than four."""
    return points // FEWER if points >= FEWER**2 else points


def choose_turns(full, ground, filled, points):
    """One in how many of its shadow points looks at one sun, in turn, for each patch.

    All of those of receivers, a quarter of those of others, a sixteenth of those of generated ground that receivers
    hardly see: it has no numbers of its own, and noise of what it passes on counts with the light that it passes on.

    Parameters
    ----------
    full : (p,) bool or None
        Receivers; None: all patches.
    ground : (p,) bool
        Generated ground.
    filled : (p,) float32 or None
        Share of each patch's hemisphere that receivers fill.
    points : int
        Shadow points of a receiver.

    Returns
    -------
    (p,) int or None
        None: all points of all patches.
    """
    if full is None or fewer_points(points) == points:
        return None
    turns = np.where(full, 1, FEWER)
    return turns if filled is None else np.where(ground & ~full & (filled < HARDLY_SEEN), FEWER**2, turns)
