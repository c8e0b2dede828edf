"""Suns of some days, evenly spread over the year, and interpolation between them and between the
steps of a day.

sun's height                  ○ traced: some days, all their steps      The same step of neighbouring days lies on the
     │   ○    ○    ○          × an hour of the year: up to four days    analemma, a smooth function of the season.
     │ ○   ○× ○  ○   ○          and four steps around it
     └───────────────────► season
"""

import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from .solar_position import DAY, solar_days, solar_position, sun_direction, whole_solar_days
from .suns import TROPICAL_YEAR, Suns

EPOCH = 719_163  # 1970-01-01 as datetime.date.toordinal counts days
AROUND = np.array([-1, 0, 1, 2])


def days_of_year_suns(times, interval, latitude, longitude, *, count):
    """Suns of days evenly spread over the year.

    Each day is one of the time axis, with the sun at the middle of every interval in which it is
    above the horizon. Time steps shorter than 15 minutes are merged into steps of 15 minutes or
    slightly more.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°].
    count : int
        Number of days.

    Returns
    -------
    Suns
        Sampling "days:N", not weighted yet; `day` is the proleptic Gregorian ordinal of the day of
        local solar time.
    """
    # Intervals per step of traced suns, such that the steps divide the day.
    # In a quarter of an hour, the least between traced suns, the sun moves by 3.75°.
    every = max(1, -(-pd.Timedelta(minutes=15) // interval))
    while DAY % (interval * every) != pd.Timedelta(0) and interval * every < DAY:
        every += 1
    axis = whole_solar_days(times[::every], interval * every, longitude)
    steps = DAY // (interval * every)
    day, step = (part.reshape(-1, steps) for part in solar_days(axis, interval * every, longitude))
    # Days of all years, sorted by the time of the year.
    season = np.argsort((day[:, 0] + EPOCH) % TROPICAL_YEAR, kind="stable")
    chosen = season[((np.arange(count) + 0.5) / count * len(season)).astype(int)]
    rows = (chosen[:, None] * steps + np.arange(steps)).ravel()
    sun = solar_position(axis[rows], interval * every, latitude, longitude)
    up = sun["apparent_zenith"].to_numpy() <= 90.0
    direction = sun_direction(sun["apparent_zenith"][up], sun["solar_azimuth"][up])
    day, step = (part[chosen].ravel()[up].astype(np.int32) for part in (day + EPOCH, step))
    return Suns(
        f"days:{count}", direction, np.full(len(direction), 1.0 / max(len(direction), 1)), day, step
    )


def match_days_of_year(suns, direction, day, *, chunk=4096):
    """The traced suns around each sunny interval, and their weights.

    For each step of the day the sun's position is a smooth function of the season, the analemma;
    along it, four traced days are interpolated by a cubic. If the interval lies between two steps,
    because the weather has shorter steps or another longitude, four steps are interpolated
    likewise. Where the interpolated position is further from the sun than the nearest traced sun is
    (near sunrise and sunset, and in gaps of more than 60 days), that one is used.

    Parameters
    ----------
    suns : Suns
        Suns of days of the year.
    direction : numpy.ndarray, (t, 3)
        Towards the suns of the sunny intervals.
    day : numpy.ndarray, (t,) int
        Solar day of each interval, since 1970-01-01.

    Returns
    -------
    index : numpy.ndarray, (t, k) int64
        Into the suns; 0 where the weight is 0. k is 4 on the time axis that was traced, up to 16 on
        others.
    weight : numpy.ndarray, (t, k) float64
        Rows sum to 1; some are negative.
    """
    # A table of the traced suns: row by day in the order of the seasons, column by step of the day;
    # -1 where none stands.
    dates = np.unique(suns.day)
    dates = dates[np.argsort(dates % TROPICAL_YEAR)]
    table = np.full((len(dates), suns.step.max() + 1), -1)
    table[np.argsort(dates)[np.searchsorted(np.sort(dates), suns.day)], suns.step] = np.arange(
        len(suns)
    )
    # Of each day that is asked: the four traced days around it in the season, with cubic weights,
    # and the Sun's path that they give.
    days, which = np.unique(day, return_inverse=True)
    seasons, season_weight = _join_days(
        table, dates % TROPICAL_YEAR, (days + EPOCH) % TROPICAL_YEAR
    )
    path = np.einsum("dak,dakx->dkx", season_weight, suns.direction[seasons])
    known = season_weight.any(axis=1)
    path[known] /= np.linalg.norm(path[known], axis=1, keepdims=True)
    index, weight = np.zeros((len(day), 16), int), np.zeros((len(day), 16))
    # `chunk`: intervals at a time.
    for first in range(0, len(day), chunk):
        part = slice(first, first + chunk)
        own = which[part]
        # Along that path, the step or the four steps that the interval lies on.
        steps, step_weight = _join_steps(path[own], known[own], direction[part])
        at = own[:, None, None], np.arange(4)[None, :, None], steps[:, None, :]
        index[part] = seasons[at].reshape(-1, 16)
        weight[part] = (season_weight[at] * step_weight[:, None, :]).reshape(-1, 16)
    # Use the nearest traced sun where it is closer than the interpolated one.
    place = np.einsum("tk,tkx->tx", weight, suns.direction[index])
    length = np.linalg.norm(place, axis=1)
    place[length > 0] /= length[length > 0, None]
    distance, nearest = KDTree(suns.direction).query(direction)
    worse = np.linalg.norm(place - direction, axis=1) > distance
    index[worse], weight[worse] = 0, 0.0
    index[worse, 0], weight[worse, 0] = nearest[worse], 1.0
    # As many columns as the fullest row needs, zeros last.
    order = np.argsort(weight == 0, axis=1, kind="stable")
    index, weight = (np.take_along_axis(part, order, axis=1) for part in (index, weight))
    columns = max(1, int((weight != 0).sum(axis=1).max(initial=1)))
    return np.where(weight != 0, index, 0)[:, :columns], weight[:, :columns]


def _join_days(table, phase, place):
    """Traced suns and weights of every step of some days.

    Parameters
    ----------
    table : numpy.ndarray, (n, s) int
        Sun of each traced day and step; -1 if it is below the horizon.
    phase : numpy.ndarray, (n,)
        Time of the year of the traced days, ascending [days].
    place : numpy.ndarray, (d,)
        Time of the year of the days to interpolate [days].

    Returns
    -------
    index : numpy.ndarray, (d, 4, s) int
        0 where the weight is 0.
    weight : numpy.ndarray, (d, 4, s)
    """
    # (d, 4), cyclic over the year
    around = np.searchsorted(phase, place, side="right")[:, None] - 1 + AROUND
    nodes = phase[around % len(phase)] + TROPICAL_YEAR * (around // len(phase))
    # Over gaps of more than 60 days the sun's path is not a smooth function of the season.
    near = np.diff(nodes, axis=1) <= 60.0  # (d, 3)
    joined = np.stack(
        [near[:, 0] & near[:, 1], near[:, 1], near[:, 1], near[:, 1] & near[:, 2]], axis=1
    )
    index = table[around % len(phase)]
    known = (index >= 0) & joined[:, :, None]
    count, _, steps = index.shape
    known_rows = known.transpose(0, 2, 1).reshape(-1, 4)
    weight = cubic_weights(np.repeat(place, steps), np.repeat(nodes, steps, axis=0), known_rows)
    weight = weight.reshape(count, steps, 4).transpose(0, 2, 1)
    return np.where(weight != 0, index, 0), weight


def _join_steps(path, known, direction):
    """Steps of a day's path and their weights, for one interval of each day.

    Parameters
    ----------
    path : numpy.ndarray, (t, s, 3)
        Sun direction at each step, interpolated between the traced days.
    known : numpy.ndarray, (t, s) bool
        Whether it is known.
    direction : numpy.ndarray, (t, 3)
        Towards the sun of the interval.

    Returns
    -------
    steps : numpy.ndarray, (t, 4) int
    weight : numpy.ndarray, (t, 4)
        All 0 if no step is known.
    """
    row, count = np.arange(len(path)), path.shape[1]
    near = np.where(known, np.einsum("tsx,tx->ts", path, direction), -2.0).argmax(axis=1)
    # The other step is the neighbour on the sun's side; across midnight too, for the midnight sun.
    before, after = (near - 1) % count, (near + 1) % count
    ahead = np.where(known[row, after, None], path[row, after], path[row, near])
    behind = np.where(known[row, before, None], path[row, before], path[row, near])
    side = np.einsum("tx,tx->t", direction - path[row, near], ahead - behind)
    steps = (np.where(side >= 0, near, before)[:, None] + AROUND) % count
    have = known[row[:, None], steps]
    left, right = path[row, steps[:, 1]], path[row, steps[:, 2]]
    chord = right - left
    length = np.einsum("tx,tx->t", chord, chord)
    share = np.einsum("tx,tx->t", direction - left, chord) / np.where(length > 0, length, 1.0)
    share = np.clip(np.where(have[:, 1] & have[:, 2], share, have[:, 2]), 0.0, 1.0)
    # Closer than a twentieth of a step, the sun of the traced step itself is taken.
    share = np.where(np.abs(share - np.round(share)) < 0.05, np.round(share), share)
    # Between suns less than 6° apart linear interpolation is good enough.
    fine = np.einsum("tx,tx->t", left, right) > np.cos(np.radians(6.0))
    have[:, [0, 3]] &= ~fine[:, None]
    return steps, cubic_weights(share, np.broadcast_to(AROUND.astype(float), steps.shape), have)


def cubic_weights(place, nodes, known):
    """Weights of the values at four nodes for interpolating between the second and the third.

    Cubic through all four; linear between the middle two if an outer one is missing; one of the
    middle two if only that is known.

    Parameters
    ----------
    place : numpy.ndarray, (t,)
        Coordinate to interpolate at.
    nodes : numpy.ndarray, (t, 4)
        Ascending coordinates of the nodes.
    known : numpy.ndarray, (t, 4) bool
        Which nodes have a value.

    Returns
    -------
    numpy.ndarray, (t, 4) float64
        Rows sum to 1, or to 0 if neither of the middle two is known. Those of the outer two are
        negative: -1/16 each halfway between equidistant nodes.

    Notes
    -----
    Lagrange interpolation. With node spacing h the error for a smooth function is at most h⁴ |f⁗| /
    24 (cubic), or h² |f″| / 8 (linear); the latter is biased to one side where f is curved.
    """
    left, right = known[:, 1], known[:, 2]
    share = (place - nodes[:, 1]) / (nodes[:, 2] - nodes[:, 1])
    weight = np.zeros(nodes.shape)
    # Linear between the middle two, or the one of them that is known.
    weight[:, 1] = np.where(left & right, 1.0 - share, left)
    weight[:, 2] = np.where(left & right, share, right & ~left)
    # Lagrange: at each node the product of (x - x_j) / (x_i - x_j) over the other three.
    full = known.all(axis=1)
    for node in range(4):
        others = np.delete(nodes[full], node, axis=1)
        away = place[full, None] - others
        weight[full, node] = np.prod(away / (nodes[full, node, None] - others), axis=1)
    return weight
