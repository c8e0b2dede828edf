"""The horizon as a source of light: a band of uniform azimuth, weighed like a line at the horizon itself.

             normal n
               ↑   ╱ d: towards the band, at azimuth φ from n, 0° to 6.5° high
    surface ═══╪══╱════
               │ ╱ φ

Perez's horizon gives an unshaded surface F₂ sin β, for every azimuth. So does a uniform line at elevation 0, per its
irradiance of a wall:

    H = ½ ∫ max(0, n · d_h(φ)) V(φ) dφ,    d_h horizontal,    ½ sin β ∫ cos φ dφ = sin β  where V = 1

V(φ) is the visible share of the band at azimuth φ. A line without height would be hidden by the slightest rise of the
ground: Perez et al. (1987) give their band 6.5°, and so much of it may hide behind a rise here. What a surface that
leans forward cannot see of the band, because it is behind its own plane, is not missed.

References
----------
R. Perez, R. Seals, P. Ineichen, R. Stewart, D. Menicucci (1987), A new simplified version of the Perez diffuse
irradiance model for tilted surfaces. :doi:`10.1016/S0038-092X(87)80031-2`
"""

import numpy as np

HEIGHT = np.radians(6.5)  # [rad] of the band


def horizon_directions(normal, along, up):
    """Directions towards the band, with density n · d_h in azimuth.

    Parameters
    ----------
    normal : (c, 3) float32
        Of inclined surfaces.
    along, up : (c, m) float32 in [0, 1)
        Uniform numbers.

    Returns
    -------
    (c, m, 3) float32
    """
    level = level_normal(normal)
    sine = 2 * along - 1  # of the azimuth from the normal, whose cosine is the density
    cosine = np.sqrt(np.maximum(1 - sine**2, 0))
    slope = -(normal[:, 2] / np.hypot(normal[:, 0], normal[:, 1]))[:, None]
    elevation = up * visible_height(slope, cosine)
    directions = np.empty((*along.shape, 3), np.float32)
    directions[..., 0] = np.cos(elevation) * (cosine * level[:, :1] - sine * level[:, 1:])
    directions[..., 1] = np.cos(elevation) * (cosine * level[:, 1:] + sine * level[:, :1])
    directions[..., 2] = np.sin(elevation)
    return directions


def visible_height(slope, cosine):
    """Height of the band in front of a surface's own plane: [rad], at most HEIGHT.

    Parameters
    ----------
    slope : (...) float
        How far the surface leans forward: minus its upward over its horizontal part.
    cosine : (...) float
        Of the azimuth from its normal, not negative.
    """
    # In front where n_h cos φ cos e + n_z sin e > 0.
    leaning = slope > 0
    if not np.any(leaning):
        return np.full(np.broadcast(slope, cosine).shape, HEIGHT, np.float32)
    plane = np.arctan(np.divide(cosine, slope, out=np.ones(np.broadcast(slope, cosine).shape), where=leaning))
    return np.where(leaning, np.minimum(plane, HEIGHT), HEIGHT).astype(np.float32)


def weight_of_band(normal, towards):
    """What light from the band counts on a surface, so that the band is weighed like a line at the horizon.

    Parameters
    ----------
    normal : (m, 3) float
    towards : (m, 3) float
        Towards places of the band, in front of the surfaces.

    Returns
    -------
    (m,) float64
        n · d_h · cos e / (n · d), over the share of the band that is in front; 1 for walls, 0 for level surfaces.
    """
    normal, towards = np.asarray(normal, float), np.asarray(towards, float)
    level = np.hypot(normal[:, 0], normal[:, 1])
    cos_elevation = np.hypot(towards[:, 0], towards[:, 1])
    faced = np.maximum(np.einsum("ij,ij->i", normal[:, :2], towards[:, :2]), 0)  # n · d_h cos e
    met = np.maximum(np.einsum("ij,ij->i", normal, towards), 1e-9)
    slope = np.divide(-normal[:, 2], level, out=np.zeros(len(level)), where=level > 0)
    cosine = np.divide(faced, level * cos_elevation, out=np.zeros(len(level)), where=level > 0)
    share = visible_height(slope, cosine) / HEIGHT
    return np.divide(faced, met * share, out=np.zeros(len(level)), where=share > 0)


def lies_in_band(directions):
    """Whether directions of the sky lie in the band: (m,) bool."""
    return directions[:, 2] < np.sin(HEIGHT)


def directions_inwards(axis, sign, numbers):
    """Directions of light from the band, inwards from the sides of a box around a scene.

    Parameters
    ----------
    axis, sign : (m,)
        Axis and sign of the inward normal.
    numbers : (m, 2) float64
        Uniform.

    Returns
    -------
    (m, 3) float64
    """
    lid = axis == 2
    # Through the lid all azimuths are equally dense, and elevations as tan e; through sides as cos φ, and evenly.
    turn = 2 * np.pi * numbers[:, 0]
    elevation = np.where(lid, np.arccos(np.cos(HEIGHT) ** numbers[:, 1]), HEIGHT * numbers[:, 1])
    across = np.where(lid, np.sin(turn), 2 * numbers[:, 0] - 1)
    along = np.where(lid, np.cos(turn), sign * np.sqrt(np.maximum(1 - across**2, 0)))
    x, y = np.where(axis == 1, across, along), np.where(axis == 1, along, across)
    return np.stack([np.cos(elevation) * x, np.cos(elevation) * y, -np.sin(elevation)], axis=1)


def level_normal(normal):
    """Horizontal direction that surfaces face: (c, 2), of unit length."""
    return normal[:, :2] / np.hypot(normal[:, 0], normal[:, 1])[:, None]


def horizon_of_tilt(normal):
    """Light of the horizon on an unobstructed surface, sin(tilt), from its normal: (n,)."""
    return np.hypot(normal[:, 0], normal[:, 1])
