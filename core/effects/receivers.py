"""`receivers`: surfaces whose numbers are wanted get all rays, the others as many as the reflections need of them."""

import numpy as np

from ..scene.scene import OWN
from .effect import Effect
from .pilot import SKIES

KEY = "receivers"
FEWER = 4  # times fewer rays from the others
ENOUGH = 64  # of them to resolve the light of 16 elements
FULL_KINDS = ("flat", "rack")  # sampled in full whether or not they are eligible
HARDLY_SEEN = 0.25  # share of a patch's hemisphere that receivers fill
NOISE = 1.0  # relative standard deviation of the light that a single ray finds: one half at even odds
CERTAINTY = 2  # standard errors


def decide(inputs):
    """All rays for eligible surfaces, flat roofs and racks; a quarter of them for all others."""
    request, count = inputs.request, len(inputs.patches)
    if request.estimator == "forward":
        return Effect(KEY, False, "photons on all surfaces", "photons fall wherever they fall", 0.0)
    if not inputs.asked(KEY, request.report == "eligible"):
        return Effect(KEY, False, f"all rays from all {count:,} patches", "all are reported in full", 0.0)
    full = find_receivers(inputs.scene, inputs.patches)
    others = int((inputs.patches.receives & ~full).sum())
    if not others or not (full & inputs.patches.receives).any():
        return Effect(KEY, False, f"all rays from all {count:,} patches", "they are of one kind", 0.0)
    fewer = fewer_rays(request.samples)
    extent = f"{fewer} of {request.samples} rays from {others:,} of {count:,} patches"
    reason = "they are ground, downward or not eligible, and only pass light on"
    pilot = inputs.pilot_if_wanted
    unknown = 0.0 if inputs.unshaded else None  # nothing is passed on to receivers that nothing stands in front of
    bound = unknown if pilot is None else noise_passed_on(pilot, full, fewer)
    return Effect(KEY, True, extent, reason, bound, setting=full)


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


def find_receivers(scene, patches):
    """Patches of eligible surfaces, flat roofs and racks: (p,) bool."""
    surfaces = scene.surfaces
    wanted = surfaces.eligible | np.isin(surfaces.kind, FULL_KINDS)
    full = np.append(wanted, False)[scene.triangle_surface] & patches.receives
    return full if scene.halo is None else full & (scene.halo == OWN)


def noise_passed_on(pilot, full, rays):
    """Noise of light that others pass on, in the mean of any group of receivers, as a share of its light.

    Each of the k patches on which a group's paths end first has an independent error of NOISE/√rays at most.

    Parameters
    ----------
    pilot : Pilot
    full : (p,) bool
    rays : float
        From each of the others.

    Returns
    -------
    float
    """
    largest = 0.0
    for index in range(len(pilot.groups)):
        members = pilot.group == index
        first = pilot.first[members]
        by_others = (first >= 0) & ~full[first]
        patches = len(np.unique(first[by_others]))
        for ratio in SKIES:
            light = pilot.sky[members].astype(float) + ratio * pilot.sun[members]
            whole = light.sum()
            share = light[by_others, 1:].sum() / whole if whole > 0 else 0.0
            largest = max(largest, CERTAINTY * share * NOISE / np.sqrt(rays * max(patches, 1)))
    return float(largest)
