"""Hemisphere rays: what is visible from each patch of the sky, the far ground and the other
patches.

       sky                        A ray that escapes upwards reaches the sky, one that escapes
                                  downwards the far
    \\   |   /                      ground. A ray that hits the front of a patch links the two in the matrix F.
 hit ←  \\|/ → far ground          A ray that hits a back carries nothing.
═════════════ patch
"""

import numpy as np
from numba import njit

from ..patches import find_covered
from ..patches.cover_cells import enclosed_cells, unpack_cells
from ..rays import sample_points
from ..rays.faces import Fate
from ..rays.hemisphere_rays import (
    CELL_DIVISIONS,
    hemisphere_rays,
    shift_replicates,
)
from ..rays.random_numbers import mix
from ..rays.ray_scene import HitPlaces
from ..rays.sample_points import DIGITS, HEMISPHERE_REPLICATES
from ..settings.threads import map_in_order
from .form_factors import FEWEST_RAYS, count_hits
from .traced import SKY_DOME, STEP, FirstLight, RowLight, no_light

RAYS_PER_TASK = 1 << 18  # rays of a part of a task
LEAST = 1e-6  # of a source's light on an unshaded patch, up to which that does not face it


def trace_rows(city, rows, samples):
    """What the rays of some patches meet, in parts.

    Parameters
    ----------
    city : RayCity
    rows : (r,) int
        Patches.
    samples : int
        Hemisphere rays of each, a multiple of HEMISPHERE_REPLICATES.

    Yields
    ------
    list of RowLight
        Of the next patches, in their order: in each state of trees, by the same rays.
    """
    sequence, step = (
        sample_points.sobol_digits(samples // HEMISPHERE_REPLICATES),
        max(1, RAYS_PER_TASK // samples),
    )

    def trace(some):
        # Rays of cover that go on are few after some turns: more patches at a time take less.
        known = city.covered is not None
        covered = (
            city.covered[some]
            if known
            else find_covered.find_covered_cells(city.ray_scene, city.patches, some)
        )
        parts = [slice(start, start + step) for start in range(0, len(some), step)]
        return [_trace_part(city, some[part], covered[part], sequence) for part in parts]

    # A task has at most eight parts.
    size = step * max(1, min(8, -(-len(rows) // (step * city.threads))))
    for parts in map_in_order(
        trace, [rows[start : start + size] for start in range(0, len(rows), size)], city.threads
    ):
        yield from parts


def _trace_part(city, chosen, covered, sequence):
    """What the rays of some patches, (m,) int, with the same points in each replicate, meet: list
    of RowLight.

    One for each state of trees. `covered` are their cells, (m, CELL_DIVISIONS²) bool.
    """
    patches, dark = city.patches, covered.all(axis=1)
    rows, covered, lost = chosen[~dark], covered[~dark], chosen[dark]
    # Rays of all patches that are not covered as a whole, and what they meet; the others are only
    # listed in the result.
    origins, directions, start_cells = hemisphere_rays(patches, rows, sequence)
    hits, fates = _follow_rays(city, covered, (origins, directions, start_cells))
    # Beside covered cells each ray decides whether it starts in the open. Further sources, such as
    # Perez' horizon, send rays of their own.
    near_cover = _cells_near_cover(covered)
    sources = {
        source.name: _look_at_source(city, source, rows, covered, sequence)
        for source in city.sources
    }
    ray_count = {SKY_DOME: fates[0].size} | {name: count for name, (_, count) in sources.items()}
    cell_of, found = sample_points.Cells(CELL_DIVISIONS).inside(round(np.sqrt(city.elements))), []
    start_of = (
        start_cells,
        cell_of if city.start_elements > 1 else np.zeros_like(cell_of),
        city.start_elements,
    )
    # In each state of trees: sky light by element, and hits that pass light on.
    # What leaves below the line of the distant terrain ends on the far ground, not in the sky.
    for state, own in enumerate(fates):
        if city.terrain is not None:
            city.terrain.hide_rays(own, directions)
        fate, (sky, *others) = _tally_counted(city, rows, (own, start_cells, near_cover))
        first = {SKY_DOME: sky} | {name: lights[state] for name, (lights, _) in sources.items()}
        found.append(RowLight(rows, covered, lost, first, *others, hits=None, ray_count=ray_count))
        if city.reflections:
            met = hits.triangle.reshape(fate.shape), fate == Fate.FRONT
            found[-1].hits = count_hits(rows, met, (hits.b1, hits.b2), city.elements, start_of)
    return found


def _follow_rays(city, covered, rays):
    """What rays of c patches hit, and what becomes of each.

    Parameters
    ----------
    city : RayCity
    covered : (c, CELL_DIVISIONS²) bool
    rays : tuple of two (c, rays, 3) float32 and (c, rays) uint8
        Origins, directions, and the cells in which they start.

    Returns
    -------
    hits : HitPlaces
    fates : (states, c, rays) uint8
        In each state of trees.
    """
    ray_scene, patches, (origins, directions, start_cells) = city.ray_scene, city.patches, rays
    hits = ray_scene.trace_places(origins.reshape(-1, 3), directions.reshape(-1, 3))
    fate, _ = patches.classify(hits.triangle.reshape(start_cells.shape), directions)
    within = np.flatnonzero(covered.any(axis=1))
    fate[within] = _darken_rays(fate[within], start_cells[within].astype(np.intp), covered[within])
    # Along the ground line the start of each ray is tested for being below ground.
    fate[within] = np.where(
        patches.lie_in_earth(ray_scene, origins[within]), Fate.DARK, fate[within]
    )
    if ray_scene.canopy is None:
        return hits, fate[None]
    # Each replicate has random numbers of its own.
    shape = len(fate) * HEMISPHERE_REPLICATES, fate.shape[1] // HEMISPHERE_REPLICATES
    places = HitPlaces(*(part.reshape(shape) for part in hits))
    sent = origins.reshape(*shape, 3), directions.reshape(*shape, 3)
    stopped = ray_scene.stop_in_crowns(patches, sent, places, fate.reshape(shape) <= Fate.FRONT)
    return hits, np.where(stopped.reshape(-1, *fate.shape), np.uint8(Fate.LEAVES), fate)


def _look_at_source(city, source, rows, covered, sequence):
    """First light of a source in the sky on some patches, by rays towards it.

    Parameters
    ----------
    city : RayCity
    source : HorizonBand
    rows : (c,) int
        The patches.
    covered : (c, CELL_DIVISIONS²) bool
    sequence : (r, 4) uint32
        Points of each replicate of their hemisphere rays; the first ones serve here.

    Returns
    -------
    list of FirstLight
        In each state of trees, in the unit of `Traced.first`.
    ray_count : int
    """
    unshaded = source.unshaded(city.patches.normal[rows]).astype(np.float32)
    facing = np.flatnonzero(unshaded > LEAST)
    lights = [no_light(len(rows), city.elements) for _ in range(city.ray_scene.states)]
    if not len(facing):
        return lights, 0
    covered, sequence = covered[facing], sequence[: -(-len(sequence) // city.rays_share)]
    rays = source_rays(city.patches, source, rows[facing], sequence, share=city.rays_share)
    near_cover, scale = _cells_near_cover(covered), unshaded[facing, None]
    fates = _follow_rays(city, covered, rays)[1]
    fates[fates == Fate.FAR_GROUND] = Fate.SKY  # at the very horizon
    for light, fate in zip(lights, fates, strict=True):
        if city.terrain is not None:
            city.terrain.hide_rays(fate, rays[1])
        _, (first, *_) = _tally_counted(city, rows[facing], (fate, rays[2], near_cover))
        light.put(facing, FirstLight(scale * first.light, scale * first.element, first.deviation))
    return lights, fates[0].size


def source_rays(patches, source, chosen, sequence, *, share):
    """Rays from random points of patches towards a source, as `hemisphere_rays` are made, one for
    `share` of these.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
    cells : (c, rays) uint8
        Of CELL_DIVISIONS², in which each ray starts.
    """
    keys = mix(patches.key[chosen] ^ source.stream)
    # Points of the net continue earlier rounds' points, shifted by each patch's own digits.
    digits = (
        sequence[None, None]
        ^ shift_replicates(keys, patches.rays_before[chosen] // share)[:, :, None]
    )
    numbers = (digits.reshape(len(chosen), -1, 4) * np.float32(2.0**-DIGITS)).astype(np.float32)
    b1, b2 = sample_points.barycentric_of_square(numbers[..., 0], numbers[..., 1])
    directions = source.sample(patches.normal[chosen], numbers[..., 2], numbers[..., 3])
    return (
        patches.points(chosen, b1, b2),
        directions,
        sample_points.Cells(CELL_DIVISIONS).of_point(b1, b2),
    )


def _cells_near_cover(covered):
    """Cells that are covered or touch a covered one: (c, cells) bool.

    In these, whether a ray starts in the open is decided ray by ray: it does if it does not hit a
    back.

    Parameters
    ----------
    covered : (c, cells) bool
    """
    near_cover, within = np.zeros(covered.shape, bool), covered.any(axis=1)
    # all but open cells surrounded by open ones
    near_cover[within] = ~enclosed_cells(~covered[within])
    return near_cover


def _darken_rays(fate, start_cells, covered):
    """Fates of rays, (c, rays), with DARK for rays that start in covered cells, (c,
    CELL_DIVISIONS²) bool.

    All rays from enclosed cells are dark. In cells along the edge of the covered part each ray is
    judged by what it hits, or the edge would count twice. Rays that escape downwards from a covered
    cell, below the ground or through a missing floor, do not reach lit ground.
    """
    within, inside = (
        np.take_along_axis(cells, start_cells, axis=1)
        for cells in (covered, enclosed_cells(covered))
    )
    return np.where(inside | (within & (fate == Fate.FAR_GROUND)), np.uint8(Fate.DARK), fate)


def _tally_counted(city, chosen, rays):
    """Tally of rays; rays from cells that are left out do not count for what patches receive.

    What elements of patches pass on of first light holds all of it: it leaves gaps again.

    Parameters
    ----------
    city : RayCity
    chosen : (c,) int
        Patches.
    rays : tuple of (c, rays) uint8, (c, rays) uint8 and (c, CELL_DIVISIONS²) bool
        The first three parameters of `_tally_rays`.

    Returns
    -------
    fate : (c, rays) uint8
        DARK from such cells.
    tally : tuple
        Of `_tally_rays`.
    """
    fate, tally = rays[0], _tally_rays(*rays, city.elements)
    if city.left_out is None or not city.left_out[chosen].any():
        return fate, tally
    some = np.flatnonzero(city.left_out[chosen])
    starts = np.take_along_axis(
        unpack_cells(city.left_out[chosen[some]]), rays[1][some].astype(np.intp), axis=1
    )
    fate = fate.copy()
    fate[some] = np.where(starts, np.uint8(Fate.DARK), fate[some])
    # The light without these rays; elements keep what they pass on.
    less = _tally_rays(fate[some], *(part[some] for part in rays[1:]), city.elements)
    tally[0].light[some] = less[0].light
    for part, counted in zip(tally[1:3], less[1:3], strict=True):
        part[some] = counted
    return fate, tally


def _tally_rays(fate, start_cells, near_cover, cells, *, most_steps=32767):
    """Shares of rays that reach sky and far ground, in each replicate and in each cell.

    Parameters
    ----------
    fate : (c, rays) uint8
    start_cells : (c, rays) uint8
    near_cover : (c, CELL_DIVISIONS²) bool
        Of `_cells_near_cover`.
    cells : int
        Number of larger cells: 1, 4 or 16.

    Returns
    -------
    FirstLight
        Of the sky.
    far_ground : (c, HEMISPHERE_REPLICATES) float32
    element_far_ground, open_share : (c, cells) float32
        As of RowLight.
    """
    rays, counts = fate.shape[1], np.zeros((4, len(fate), HEMISPHERE_REPLICATES, cells), np.int32)
    # In each replicate and cell: all rays, those to the far ground, to the sky, and from the open.
    _count_fates(
        (fate, start_cells, near_cover),
        sample_points.Cells(CELL_DIVISIONS).inside(round(np.sqrt(cells))),
        counts,
    )
    every, downwards, free, started = counts.astype(np.float32)
    sky, far_ground = (
        part.sum(axis=2) / np.float32(rays // HEMISPHERE_REPLICATES) for part in (free, downwards)
    )
    every, below, opened = (part.sum(axis=1) for part in (every, downwards, started))
    open_share = np.divide(opened, every, out=np.ones_like(every), where=every > 0)
    # A cell in which no ray starts counts as open. Where too few rays start in each cell, the
    # visible sky is by the patch as a whole.
    resolved = ((rays >= FEWEST_RAYS * cells) & (every > 0))[:, None]
    free, started = (
        np.where(resolved, part, part.sum(axis=2, keepdims=True)) for part in (free, started)
    )
    # The visible sky is a ratio of two counts; the deviation of each replicate from it is
    # linearised in both.
    total = np.maximum(started.sum(axis=1, keepdims=True), 1)
    mean = free.sum(axis=1, keepdims=True) / total
    steps = np.rint((free - mean * started) * HEMISPHERE_REPLICATES / total / STEP)
    # Deviations are kept as 16-bit numbers of steps, and cut off at `most_steps`.
    deviation = np.ascontiguousarray(
        np.clip(steps, -most_steps, most_steps).astype(np.int16).swapaxes(1, 2)
    )
    return FirstLight(sky, mean[:, 0], deviation), far_ground, below / np.float32(rays), open_share


@njit(nogil=True, cache=True)
def _count_fates(rays, cell_of, counts):
    """Count the rays of each replicate that start in each larger cell: all, those to the far
    ground, those to the sky, and those that start in the open.

    Parameters
    ----------
    rays : tuple of (c, rays) uint8, (c, rays) uint8 and (c, CELL_DIVISIONS²) bool
        The first three parameters of `_tally_rays`.
    cell_of : (CELL_DIVISIONS²,) int
        The larger cell that contains each of these.
    counts : (4, c, HEMISPHERE_REPLICATES, cells) int32
        Written.
    """
    (fate, start_cells, near_cover), (every, downwards, free, started) = rays, counts
    per_replicate = fate.shape[1] // HEMISPHERE_REPLICATES
    for patch in range(len(fate)):
        for replicate in range(HEMISPHERE_REPLICATES):
            for ray in range(replicate * per_replicate, (replicate + 1) * per_replicate):
                start, met = start_cells[patch, ray], fate[patch, ray]
                cell = cell_of[start]
                every[patch, replicate, cell] += 1
                downwards[patch, replicate, cell] += met == Fate.FAR_GROUND
                free[patch, replicate, cell] += met == Fate.SKY
                started[patch, replicate, cell] += (not near_cover[patch, start]) | (
                    met < Fate.BACK
                )
