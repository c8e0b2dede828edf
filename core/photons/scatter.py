"""Reflect photons by the BRDF of the patch they hit."""

import numpy as np

from ..rays.random_numbers import GOLDEN, mix, uniform
from ..rays.sample_points import cosine_direction

NUMBERS = 3  # random numbers per reflection: two for the direction, one for a choice
STREAM = np.uint64(0x5CA77E4)
FLATTEST = 1e-7  # smallest cosine of incidence, against rounding at grazing incidence


def leave_patches(patches, places, local):
    """Rays from points on patches in directions given in the patches' local frames.

    They start like hemisphere rays of gather: slightly above the patch, an offset inside its edges.

    Parameters
    ----------
    patches : Patches
    places : HitPlaces
    local : tuple of three (m,) float
        Along the two tangents and the normal.

    Returns
    -------
    origins, directions : (m, 3) float32
    """
    hit, b1, b2 = places
    b1 = np.clip(b1, 0, 1)
    b2 = np.clip(b2, 0, 1 - b1)
    edges, tangents, normal = patches.edges[hit], patches.tangents[hit], patches.normal[hit]
    origins = patches.corner[hit] + patches.offset[hit, None] * normal
    origins += b1[:, None] * edges[:, 0] + b2[:, None] * edges[:, 1]
    x, y, z = (np.asarray(part, np.float32)[:, None] for part in local)
    return origins, x * tangents[:, 0] + y * tangents[:, 1] + z * normal


def scatter(patches, places, directions, draws, brdfs):
    """Reflect photons by the BRDF of the patch that each hits.

    Parameters
    ----------
    patches : Patches
    places : HitPlaces
    directions : (m, 3) float32
        Directions of travel on arrival.
    draws : (m, NUMBERS) float32
        Uniform random numbers.
    brdfs : TriangleBrdfs
        Of the patches.

    Returns
    -------
    origins, directions : (m, 3) float32
    share : (m,) float64
        Sample weight: reflected share of the light.
    """
    hit = places[0]
    share = patches.albedo[hit].astype(float)
    local = np.stack(cosine_direction(draws[:, 0], draws[:, 1]))
    others, brdf_index = brdfs
    for index, brdf in enumerate(others):
        chosen = np.flatnonzero(brdf_index[hit] == index)
        arriving = arrive_on_patches(patches, hit[chosen], directions[chosen])
        leaving, share[chosen] = brdf.sample(arriving, draws[chosen])
        local[:, chosen] = leaving.T
    return *leave_patches(patches, places, local), share


def arrive_on_patches(patches, hit, directions):
    """Directions towards the origin of light, in the local frames of the patches: (m, 3) float64, unit length."""
    axes = np.concatenate([patches.tangents[hit], patches.normal[hit, None]], axis=1).astype(float)
    arriving = -np.einsum("mij,mj->mi", axes, directions.astype(float))
    arriving[:, 2] = np.maximum(arriving[:, 2], FLATTEST)
    return arriving / np.linalg.norm(arriving, axis=1, keepdims=True)


def draw_for_photons(key, number, bounce):
    """Random numbers of photons at a bounce: (m, NUMBERS) float32.

    Parameters
    ----------
    key : uint64
        Of the source.
    number : (m,) int64
        Index of the photon among all of its source.
    bounce : int
    """
    own = mix(key + mix(number.astype(np.uint64) ^ STREAM))
    return uniform(own + np.uint64(bounce * NUMBERS * int(GOLDEN) % 2**64), NUMBERS)
