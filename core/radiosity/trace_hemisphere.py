"""Hemisphere rays: what is visible from each patch of the sky, the far ground and the other patches.

       sky                        A ray that escapes upwards reaches the sky, one that escapes downwards the far
    \\   |   /                      ground. A ray that hits the front of a patch links the two in the matrix F.
 hit ←  \\|/ → far ground          A ray that hits a back carries nothing.
═════════════ patch
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ..form_factors.form_factors import FEWEST_RAYS, FormFactors, count_hits, count_starts
from ..patches.cover_cells import enclosed_cells
from ..patches.fates_of_rays import BACK, DARK, FAR_GROUND, FRONT, LEAVES, SKY, classify_rays, stop_in_crowns
from ..patches.find_covered import cells_near_cover, find_covered_cells, lie_in_earth
from ..rays.hemisphere_rays import CELL_DIVISIONS, hemisphere_rays
from ..rays.ray_scene import Places
from ..rays.sample_points import HEMISPHERE_REPLICATES, cells_inside, sobol_digits
from ..settings.threads import map_in_order
from ..sun.horizon import mark_hidden
from .hemisphere import HemisphereRays
from .replicates import STEP

RAYS_PER_TASK = 1 << 18
LOW = (1 << 32) - 1  # bits of the first of two counts in one number


class Tally(NamedTuple):
    """What the rays of c patches reach."""

    sky: np.ndarray  # (c, HEMISPHERE_REPLICATES) float32, share of rays that reach the sky
    far_ground: np.ndarray  # (c, HEMISPHERE_REPLICATES) float32
    element_sky: np.ndarray  # (c, cells) float32, of their open part; of the whole patch if too few rays start there
    element_far_ground: np.ndarray  # (c, cells) float32, share of all rays of the patch
    open_share: np.ndarray  # (c, cells) float32, share of the rays that start in each cell
    deviation: np.ndarray  # (c, cells, HEMISPHERE_REPLICATES) int16, of `write_deviations`


def trace_hemisphere(
    ray_scene, patches, traced, *, sample_count, reflections, threads, progress, tallies=None, terrain=None
):
    """Trace cosine-distributed rays from every traced patch.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need rays. The others get zeros.
    sample_count : int
        Rays per patch, a multiple of HEMISPHERE_REPLICATES.
    reflections : bool
        Whether to collect the matrix of form factors.
    threads : int
    progress : callable
        See `core.progress`.
    tallies : ElementTallies, optional
        The rows of traced patches are written, which needs `reflections`. The light of a patch is resolved by as many
        elements, 1, 4 or 16, as they have columns; by one if not given.
    terrain : TerrainHorizon, optional
        Of distant terrain: rays that leave below it reach the far ground, not the sky.

    Returns
    -------
    HemisphereRays

    Raises
    ------
    InputError
        If `traced` or `sample_count` is invalid, or a ray would not be finite.
    """
    count = len(patches)
    check_array("traced", traced, (count,), kind="b")
    if sample_count < HEMISPHERE_REPLICATES or sample_count % HEMISPHERE_REPLICATES:
        raise InputError("sample_count", f"{sample_count} rays", f"give a multiple of {HEMISPHERE_REPLICATES}")
    sequence = sobol_digits(sample_count // HEMISPHERE_REPLICATES)
    rows = np.flatnonzero(traced)
    step = max(1, RAYS_PER_TASK // sample_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    cells = tallies.open_share.shape[1] if tallies is not None else 1
    starts = count_starts(count, cells, sample_count)

    def trace_rows(chosen):
        wanted = (cells, starts) if reflections else None
        return trace_patches(ray_scene, patches, chosen, sequence, wanted, terrain)

    found = HemisphereRays(
        sky=np.zeros((count, HEMISPHERE_REPLICATES), np.float32),
        far_ground=np.zeros((count, HEMISPHERE_REPLICATES), np.float32),
        form_factors=FormFactors([], count, cells, len(sequence), starts) if reflections else None,
        covered=np.zeros((count, CELL_DIVISIONS**2), bool),
        ray_count=0,
    )
    if len(rows):
        progress("sky and reflections", 0, len(rows) * sample_count, "rays")
    done = 0
    for task, traced_rows in zip(tasks, map_in_order(trace_rows, tasks, threads), strict=True):
        tally, covered, matrix_rows = traced_rows
        found.covered[task] = covered
        dark = covered.all(axis=1)
        chosen = task[~dark]
        found.sky[chosen], found.far_ground[chosen] = tally.sky, tally.far_ground
        if reflections:
            matrix_rows.rays = len(sequence)
            found.form_factors.rows.append(matrix_rows)
        if tallies is not None:
            tallies.sky.view[chosen], tallies.sky.deviation[chosen] = tally.element_sky, tally.deviation
            tallies.far_ground[chosen], tallies.open_share[chosen] = tally.element_far_ground, tally.open_share
            tallies.open_share[task[dark]] = 0
        found.ray_count += len(chosen) * sample_count
        done += len(task)
        progress("sky and reflections", done * sample_count, len(rows) * sample_count, "rays")
    return found


def trace_patches(ray_scene, patches, chosen, sequence, cells, terrain=None):  # noqa: PLR0917
    """Trace the hemisphere rays of some patches; of these, such as are wholly covered need none.

    Parameters
    ----------
    chosen : (m,) int
    sequence : (rays / HEMISPHERE_REPLICATES, 4) uint32
    cells : tuple of two int, or None
        `cells` of `trace_hemisphere` and `starts` of `FormFactors`; None if no matrix is wanted.
    terrain : TerrainHorizon, optional

    Returns
    -------
    tally : Tally
        Of the c patches that are not wholly covered.
    covered : (m, CELL_DIVISIONS²) bool
    rows : Rows or None
        Of these c.
    """
    covered_cells = find_covered_cells(ray_scene, patches, chosen)
    some = ~covered_cells.all(axis=1)
    chosen, covered = chosen[some], covered_cells[some]
    origins, directions, start_cells = hemisphere_rays(patches, chosen, sequence)
    hits = ray_scene.trace_places(origins.reshape(-1, 3), directions.reshape(-1, 3))
    hit = hits.triangle.reshape(start_cells.shape)
    fate = np.empty(hit.shape, np.uint8)
    classify_rays(hit, np.moveaxis(directions, -1, 0), patches.facing, fate)

    within = np.flatnonzero(covered.any(axis=1))
    mark_dark(fate, within, start_cells, covered[within], enclosed_cells(covered[within]))
    # Along the ground line the start of each ray is tested for being below ground.
    fate[within] = np.where(lie_in_earth(ray_scene, patches, origins[within]), DARK, fate[within])

    if ray_scene.canopy is not None:
        stop_at_leaves(ray_scene, patches, (origins, directions), hits, fate)
    if terrain is not None:
        mark_hidden(fate, np.moveaxis(directions, -1, 0), np.sin(np.radians(terrain.elevation)), SKY, FAR_GROUND)

    cells, starts = cells or (1, 0)
    tally = tally_rays(fate, start_cells, cells_near_cover(covered, within), cells)
    if not starts:
        return tally, covered_cells, None
    cell_of = cells_inside(CELL_DIVISIONS, round(np.sqrt(cells)))
    start_of = start_cells, cell_of if starts > 1 else np.zeros_like(cell_of), starts
    return tally, covered_cells, count_hits(chosen, (hit, fate == FRONT), (hits.b1, hits.b2), cells, start_of)


def stop_at_leaves(ray_scene, patches, rays, places, fate):
    """Change the fate of rays that crowns stop to LEAVES. Each replicate has random numbers of its own."""
    shape = len(fate) * HEMISPHERE_REPLICATES, fate.shape[1] // HEMISPHERE_REPLICATES
    rays = tuple(part.reshape(*shape, 3) for part in rays)
    places = Places(*(part.reshape(shape) for part in places))
    stopped = stop_in_crowns(ray_scene, patches, rays, places, fate.reshape(shape) <= FRONT)
    fate[stopped.reshape(fate.shape)] = LEAVES


@njit(nogil=True, cache=True)
def mark_dark(fate, within, start_cells, covered, enclosed):
    """Mark rays of patches `within` that start in covered cells as DARK.

    All rays from enclosed cells are dark. In cells along the edge of the covered part each ray is judged by what it
    hits, or the edge would count twice. Rays that escape downwards from a covered cell, below the ground or through a
    missing floor, do not reach lit ground.
    """
    for place, patch in enumerate(within):
        for ray in range(fate.shape[1]):
            cell = start_cells[patch, ray]
            if enclosed[place, cell] or (covered[place, cell] and fate[patch, ray] == FAR_GROUND):
                fate[patch, ray] = DARK


def tally_rays(fate, start_cells, near_cover, cells):
    """Shares of rays that reach sky and far ground, in each replicate and in each cell: Tally.

    Parameters
    ----------
    fate : (c, rays) uint8
    start_cells : (c, rays) uint8
    near_cover : (c, CELL_DIVISIONS²) bool
        Of `cells_near_cover`.
    cells : int
        Number of larger cells: 1, 4 or 16.
    """
    count = len(fate)
    sky, far_ground = np.empty((2, count, HEMISPHERE_REPLICATES), np.float32)
    deviation = np.empty((count, cells, HEMISPHERE_REPLICATES), np.int16)
    tally = Tally(sky, far_ground, *np.empty((3, count, cells), np.float32), deviation)
    cell_of = cells_inside(CELL_DIVISIONS, round(np.sqrt(cells)))
    count_fates((fate, start_cells, near_cover), (cell_of, fate.shape[1] >= FEWEST_RAYS * cells), tuple(tally))
    return tally


@njit(nogil=True, cache=True)
def count_fates(met_by, resolved, tally):
    """Write a Tally.

    Parameters
    ----------
    met_by : tuple of (c, rays) uint8, (c, rays) uint8 and (c, CELL_DIVISIONS²) bool
        The first three parameters of `tally_rays`.
    resolved : tuple of (CELL_DIVISIONS²,) int and bool
        The larger cell that contains each of these, and whether enough rays start in each; if not, the patch is taken
        as a whole.
    tally : tuple
        Written.
    """
    (fate, start_cells, near_cover), (cell_of, resolves) = met_by, resolved
    sky, far_ground, element_sky, element_far_ground, open_share, deviation = tally
    (count, rays), cells, every = fate.shape, element_sky.shape[1], HEMISPHERE_REPLICATES
    per_replicate = rays // HEMISPHERE_REPLICATES
    # Two counts in one number each: all rays and those to the far ground; rays to the sky and starts in the open.
    escaping, opening = np.empty((2, cells), np.int64)
    # The last row is for the whole patch, the last column for all replicates.
    free, started = np.empty((2, cells + 1, HEMISPHERE_REPLICATES + 1), np.int64)
    for patch in range(count):
        escaping[:], free[:], started[:] = 0, 0, 0
        for replicate in range(HEMISPHERE_REPLICATES):
            downwards = 0
            opening[:] = 0
            for ray in range(replicate * per_replicate, (replicate + 1) * per_replicate):
                start, met = start_cells[patch, ray], fate[patch, ray]
                cell = cell_of[start]
                downwards += met == FAR_GROUND
                escaping[cell] += 1 + (int(met == FAR_GROUND) << 32)
                opening[cell] += int(met == SKY) + (int((not near_cover[patch, start]) | (met < BACK)) << 32)
            for cell in range(cells):
                reached, begun = opening[cell] & LOW, opening[cell] >> 32
                for row in (cell, cells):
                    for column in (replicate, every):
                        free[row, column] += reached
                        started[row, column] += begun
            sky[patch, replicate] = np.float32(free[cells, replicate]) / np.float32(per_replicate)
            far_ground[patch, replicate] = np.float32(downwards) / np.float32(per_replicate)
        for cell in range(cells):
            all_rays, below = escaping[cell] & LOW, escaping[cell] >> 32
            taken = cell if resolves and all_rays > 0 else cells
            open_share[patch, cell] = started[cell, every] / all_rays if all_rays else 1
            element_far_ground[patch, cell] = below / rays
            element_sky[patch, cell] = free[taken, HEMISPHERE_REPLICATES] / max(
                started[taken, HEMISPHERE_REPLICATES], 1
            )
            taken = cell if resolves else cells
            write_deviations(free[taken], started[taken], deviation[patch, cell])


@njit(nogil=True, cache=True)
def write_deviations(free, started, deviation):
    """Deviation of each replicate's visible sky from the mean of all, in units of STEP.

    The visible sky is a ratio of two counts, rays that reach the sky over rays that start in the open; its deviation is
    linearised in both.

    Parameters
    ----------
    free, started : (HEMISPHERE_REPLICATES + 1,) int
        Numbers of these rays, the last one that of all replicates.
    deviation : (HEMISPHERE_REPLICATES,) int16
        Written.
    """
    whole = np.float32(max(started[HEMISPHERE_REPLICATES], 1))
    mean = np.float32(free[HEMISPHERE_REPLICATES]) / whole
    for replicate in range(HEMISPHERE_REPLICATES):
        apart = np.float32(free[replicate]) - mean * np.float32(started[replicate])
        steps = np.rint(apart * HEMISPHERE_REPLICATES / whole / STEP)
        deviation[replicate] = np.int16(max(-32767, min(32767, steps)))
