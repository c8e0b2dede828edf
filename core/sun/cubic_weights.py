"""Weights for cubic interpolation between the middle two of four nodes."""

import numpy as np


def cubic_weights(place, nodes, known):
    """Weights of the values at four nodes for interpolating between the second and the third.

    Cubic through all four; linear between the middle two if an outer one is missing; one of the middle two if only that
    is known.

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
        Rows sum to 1, or to 0 if neither of the middle two is known. Those of the outer two are negative: -1/16 each
        halfway between equidistant nodes.

    Notes
    -----
    Lagrange interpolation. With node spacing h the error for a smooth function is at most h⁴ |f⁗| / 24 (cubic), or
    h² |f″| / 8 (linear); the latter is biased to one side where f is curved.
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
