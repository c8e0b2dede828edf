"""Cosine-distributed rays from random points of patches."""

import numpy as np
from numba import njit

from .random_numbers import uniform
from .sample_points import REPLICATES

CELL_DIVISIONS = 8  # each patch is judged in 64 cells, whether they lie inside or under something
HALF, ONE, TURN = np.float32(0.5), np.float32(1), np.float32(2 * np.pi)


def hemisphere_rays(patches, chosen, sequence):
    """Origins, directions and cells of the hemisphere rays of some patches.

    Position and direction come from one four-dimensional sequence, shifted for each patch and replicate: pairs from
    two-dimensional ones would be correlated.

    Parameters
    ----------
    patches : Patches
    chosen : (c,) int
    sequence : (rays / REPLICATES, 4) float32
        Of `additive_recurrence`.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
    cells : (c, rays) uint8
        Which of the patch's CELL_DIVISIONS² cells each ray starts in.
    """
    count, rays = len(chosen), len(sequence) * REPLICATES
    shifts = uniform(patches.key[chosen], 4 * REPLICATES).reshape(count, REPLICATES, 4)
    origins, directions = np.empty((2, count, rays, 3), np.float32)
    cells = np.empty((count, rays), np.uint8)
    frames = np.concatenate([patches.tangents, patches.normal[:, None]], axis=1)[chosen]
    start = patches.corner[chosen] + patches.offset[chosen, None] * patches.normal[chosen]
    make_rays((start, patches.edges[chosen], frames), shifts, sequence, (origins, directions, cells))
    return origins, directions, cells


@njit(nogil=True, cache=True)
def make_rays(places, shifts, sequence, made):
    """Make the rays of c patches; the same formulas, in numpy, stand in `sample_points`.

    Parameters
    ----------
    places : tuple of (c, 3), (c, 2, 3) and (c, 3, 3) float32
        Where the rays start: corner, edges and frame of each patch.
    shifts : (c, REPLICATES, 4) float32
    sequence : (rays / REPLICATES, 4) float32
    made : tuple of (c, rays, 3), (c, rays, 3) float32 and (c, rays) uint8
        Written: origins, directions, cells.
    """
    (start, edges, frames), (origins, directions, cells) = places, made
    length = len(sequence)
    cosine, sine = np.cos(TURN * sequence[:, 3]), np.sin(TURN * sequence[:, 3])
    for patch in range(len(start)):
        ray = 0
        for replicate in range(shifts.shape[1]):
            shift = shifts[patch, replicate]
            # The angle is shifted by turning its sine and cosine.
            cosine_shift, sine_shift = np.cos(TURN * shift[3]), np.sin(TURN * shift[3])
            for sample in range(length):
                s, t = moved(sequence[sample, 0], shift[0]), moved(sequence[sample, 1], shift[1])
                u = moved(sequence[sample, 2], shift[2])
                b1 = s * HALF if t > s else s - t * HALF
                b2 = t - s * HALF if t > s else t * HALF
                radius, height = np.sqrt(u), np.sqrt(max(ONE - u, np.float32(0)))
                along = radius * (cosine[sample] * cosine_shift - sine[sample] * sine_shift)
                across = radius * (sine[sample] * cosine_shift + cosine[sample] * sine_shift)
                for axis in range(3):
                    origins[patch, ray, axis] = (
                        start[patch, axis] + b1 * edges[patch, 0, axis] + b2 * edges[patch, 1, axis]
                    )
                    directions[patch, ray, axis] = (
                        along * frames[patch, 0, axis]
                        + across * frames[patch, 1, axis]
                        + height * frames[patch, 2, axis]
                    )
                cells[patch, ray] = cell_at(b1, b2, CELL_DIVISIONS)
                ray += 1


@njit(nogil=True, cache=True, inline="always")
def moved(number, shift):
    """A number in [0, 1), shifted on the torus."""
    number += shift
    return number - ONE if number >= ONE else number


@njit(nogil=True, cache=True)
def cell_at(b1, b2, divisions):
    """Which of the `divisions`² congruent sub-triangles holds a point: `cell_of_point` for one point."""
    row = int(min(b2 * np.float32(divisions), np.float32(divisions - 1)))
    along = int(min(b1 * np.float32(divisions), np.float32(divisions - 1)))
    inverted = (b1 + b2) * np.float32(divisions) - np.float32(row) - np.float32(along) >= ONE
    return row * (2 * divisions - row) + min(2 * along + int(inverted), 2 * (divisions - 1 - row))


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
