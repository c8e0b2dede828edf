"""What all patches see of sky, far ground and each other, with all rays only where numbers are wanted.

1. receivers               all rays
2. other surfaces          a quarter of them
3. generated ground        a quarter of them, from those patches that a ray of 1 or 2 meets
"""

import numpy as np

from ..effects.closed_form import ground_view_of_tilt, sky_view_of_tilt
from ..effects.receivers import fewer_rays
from ..rays.sample_points import HEMISPHERE_REPLICATES
from .hemisphere import Hemisphere, empty_tallies
from .solve_radiosity import element_factors
from .trace_hemisphere import trace_hemisphere


def view_hemispheres(context, cells):
    """What all patches see of sky, far ground and each other.

    Parameters
    ----------
    context : GatherContext
    cells : int
        1, 4 or 16: into how many elements the light of a patch is resolved.

    Returns
    -------
    Hemisphere
    ElementSky or None
        None without reflections.
    """
    patches, plan = context.patches, context.plan
    tallies = empty_tallies(len(patches), cells) if plan.reflections else None
    rays = trace_in_turn(context, tallies)
    fill_closed_forms(rays, patches, plan)
    if tallies is None:
        return Hemisphere(**vars(rays), factor=None), None
    fill_elements(tallies, rays, patches, plan)
    return Hemisphere(**vars(rays), factor=element_factors(context, rays, tallies)), tallies.sky


def trace_in_turn(context, tallies):
    """Hemisphere rays of all patches, as many as the plan gives to each: HemisphereRays."""
    patches, plan = context.patches, context.plan
    every, fewer = (
        -(-count // HEMISPHERE_REPLICATES) * HEMISPHERE_REPLICATES
        for count in (context.request.samples, fewer_rays(context.request.samples))
    )
    traced = ~plan.unobstructed & patches.receives
    full = traced if plan.receivers is None else traced & plan.receivers
    ground = plan.optional if plan.reflectors else np.zeros(len(patches), bool)

    # Ground that turns out to be unseen, and what is covered, are counted as if they were traced.
    most = every * int((full & ~ground).sum()) + fewer * int((traced & ~(full & ~ground)).sum())
    before = 0

    def trace(chosen, count):
        return trace_hemisphere(
            context.ray_scene,
            patches,
            chosen,
            sample_count=count,
            reflections=plan.reflections,
            threads=context.threads,
            progress=lambda stage, done, _, unit: context.progress(stage, before + done, most, unit),
            tallies=tallies,
            terrain=plan.terrain,
        )

    found = trace(full & ~ground, every)
    if plan.receivers is not None and plan.reflections:
        found.seen = measure_seen(found.form_factors, patches.area)
    others = traced & ~full & ~ground
    before = every * int((full & ~ground).sum())
    if others.any():
        add_rays(found, trace(others, fewer))
    if not plan.reflectors:
        return found
    seen = traced & ground & patches_hit(found.form_factors, len(patches))
    before += fewer * int(others.sum())
    if seen.any():
        add_rays(found, trace(seen, fewer if plan.receivers is not None else every))
    unseen = traced & ground & ~seen
    found.unseen_share = share_of_hits(found.form_factors, unseen)
    found.covered[unseen] = True  # nothing is asked of them: no shadow rays either
    if found.ray_count < most:
        context.progress("sky and reflections", most, most, "rays")
    return found


def add_rays(found, others):
    """Add the rays of other patches to HemisphereRays."""
    found.sky += others.sky
    found.far_ground += others.far_ground
    found.covered |= others.covered
    found.ray_count += others.ray_count
    if found.form_factors is not None:
        found.form_factors.rows += others.form_factors.rows


def patches_hit(form_factors, count):
    """Patches that any ray has met: (p,) bool."""
    hit = np.zeros(count, bool)
    for rows in form_factors.rows:
        hit[patch_of_keys(form_factors, rows)] = True
    return hit


def measure_seen(form_factors, area):
    """Area of the patches that sent rays, times their view factors of each patch: (p,) float64 [m²]."""
    seen = np.zeros(len(area))
    for rows in form_factors.rows:
        rays = HEMISPHERE_REPLICATES * (rows.rays or form_factors.rays)
        weight = np.repeat(area[rows.chosen] / rays, np.diff(rows.start)) * rows.count
        seen += np.bincount(patch_of_keys(form_factors, rows), weight, len(area))
    return seen


def share_of_hits(form_factors, members):
    """Share of all hits that fall on some patches, (p,) bool."""
    found = sum(float(rows.count[members[patch_of_keys(form_factors, rows)]].sum()) for rows in form_factors.rows)
    return found / max(sum(float(rows.count.sum()) for rows in form_factors.rows), 1.0)


def patch_of_keys(form_factors, rows):
    """Patch of each entry: (e,) int32."""
    return rows.key >> (form_factors.start_bits + form_factors.cells.bit_length() - 1)


def fill_closed_forms(rays, patches, plan):
    """Put in what is known without rays, and take out what the plan leaves out."""
    known = plan.unobstructed & patches.receives
    rays.sky[known] = sky_view_of_tilt(patches.normal[known], plan.terrain)[:, None]
    rays.far_ground[known] = ground_view_of_tilt(patches.normal[known], plan.terrain)[:, None]
    rays.covered[~patches.receives] = True
    if not plan.far_ground:
        rays.far_ground[:] = 0


def fill_elements(tallies, rays, patches, plan):
    """The same for the elements of patches."""
    known = plan.unobstructed & patches.receives
    tallies.sky.view[known] = rays.sky[known, :1]
    tallies.far_ground[known] = rays.far_ground[known, :1] / tallies.far_ground.shape[1]
    if not plan.far_ground:
        tallies.far_ground[:] = 0
