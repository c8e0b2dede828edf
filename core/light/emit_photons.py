"""Emit photons: light of sun, sky and far ground enters through the bounding box of the scene.

       sky                      All light that can reach the scene passes through its bounding box,
                                with the
    ↘   ↓   ↙                   same ray density as from the paper's sun-facing disk (Eq. 3) and sky
  ┌───────────┐ lid             hemisphere (Eq. 1). But no ray misses the box, rays that would rise
                                from
↘ │   ▟▙      │ ↙  sky, sun     the sky are never generated, and nothing depends on the radius of the
↗ │▂▂▂██▂▂▂▂▂▂│ ↖  far ground   hemisphere or the axes of the disk. All photons of a source have equal power.
  └───────────┘ bottom
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..rays.random_numbers import GOLDEN, keys_of_names, mix
from ..sky.horizon import TerrainHorizon
from ..sky.horizon_band import HorizonBand

# lid, bottom, sides
INWARDS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], float)
# Shares of isotropic light that enter through each side: all of it through lid or bottom, half
# through the others.
FROM_ABOVE, FROM_BELOW = np.array([1, 0, 0.5, 0.5, 0.5, 0.5]), np.array([0, 1, 0.5, 0.5, 0.5, 0.5])


@dataclass
class _Source:
    """Light that enters the box: from a sun, isotropic from above or below the horizon, or from a
    part of the sky.
    """

    name: str
    low: np.ndarray  # (3,) float64 [m], corner of the box
    size: np.ndarray  # (3,) float64 [m]
    # (6,) float64 [m²], power entering through each side of the box, per irradiance
    power: np.ndarray
    key: np.uint64  # of its random numbers
    # (3,) float64, direction of a sun's rays; None if the light is isotropic
    travel: np.ndarray | None = None
    rising: bool = False  # from below the horizon
    behind: int = 0  # reflections that its light has behind it already, where it enters
    of: HorizonBand | None = None  # a traced source in the sky; None: sun, dome or ground
    terrain: TerrainHorizon | None = None  # of distant terrain, which covers a part of the light
    # whether only light from below that horizon counts, or only that from above
    beyond: bool = False


class Box(NamedTuple):
    """Box through which light enters a scene."""

    low: np.ndarray  # (3,) float64 [m], its lowest corner
    size: np.ndarray  # (3,) float64 [m]


def box_of_scene(scene, canopy=None):
    """Bounding box of all triangles and crowns, with a small margin: Box."""
    if not len(scene.triangles):
        return Box(np.zeros(3), np.zeros(3))
    points = np.asarray(scene.vertices, float)[scene.triangles.ravel()]
    if canopy is not None:
        points = np.concatenate([points, canopy.vertices])
    low, high = points.min(axis=0), points.max(axis=0)
    # The box is wider than the scene by 64 roundings of its largest coordinate.
    margin = 64 * np.finfo(np.float32).eps * float(np.abs(points).max())
    return Box(low - margin, high - low + 2 * margin)


def make_source(name, box, seed, shares, **details):
    """A Source of irradiance 1, of normal irradiance 1 if it is a sun.

    Parameters
    ----------
    name : str
        Tells its random numbers from other sources' numbers.
    box : Box
    seed : int
    shares : (6,) float
        Of its light that enter through each side of the box, per area.
    details
        Further fields of Source.
    """
    x, y, z = box.size
    areas = np.array([x * y, x * y, y * z, y * z, x * z, x * z])  # of lid, bottom and sides
    return _Source(name, *box, shares * areas, keys_of_names([name], seed)[0][0], **details)


def emit_photons(source, replicate, place):
    """Origins and directions of photons.

    Parameters
    ----------
    source : Source
    replicate, place : (m,) int64
        Index of the photon set, and of the photon in it.

    Returns
    -------
    origins, directions : (m, 3) float32
    """
    numbers = low_discrepancy(source.key, replicate, place, 2 if source.travel is not None else 4)
    # A side of the box is drawn by its power, then a place on it. Coordinates are first along the
    # side's normal, and two across.
    side, along = choose_by_power(source.power, numbers[:, 0])
    axis, sign = np.abs(INWARDS).argmax(axis=1)[side], INWARDS.sum(axis=1)[side]  # of the normal
    # along the normal, then in the side
    frame = (
        np.arange(len(side))[:, None],
        (axis[:, None] + np.arange(3)) % 3,
    )
    share, directions = np.empty((2, len(side), 3))
    # the far side if light enters against the axis
    share[frame] = np.stack([sign < 0, along, numbers[:, 1]], axis=1)
    origins = source.low + share * source.size
    # Rays of a sun are parallel; a traced part of the sky has a law of its own.
    if source.travel is not None:
        directions = np.broadcast_to(source.travel, origins.shape)
    elif source.of is not None:
        directions = source.of.enter(axis, sign, numbers[:, 2:])
    else:
        # Cosine-distributed inwards, and mirrored at the horizon where they have the wrong sign:
        # isotropic light has the same density on both sides of it.
        radius, turn = np.sqrt(numbers[:, 2]), 2 * np.pi * numbers[:, 3]
        inwards = sign * np.sqrt(1 - numbers[:, 2])
        directions[frame] = np.stack(
            [inwards, radius * np.cos(turn), radius * np.sin(turn)], axis=1
        )
        directions[:, 2] = np.abs(directions[:, 2]) * (1 if source.rising else -1)
    return origins.astype(np.float32), directions.astype(np.float32)


def choose_by_power(power, number):
    """Choose rows in proportion to their power, (f,), by uniform numbers, (m,): rows (m,), and what
    is left of these.

    Rescaled within what chose its row, each number is uniform again.
    """
    bounds, lit = np.cumsum(power) / power.sum(), np.flatnonzero(power)
    row = lit[np.searchsorted(bounds[lit][:-1], number, side="right")]
    width = power[row] / power.sum()
    return row, np.clip((number - (bounds[row] - width)) / width, 0, 1)


def low_discrepancy(key, replicate, place, dimensions):
    """Independent low-discrepancy sets: an additive recurrence with a random shift per set.

    It is computed in integers modulo 2⁶⁴, so that the ten-millionth point is as exact as the first.

    Parameters
    ----------
    key : uint64
    replicate, place : (m,) int64
    dimensions : int

    Returns
    -------
    (m, dimensions) float64 in [0, 1)

    References
    ----------
    M. Roberts (2018), The unreasonable effectiveness of quasirandom sequences: the R-sequences.
    Cranley and Patterson (1976), doi:10.1137/0713071.
    """
    ratio = 2.0
    for _ in range(64):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = np.array(
        [int(2.0**64 * ratio**-power) for power in range(1, dimensions + 1)], np.uint64
    )
    stream = mix(key ^ mix((replicate + 1).astype(np.uint64)))
    shifts = mix(stream[:, None] + np.arange(1, dimensions + 1, dtype=np.uint64) * GOLDEN)
    return ((shifts + place.astype(np.uint64)[:, None] * steps) >> np.uint64(11)) * 2.0**-53
