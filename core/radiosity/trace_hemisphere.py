"""What each patch sees of the sky, of the far ground and of the other patches.

       sky                        A ray that leaves upwards meets the sky, one that leaves downwards the far
    \\   |   /                      ground. A ray that meets the front of a patch joins the two in the matrix F.
 hit ←  \\|/ → far ground          A ray that meets a back carries nothing.
═════════════ patch
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..check_arrays import check_array
from ..errors import InputError
from ..patches.find_covered import COVERED, OPEN, UNKNOWN, enclosed_cells, find_covered_cells, lie_in_earth
from ..sampling.hemisphere_rays import CELL_DIVISIONS, hemisphere_rays
from ..sampling.sample_points import HEMISPHERE_REPLICATES, cells_inside, sobol_digits
from ..threads import map_in_order
from .form_factors import FEWEST_RAYS, FormFactors, count_hits, tell_starts
from .replicates import tally_deviations

RAYS_PER_TASK = 1 << 17
SKY, FAR_GROUND, FRONT, BACK, DARK = range(5)  # what becomes of a ray; DARK carries nothing
AGREEING_RAYS = 3  # of a cell, that need no vote on whether it lies inside something


@dataclass
class Hemisphere:
    """What the hemisphere rays of p patches met."""

    sky: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, share of rays that reach the sky
    element_sky: np.ndarray  # (p, cells) float32, the same of the open part of each cell of the patch
    element_far_ground: (
        np.ndarray
    )  # (p, cells) float32, share of all rays that start in the cell and leave below the horizon
    open_share: np.ndarray  # (p, cells) float32, of the rays of each cell, those that start in the open
    far_ground: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, share that leaves below the horizon
    form_factors: FormFactors | None  # the rays that meet another patch's front
    covered: np.ndarray  # (p, CELL_DIVISIONS²) bool, cells that lie inside or under something
    ray_count: int
    factor: np.ndarray | None = None  # (p, cells) float32, of `element_factors`
    sky_deviation: np.ndarray | None = None  # (p, cells, HEMISPHERE_REPLICATES) int16, of `tally_deviations`

    @property
    def covered_share(self):
        """Share of each patch that lies inside or under something: (p,) float32."""
        return self.covered.mean(axis=1, dtype=np.float32)


def trace_hemisphere(ray_scene, patches, traced, *, sample_count, reflections, threads, progress, cells=1):
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
        Whether the matrix of form factors is wanted.
    threads : int
    progress : callable
        See `core.progress`.
    cells : int, optional
        1, 4 or 16: into how many cells the light of a patch is resolved.

    Returns
    -------
    Hemisphere

    Raises
    ------
    InputError
        If `traced` or `sample_count` cannot be used, or a ray would not be finite.
    """
    count = len(patches)
    check_array("traced", traced, (count,), kind="b")
    if sample_count < HEMISPHERE_REPLICATES or sample_count % HEMISPHERE_REPLICATES:
        raise InputError("sample_count", f"{sample_count} rays", f"give a multiple of {HEMISPHERE_REPLICATES}")
    sequence = sobol_digits(sample_count // HEMISPHERE_REPLICATES)
    rows = np.flatnonzero(traced)
    step = max(1, RAYS_PER_TASK // sample_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    starts = tell_starts(count, cells, sample_count)

    def trace_rows(chosen):
        return trace_patches(ray_scene, patches, chosen, sequence, (cells, starts) if reflections else None)

    found = Hemisphere(
        sky=np.zeros((count, HEMISPHERE_REPLICATES), np.float32),
        element_sky=np.zeros((count, cells), np.float32),
        element_far_ground=np.zeros((count, cells), np.float32),
        open_share=np.ones((count, cells), np.float32),
        far_ground=np.zeros((count, HEMISPHERE_REPLICATES), np.float32),
        form_factors=FormFactors([], count, cells, len(sequence), starts) if reflections else None,
        covered=np.zeros((count, CELL_DIVISIONS**2), bool),
        ray_count=0,
        sky_deviation=np.zeros((count, cells, HEMISPHERE_REPLICATES), np.int16) if reflections else None,
    )
    if len(rows):
        progress("sky and reflections", 0, len(rows) * sample_count, "rays")
    for chosen, traced_rows in zip(tasks, map_in_order(trace_rows, tasks, threads), strict=True):
        tally, covered, matrix_rows, deviation = traced_rows
        found.covered[chosen] = covered
        found.sky[chosen], found.far_ground[chosen] = tally[:2]
        found.element_sky[chosen], found.element_far_ground[chosen], found.open_share[chosen] = tally[2:]
        if reflections:
            found.form_factors.rows.append(matrix_rows)
            found.sky_deviation[chosen] = deviation
        found.ray_count += len(chosen) * sample_count
        progress("sky and reflections", found.ray_count, len(rows) * sample_count, "rays")
    return found


def trace_patches(ray_scene, patches, chosen, sequence, cells):
    """Trace the hemisphere rays of some patches.

    Parameters
    ----------
    chosen : (c,) int
    sequence : (rays / HEMISPHERE_REPLICATES, 4) uint32
    cells : tuple of two int, or None
        As of `trace_hemisphere`, and `starts` of `FormFactors`; None where no matrix is wanted.

    Returns
    -------
    tally : tuple
        Of `tally_rays`.
    covered : (c, CELL_DIVISIONS²) bool
    rows : Rows or None
    deviation : (c, cells, HEMISPHERE_REPLICATES) int16 or None
        Of `tally_deviations`.
    """
    origins, directions, start_cells = hemisphere_rays(patches, chosen, sequence)
    hit, b1, b2 = ray_scene.trace_places(origins.reshape(-1, 3), directions.reshape(-1, 3))
    hit = hit.reshape(start_cells.shape)
    fate = np.empty(hit.shape, np.uint8)
    suspect = np.zeros(len(chosen), bool)
    judge_rays(hit, np.moveaxis(directions, -1, 0), patches.facing, fate, suspect)

    # Where a ray met a back, the patch may lie inside something.
    suspect = np.flatnonzero(suspect)
    covered = np.zeros((len(chosen), CELL_DIVISIONS**2), bool)
    verdict = judge_cells(fate[suspect], start_cells[suspect])
    covered[suspect] = find_covered_cells(ray_scene, patches, chosen[suspect], verdict)
    within = suspect[covered[suspect].any(axis=1)]
    darken_rays(fate, within, start_cells, covered[within], enclosed_cells(covered[within]))
    # Along the line of the ground each ray is asked whether it starts below it.
    partly = within[~covered[within].all(axis=1)]
    fate[partly] = np.where(lie_in_earth(ray_scene, patches, origins[partly]), DARK, fate[partly])

    cells, starts = cells or (1, 0)
    cell_of = cells_inside(CELL_DIVISIONS, round(np.sqrt(cells)))
    asked = ask_each_ray(covered, within)
    tally = tally_rays(fate, start_cells, asked, cell_of, cells)
    if not starts:
        return tally, covered, None, None
    deviation = np.empty((len(chosen), cells, HEMISPHERE_REPLICATES), np.int16)
    resolved = cell_of, fate.shape[1] >= FEWEST_RAYS * cells
    tally_deviations((fate, start_cells, asked), resolved, (SKY, BACK), deviation)
    told = start_cells, cell_of if starts > 1 else np.zeros_like(cell_of), starts
    return tally, covered, count_hits(chosen, (hit, fate == FRONT), (b1, b2), cells, told), deviation


def ask_each_ray(covered, within):
    """Cells that are covered or touch one that is: there each ray tells whether it starts in the open, for it meets no
    back: (c, cells) bool.

    Parameters
    ----------
    covered : (c, cells) bool
    within : (w,) int
        Patches that have such cells.
    """
    asked = np.zeros(covered.shape, bool)
    asked[within] = ~enclosed_cells(~covered[within])  # but for open cells among open ones
    return asked


@njit(nogil=True, cache=True)
def darken_rays(fate, within, start_cells, covered, enclosed):
    """Take the light from rays of patches `within` that start in covered cells.

    What starts in an enclosed cell does not count; in the cells along the edge of the covered part each ray speaks for
    itself, else the edge would count twice. What leaves downwards from a covered cell, below the ground or through a
    missing floor, meets no lit ground.
    """
    for place, patch in enumerate(within):
        for ray in range(fate.shape[1]):
            cell = start_cells[patch, ray]
            if enclosed[place, cell] or (covered[place, cell] and fate[patch, ray] == FAR_GROUND):
                fate[patch, ray] = DARK


@njit(nogil=True, cache=True)
def judge_rays(hit, directions, facing, fate, suspect):
    """What becomes of each ray, and patches with rays that meet backs, written into the last two.

    Parameters
    ----------
    hit : (c, rays) int32
    directions : (3, c, rays) float32
    facing : (p, 4) float32
    fate : (c, rays) uint8
    suspect : (c,) bool
    """
    for patch in range(len(hit)):
        for ray in range(hit.shape[1]):
            met = hit[patch, ray]
            x, y, z = directions[0, patch, ray], directions[1, patch, ray], directions[2, patch, ray]
            if met < 0:
                fate[patch, ray] = SKY if z > 0 else FAR_GROUND
                continue
            along = x * facing[met, 0] + y * facing[met, 1] + z * facing[met, 2] + facing[met, 3]
            fate[patch, ray] = BACK if along > 0 else FRONT
            suspect[patch] |= along > 0


@njit(nogil=True, cache=True)
def judge_cells(fate, start_cells):
    """Which cells of patches lie inside something, as far as their own rays agree on it.

    A cell none of whose rays meets a back is open, one all of whose rays do is covered. Rays that leave downwards say
    nothing: they may come from an open place, or from below the ground.

    Parameters
    ----------
    fate, start_cells : (c, rays) uint8

    Returns
    -------
    (c, CELL_DIVISIONS²) int8
        COVERED, OPEN or UNKNOWN.
    """
    verdict = np.full((len(fate), CELL_DIVISIONS**2), UNKNOWN)
    backs, others, below = np.zeros((3, CELL_DIVISIONS**2), np.int64)
    for patch in range(len(fate)):
        backs[:], others[:], below[:] = 0, 0, 0
        for ray in range(fate.shape[1]):
            met, cell = fate[patch, ray], start_cells[patch, ray]
            backs[cell] += met == BACK
            below[cell] += met == FAR_GROUND
            others[cell] += met in (SKY, FRONT)
        for cell in range(CELL_DIVISIONS**2):
            if backs[cell] == 0 and others[cell] >= AGREEING_RAYS:
                verdict[patch, cell] = OPEN
            elif backs[cell] >= AGREEING_RAYS and others[cell] == below[cell] == 0:
                verdict[patch, cell] = COVERED
    return verdict


@njit(nogil=True, cache=True)
def tally_rays(fate, start_cells, asked, cell_of, cells):
    """Shares of rays that reach sky and far ground, in each replicate and in each cell.

    Parameters
    ----------
    fate : (c, rays) uint8
    start_cells : (c, rays) uint8
    asked : (c, CELL_DIVISIONS²) bool
        Of `ask_each_ray`.
    cell_of : (CELL_DIVISIONS²,) int
        The larger cell in which each of these lies.
    cells : int
        Number of larger cells.

    Returns
    -------
    sky, far_ground : (c, HEMISPHERE_REPLICATES) float32
    element_sky : (c, cells) float32
        Of the open part of each; that of the whole patch where too few rays start in its cells.
    element_far_ground : (c, cells) float32
        Of all rays of the patch.
    open_share : (c, cells) float32
        Of the rays that start in each cell.
    """
    count, rays = fate.shape
    sky, far_ground = np.empty((2, count, HEMISPHERE_REPLICATES), np.float32)
    element_sky, element_far_ground, open_share = np.empty((3, count, cells), np.float32)
    per_replicate, enough = rays // HEMISPHERE_REPLICATES, rays >= FEWEST_RAYS * cells
    free, below, started, all_rays = np.empty((4, cells), np.int64)
    for patch in range(count):
        free[:], below[:], started[:], all_rays[:] = 0, 0, 0, 0
        for replicate in range(HEMISPHERE_REPLICATES):
            upwards, downwards = 0, 0
            for ray in range(replicate * per_replicate, (replicate + 1) * per_replicate):
                start, met = start_cells[patch, ray], fate[patch, ray]
                cell = cell_of[start]
                upwards += met == SKY
                downwards += met == FAR_GROUND
                free[cell] += met == SKY
                below[cell] += met == FAR_GROUND
                all_rays[cell] += 1
                started[cell] += (not asked[patch, start]) | (met < BACK)
            sky[patch, replicate] = np.float32(upwards) / np.float32(per_replicate)
            far_ground[patch, replicate] = np.float32(downwards) / np.float32(per_replicate)
        whole = np.float32(free.sum() / max(started.sum(), 1))
        for cell in range(cells):
            open_share[patch, cell] = started[cell] / all_rays[cell] if all_rays[cell] else 1
            element_far_ground[patch, cell] = below[cell] / rays
            told = enough & (all_rays[cell] > 0)
            element_sky[patch, cell] = free[cell] / max(started[cell], 1) if told else whole
    return sky, far_ground, element_sky, element_far_ground, open_share
