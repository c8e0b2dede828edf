"""What each patch sees of the sky, of the far ground and of the other patches.

       sky                        A ray that leaves upwards meets the sky, one that leaves downwards the far
    \\   |   /                      ground. A ray that meets the front of a patch joins the two in the matrix F.
 hit ←  \\|/ → far ground          A ray that meets a back carries nothing.
═════════════ patch
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..errors import InputError
from .check_arrays import check_array
from .random_numbers import mix, uniform
from .ray_scene import map_in_order
from .sample_points import (
    REPLICATES,
    additive_recurrence,
    barycentric_of_square,
    cell_contacts,
    cell_of_point,
    cosine_direction,
    shifted,
    stratified_points,
)

RAYS_PER_TASK = 1 << 16
CELL_DIVISIONS = 8  # each patch is judged in 64 cells, whether they lie inside or under something
RAYS_PER_CELL = 8  # the vote that judges
STRAY_RAYS = 1  # of them that may find a hole to the sky from the inside of an open shell


@dataclass
class Hemisphere:
    """What the hemisphere rays of p patches met."""

    sky: np.ndarray  # (p, REPLICATES) float32, share of rays that reach the sky
    far_ground: np.ndarray  # (p, REPLICATES) float32, share that leaves below the horizon
    form_factors: sparse.csr_matrix | None  # (p · REPLICATES, p) float32, share that meets each other patch's front
    covered_share: np.ndarray  # (p,) float32, share of the patch that lies inside or under something
    enclosed: np.ndarray  # (p, CELL_DIVISIONS²) bool, covered cells all around which the patch is covered too
    ray_count: int


def trace_hemisphere(ray_scene, patches, traced, *, sample_count, reflections, threads, progress):
    """Trace cosine-distributed rays from every traced patch.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need rays. The others get zeros.
    sample_count : int
        Rays per patch, a multiple of REPLICATES.
    reflections : bool
        Whether the matrix of form factors is wanted.
    threads : int
    progress : callable
        See `core.progress`.

    Returns
    -------
    Hemisphere

    Raises
    ------
    InputError
        If `traced` or `sample_count` cannot be used, or a ray would not be finite.
    """
    check_array("traced", traced, (len(patches),), kind="b")
    if sample_count < REPLICATES or sample_count % REPLICATES:
        raise InputError("sample_count", f"{sample_count} rays", f"give a multiple of {REPLICATES}")
    sequence = additive_recurrence(sample_count // REPLICATES, 4)
    rows = np.flatnonzero(traced)
    step = max(1, RAYS_PER_TASK // sample_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def trace_rows(chosen):
        return trace_patches(ray_scene, patches, chosen, sequence, reflections)

    count = len(patches)
    sky = np.zeros((count, REPLICATES), np.float32)
    far_ground = np.zeros((count, REPLICATES), np.float32)
    covered_share = np.zeros(count, np.float32)
    enclosed = np.zeros((count, CELL_DIVISIONS**2), bool)
    entries = np.zeros(count * REPLICATES, np.int64)
    indices, shares = [], []
    done = 0
    for chosen, found in zip(tasks, map_in_order(trace_rows, tasks, threads), strict=True):
        sky[chosen], far_ground[chosen], covered_share[chosen], enclosed[chosen], matrix_rows = found
        if reflections:
            entries[(chosen[:, None] * REPLICATES + np.arange(REPLICATES)).ravel()] = matrix_rows[0]
            indices.append(matrix_rows[1])
            shares.append(matrix_rows[2])
        done += len(chosen) * sample_count
        progress("sky and reflections", done, len(rows) * sample_count, "rays")
    return Hemisphere(
        sky=sky,
        far_ground=far_ground,
        form_factors=matrix_of_rows(entries, indices, shares, count) if reflections else None,
        covered_share=covered_share,
        enclosed=enclosed,
        ray_count=len(rows) * sample_count,
    )


def trace_patches(ray_scene, patches, chosen, sequence, reflections):
    """Trace the hemisphere rays of some patches: the fields of `Hemisphere`, and rows of its matrix."""
    origins, directions, cells = hemisphere_rays(patches, chosen, sequence)
    count, rays = cells.shape
    hit = ray_scene.trace_closest(origins.reshape(-1, 3), directions.reshape(-1, 3)).reshape(count, rays)
    missed = hit < 0
    back = meets_back(patches, hit, directions)

    # Where a ray met a back, the patch may lie inside something. What starts in an enclosed cell does not count; in
    # the cells along the edge of the covered part each ray speaks for itself, else the edge would count twice.
    covered = np.zeros((count, CELL_DIVISIONS**2), bool)
    suspect = np.flatnonzero(back.any(axis=1))
    covered[suspect] = find_covered_cells(ray_scene, patches, chosen[suspect])
    enclosed = covered & ((~covered).astype(np.float32) @ cell_contacts(CELL_DIVISIONS) == 0)
    # What leaves downwards from a covered cell, below the ground or through a missing floor, meets no lit ground.
    open_ray, above_ground = np.ones((2, count, rays), bool)
    cell = cells[suspect].astype(np.intp)
    open_ray[suspect] = ~np.take_along_axis(enclosed[suspect], cell, axis=1)
    above_ground[suspect] = ~np.take_along_axis(covered[suspect], cell, axis=1)

    # Along the line of the ground each ray is asked whether it starts below it.
    partly = suspect[covered[suspect].any(axis=1) & ~covered[suspect].all(axis=1)]
    open_ray[partly] &= ~lie_in_earth(ray_scene, patches, origins[partly])

    upwards = directions[..., 2] > 0
    per_replicate = (count, REPLICATES, rays // REPLICATES)
    sky = (missed & upwards & open_ray).reshape(per_replicate).mean(axis=2, dtype=np.float32)
    far_ground = (missed & ~upwards & above_ground & open_ray).reshape(per_replicate).mean(axis=2, dtype=np.float32)
    matrix_rows = None
    if reflections:
        hit[back | ~open_ray] = -1
        matrix_rows = count_hits(hit.reshape(count * REPLICATES, -1))
    return sky, far_ground, covered.mean(axis=1, dtype=np.float32), enclosed, matrix_rows


def meets_back(patches, hit, directions):
    """Whether rays meet the back of a patch: they run along its normal, or it is a footprint.

    Parameters
    ----------
    hit : (c, rays) int32
        -1 where nothing is met.
    directions : (c, rays, 3) float32

    Returns
    -------
    (c, rays) bool
    """
    facing = patches.facing[hit]
    along = directions[..., 0] * facing[..., 0]
    along += directions[..., 1] * facing[..., 1]
    along += directions[..., 2] * facing[..., 2]
    along += facing[..., 3]
    return (along > 0) & (hit >= 0)


def find_covered_cells(ray_scene, patches, chosen):
    """Which cells of some patches lie inside or under something.

    One point in each cell looks around; it is covered when more than half of its rays meet backs and at most one the
    sky. Real models are open shells: a single ray decides nothing, and who looks into an open house from outside meets
    backs, but the sky too. A wall that goes on below the ground meets the ground's back upwards and nothing downwards:
    no ray of it brings light, and it is covered too. Below a slope some of its rays would leave into the sky under the
    hill; there a ray straight up tells, which meets the ground's back first.

    Returns
    -------
    (c, CELL_DIVISIONS²) bool
    """
    count, cells = len(chosen), CELL_DIVISIONS**2
    numbers = uniform(mix(patches.key[chosen] ^ np.uint64(0xC0FE)), 4 * cells).reshape(count, cells, 4)
    b1, b2 = stratified_points(numbers, CELL_DIVISIONS)
    around = additive_recurrence(RAYS_PER_CELL, 2)
    u, v = (shifted(around[:, axis], numbers[..., 2 + axis]).reshape(count, cells * RAYS_PER_CELL) for axis in (0, 1))
    origins, directions = rays_from_patches(
        patches,
        chosen,
        np.repeat(b1, RAYS_PER_CELL, axis=1),
        np.repeat(b2, RAYS_PER_CELL, axis=1),
        cosine_direction(u, v),
    )
    hit = ray_scene.trace_closest(origins.reshape(-1, 3), directions.reshape(-1, 3)).reshape(u.shape)
    back = meets_back(patches, hit, directions)
    upwards = directions[..., 2] > 0
    met = (back, (hit < 0) & upwards, (hit < 0) & ~upwards)
    back, sky, below = (rays.reshape(count, cells, RAYS_PER_CELL).sum(axis=2) for rays in met)
    inside = (2 * back > RAYS_PER_CELL) & (sky <= STRAY_RAYS)
    under = (4 * back > RAYS_PER_CELL) & (back + below == RAYS_PER_CELL)
    return inside | under | lie_in_earth(ray_scene, patches, origins[:, ::RAYS_PER_CELL])


def lie_in_earth(ray_scene, patches, points):
    """Whether the first thing straight above some points is the ground, seen from below.

    Parameters
    ----------
    points : (c, m, 3) float32 [m]

    Returns
    -------
    (c, m) bool
    """
    if not patches.ground.any():
        return np.zeros(points.shape[:2], bool)
    up = np.tile(np.float32([0, 0, 1]), (points.shape[0] * points.shape[1], 1))
    above = ray_scene.trace_closest(points.reshape(-1, 3), up)
    return ((above >= 0) & patches.ground[above] & (patches.normal[above, 2] > 0)).reshape(points.shape[:2])


def hemisphere_rays(patches, chosen, sequence):
    """Origins, directions and cells of the hemisphere rays of some patches.

    Position and direction come from one four-dimensional sequence, shifted for each patch and replicate: pairs from
    two-dimensional ones would be correlated.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
    cells : (c, rays) uint8
    """
    count = len(chosen)
    shifts = uniform(patches.key[chosen], 4 * REPLICATES).reshape(count, REPLICATES, 4)
    points = [shifted(sequence[:, axis], shifts[..., axis]).reshape(count, -1) for axis in range(4)]
    b1, b2 = barycentric_of_square(points[0], points[1])
    origins, directions = rays_from_patches(patches, chosen, b1, b2, cosine_direction(points[2], points[3]))
    return origins, directions, cell_of_point(b1, b2, CELL_DIVISIONS)


def rays_from_patches(patches, chosen, b1, b2, local):
    """Rays from points of patches, given by barycentric weights, into directions of their own frames.

    Parameters
    ----------
    chosen : (c,) int
    b1, b2 : (c, rays) float32
    local : tuple of three (c, rays) float32
        Along the two tangents and the normal.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
    """
    edges, tangents, normal = patches.edges[chosen], patches.tangents[chosen], patches.normal[chosen]
    start = patches.corner[chosen] + patches.offset[chosen, None] * normal
    origins = np.empty((*b1.shape, 3), np.float32)
    directions = np.empty((*b1.shape, 3), np.float32)
    for axis in range(3):
        origins[..., axis] = start[:, axis, None] + b1 * edges[:, 0, axis, None] + b2 * edges[:, 1, axis, None]
        directions[..., axis] = (
            local[0] * tangents[:, 0, axis, None]
            + local[1] * tangents[:, 1, axis, None]
            + local[2] * normal[:, axis, None]
        )
    return origins, directions


def count_hits(hit):
    """Rows of a sparse matrix from lists of hits.

    Parameters
    ----------
    hit : (r, m) int32
        Column hit by each of m rays, -1 for none.

    Returns
    -------
    entries : (r,) int
        Number of different columns in each row.
    columns : (e,) int32
    shares : (e,) float32
        Rays per column divided by m.
    """
    rows, rays = hit.shape
    hit = np.sort(hit, axis=1)
    new = np.ones((rows, rays), bool)
    new[:, 1:] = hit[:, 1:] != hit[:, :-1]
    first = np.flatnonzero(new)
    counts = np.diff(first, append=rows * rays)
    columns = hit.ravel()[first]
    kept = columns >= 0
    entries = np.bincount(first[kept] // rays, minlength=rows)
    return entries, columns[kept], counts[kept].astype(np.float32) / np.float32(rays)


def matrix_of_rows(entries, indices, shares, count):
    """Sparse matrix (count · REPLICATES, count) from the entries per row and the parts of columns and values."""
    parts = (
        np.concatenate([np.zeros(0, np.float32), *shares]),
        np.concatenate([np.zeros(0, np.int32), *indices]),
        np.concatenate([[0], np.cumsum(entries)]),
    )
    return sparse.csr_matrix(parts, shape=(count * REPLICATES, count))
