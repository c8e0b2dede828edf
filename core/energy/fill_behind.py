"""Visible share of suns that are not traced because they are behind a surface.

A traced sun represents hours around it. It may be just behind a wall, where nothing is traced, while the sun of an
actual hour is just in front of it:

        wall
         |   × actual hour
         |
      ×  |       the traced sun gets the visible share of the next traced sun in front of the wall
         |
"""

import numpy as np
from scipy.spatial import KDTree

GRAZING = 1e-6  # cosine of incidence up to which a sun counts as behind
NEAREST = 24  # other suns that are considered


def order_neighbours(suns):
    """For each sun, the others in the order in which their visible shares are used instead.

    Parameters
    ----------
    suns : Suns

    Returns
    -------
    numpy.ndarray, (s, m) int
        First those of the same day, by the number of steps between them; then the nearest in the sky.
    """
    if not len(suns):
        return np.zeros((0, 1), int)
    count = min(NEAREST + 1, len(suns))
    near = KDTree(suns.direction).query(suns.direction, k=np.arange(1, count + 1))[1]
    if suns.day[0] < 0:
        return near
    # Sort all suns of a day by their distance in steps; a short day repeats its last sun.
    longest = np.unique(suns.day, return_counts=True)[1].max()
    same = np.empty((len(suns), longest), near.dtype)
    for day in np.unique(suns.day):
        members = np.flatnonzero(suns.day == day)
        distance = np.abs(suns.step[members][:, None] - suns.step[members][None, :])
        order = members[np.argsort(distance, axis=1, kind="stable")]
        same[members] = order[:, np.minimum(np.arange(longest), len(members) - 1)]
    return np.concatenate([same, near], axis=1)


def fill_behind(visible_share, projection, neighbours, reach, openness):
    """Give suns just behind a surface the visible share of the nearest sun in front of it.

    Parameters
    ----------
    visible_share : numpy.ndarray, (s, n)
        Share of each surface from which each sun is visible; filled in place.
    projection : numpy.ndarray, (s, n)
        Cosine between surface normals and suns, negative if behind.
    neighbours : numpy.ndarray, (s, m) int
        From `order_neighbours`.
    reach : float
        Largest angle between an hour and its traced suns [°]: suns further behind represent no hour in front.
    openness : numpy.ndarray, (n,)
        Share used if no traced sun is in front.
    """
    front = projection > GRAZING
    sun, surface = np.nonzero(~front & (projection > -np.sin(np.radians(min(reach, 90.0)))))
    visible_share[sun, surface] = openness[surface]
    for rank in range(neighbours.shape[1]):
        other = neighbours[sun, rank]
        in_front = front[other, surface]
        visible_share[sun[in_front], surface[in_front]] = visible_share[other[in_front], surface[in_front]]
        sun, surface = sun[~in_front], surface[~in_front]
        if not len(sun):
            return


def filled_share(transfer, rows, neighbours, reach, dtype=np.float32):
    """Visible share of some surfaces of a Transfer for each sun, those just behind filled in: (s, n).

    Parameters
    ----------
    transfer : Transfer
    rows : numpy.ndarray or slice
        n surfaces.
    neighbours, reach
        As in `fill_behind`.
    dtype : numpy dtype
    """
    normal = transfer.surfaces.normal[rows].T
    visible = np.array(transfer.visible_share[rows].T, dtype, order="C")
    # For a surface that no traced sun reaches: the visible share of the part of the sky that it faces.
    openness = np.clip(transfer.sky_view_factor[rows] / np.maximum((1.0 + normal[2]) / 2.0, 1e-9), 0.0, 1.0)
    fill_behind(visible, transfer.suns.direction @ normal, neighbours, reach, openness)
    return visible
