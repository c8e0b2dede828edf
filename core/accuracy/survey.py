"""What a trace of the whole city will do: rays, shadow rays and entries of the matrix of form factors.

A few patches, drawn from the whole city, send rays. What these meet tells how much of the generated ground any ray will
meet, as only that is traced, and how many entries of the matrix a patch has: rays that meet the same patch are merged,
so that entries grow more slowly than rays.
"""

from dataclasses import dataclass

import numpy as np

from ..effects.receivers import fewer_points, fewer_rays
from ..light.shadow_points import count_elements, points_above
from ..light.trace_all import patch_of_keys, patches_hit, prepare_gather
from ..light.trace_hemisphere import trace_hemisphere
from ..progress import silent
from ..sampling.sample_points import HEMISPHERE_REPLICATES

LADDER = ((64, 512), (256, 512), (1024, 128))  # rays per patch, and how many patches send them
DRAWN = 0x5A5E  # of the random numbers


@dataclass
class Survey:
    """What is traced of a city, and what its rays meet."""

    full: int  # patches that get all rays
    others: int  # that get fewer, without generated ground
    ground: int  # generated ground, traced only where a ray meets it
    shots: np.ndarray  # (2,) rays of the survey, part of them and all
    met: np.ndarray  # (2,) patches of ground that these meet
    rays: np.ndarray  # (k,) rays of a patch, ascending
    entries: np.ndarray  # (k,) float64, of the matrix for a patch with so many rays


@dataclass
class Work:
    """What a trace does."""

    patches: float
    rays: float
    points: float  # shadow points of all patches
    entries: float  # pairs of patches in the matrix of form factors


def survey_city(prepared, request):
    """Send rays from a few patches of the whole city.

    Parameters
    ----------
    prepared : PreparedScene
        With its tree.
    request : Request

    Returns
    -------
    Survey
    """
    context, plan, patches = prepare_gather(prepared, request, silent), prepared.plan, prepared.patches
    traced = patches.receives & ~plan.unobstructed
    ground = traced & (context.owner < 0) if plan.reflectors else np.zeros(len(patches), bool)
    full = traced & ~ground & (True if plan.receivers is None else plan.receivers)
    drawn = np.random.default_rng([request.seed, DRAWN]).permutation(np.flatnonzero(traced & ~ground))
    cells = count_elements(points_above(request.shadow_samples))
    shots, met, entries, seen = [0], [0], [], np.zeros(len(patches), bool)
    for rays, count in LADDER:
        some = np.zeros(len(patches), bool)
        some[drawn[:count]] = True
        factors = trace_some(context, some, rays, cells) if plan.reflections and some.any() else None
        entries.append(count_entries(factors) / some.sum() if factors else 0.0)
        if factors:
            seen |= patches_hit(factors, len(patches))
        shots.append(shots[-1] + rays * int(some.sum()))
        met.append(int((seen & ground).sum()))
    return Survey(
        full=int(full.sum()),
        others=int((traced & ~ground & ~full).sum()),
        ground=int(ground.sum()),
        shots=np.array([shots[1], shots[-1]]),
        met=np.array([met[1], met[-1]]),
        rays=np.array([rays for rays, _ in LADDER]),
        entries=np.array(entries),
    )


def trace_some(context, some, rays, cells):
    """Matrix of form factors of some patches: FormFactors."""
    return trace_hemisphere(
        context.ray_scene,
        context.patches,
        some,
        sample_count=rays,
        reflections=True,
        threads=context.threads,
        progress=silent,
    ).form_factors


def count_entries(factors):
    """Pairs of patches in a matrix; keys ascend within a row: int."""
    total = 0
    for rows in factors.rows:
        met, start = patch_of_keys(factors, rows), np.zeros(len(rows.key), bool)
        start[rows.start[:-1][np.diff(rows.start) > 0]] = True
        total += int((start[1:] | (met[1:] != met[:-1])).sum()) + bool(len(met))
    return total


def work_of_city(survey, samples, points):
    """Work of a trace of the whole city with so many rays and shadow points: Work."""
    every, fewer = (whole_replicates(count) for count in (samples, fewer_rays(samples)))
    ground = ground_met(survey, survey.full * every + survey.others * fewer)
    return work_of_patches(survey, (survey.full, survey.others + ground), samples, points)


def work_of_patches(survey, counts, samples, points):
    """Work of patches that get all rays, and of others that get fewer: Work."""
    rays = [whole_replicates(count) for count in (samples, fewer_rays(samples))]
    return Work(
        patches=sum(counts),
        rays=float(np.dot(counts, rays)),
        points=float(np.dot(counts, (points, fewer_points(points)))),
        entries=float(np.dot(counts, [entries_of_patch(survey, count) for count in rays])),
    )


def whole_replicates(rays):
    """Rays of a patch, a whole number for each replicate."""
    return -(-rays // HEMISPHERE_REPLICATES) * HEMISPHERE_REPLICATES


def ground_met(survey, rays):
    """Patches of ground that so many rays from the city meet, which grow with the logarithm of their number: float."""
    if not survey.ground or not survey.met[-1]:
        return 0.0
    steps = np.log(np.maximum(survey.shots, 1))
    slope = (survey.met[1] - survey.met[0]) / max(steps[1] - steps[0], 1e-9)
    return float(np.clip(survey.met[1] + slope * (np.log(max(rays, 1)) - steps[1]), 0, survey.ground))


def entries_of_patch(survey, rays):
    """Entries of the matrix for a patch with so many rays, by powers between those looked at: float."""
    if not survey.entries.all():
        return 0.0
    known, found = np.log(survey.rays), np.log(survey.entries)
    place = int(np.clip(np.searchsorted(known, np.log(rays)) - 1, 0, len(known) - 2))
    slope = (found[place + 1] - found[place]) / (known[place + 1] - known[place])
    return float(np.exp(found[place] + slope * (np.log(rays) - known[place])))
