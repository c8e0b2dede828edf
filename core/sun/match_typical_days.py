"""Match the days of a year to typical days."""

import numpy as np

NEAR = np.cos(np.radians(15.0))  # motion of the sun in one hour


def match_typical_days(suns, direction, day):
    """The traced sun that represents each sunny interval.

    Each solar day is assigned the typical day with the smallest mean angle between its suns and those of the day; each
    interval the nearest sun of that typical day, or, if that is more than 15° away, the nearest of all suns.

    Parameters
    ----------
    suns : Suns
        Suns of typical days.
    direction : numpy.ndarray, (t, 3)
        Towards the suns of the sunny intervals.
    day : numpy.ndarray, (t,) int
        Solar day of each interval.

    Returns
    -------
    numpy.ndarray, (t,) int64
        Index into the suns.
    """
    typical = np.unique(suns.day)
    nearest = np.empty((len(direction), len(typical)), np.int64)
    cosine = np.empty((len(direction), len(typical)))
    for column, own in enumerate(typical):
        members = np.flatnonzero(suns.day == own)
        projection = direction @ suns.direction[members].T
        place = projection.argmax(axis=1)
        nearest[:, column] = members[place]
        cosine[:, column] = projection[np.arange(len(direction)), place]
    # Sum the angles over each day and choose the typical day with the least.
    _, number = np.unique(day, return_inverse=True)
    angles = np.zeros((number.max(initial=-1) + 1, len(typical)))
    np.add.at(angles, number, np.arccos(np.clip(cosine, -1.0, 1.0)))
    row = np.arange(len(direction))
    chosen = angles.argmin(axis=1)[number]
    chosen = np.where(cosine[row, chosen] < NEAR, cosine.argmax(axis=1), chosen)
    return nearest[row, chosen]
