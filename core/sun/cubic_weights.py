"""Weights of four neighbours on a line for what lies between the middle two."""

import numpy as np


def cubic_weights(place, nodes, known):
    """Weights with which values at four nodes give the value at a place between the second and the third.

    The cubic through all four; the straight line between the middle two where an outer one is missing; one of the
    middle two where only that is known.

    Parameters
    ----------
    place : numpy.ndarray, (t,)
        Coordinate asked for.
    nodes : numpy.ndarray, (t, 4)
        Ascending coordinates of the nodes.
    known : numpy.ndarray, (t, 4) bool
        Which nodes have a value.

    Returns
    -------
    numpy.ndarray, (t, 4) float64
        Rows sum to 1, or to 0 where neither of the middle two is known. Those of the outer two are negative: -1/16 each
        halfway between equidistant nodes.

    Notes
    -----
    Lagrange's interpolation. With nodes h apart a smooth function is met within h⁴ |f⁗| / 24 at most (cubic), or
    h² |f″| / 8 (straight line), which lies to one side of f wherever f is bent to one side.
    """
    left, right = known[:, 1], known[:, 2]
    share = (place - nodes[:, 1]) / (nodes[:, 2] - nodes[:, 1])
    weight = np.zeros(nodes.shape)
    weight[:, 1] = np.where(left & right, 1.0 - share, left)
    weight[:, 2] = np.where(left & right, share, right & ~left)
    full = known.all(axis=1)
    for node in range(4):
        others = np.delete(nodes[full], node, axis=1)
        away = place[full, None] - others
        weight[full, node] = np.prod(away / (nodes[full, node, None] - others), axis=1)
    return weight
