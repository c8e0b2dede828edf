"""Order points so that neighbours in the order lie side by side: by interleaved bits of x and y (Morton's curve)."""

import numpy as np

BITS = 16  # of each coordinate
MASKS = ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555))


def order_nearby(points):
    """Order of points in plan view.

    Parameters
    ----------
    points : (n, 2) or (n, 3) float [m]

    Returns
    -------
    (n,) int

    References
    ----------
    G. M. Morton (1966), A computer oriented geodetic data base and a new technique in file sequencing. IBM.
    """
    if not len(points):
        return np.zeros(0, int)
    plan = np.asarray(points, float)[:, :2]
    low = plan.min(axis=0)
    extent = max(float((plan - low).max()), 1e-9)
    x, y = (spread_bits(one) for one in ((plan - low) / extent * (2**BITS - 1)).astype(np.uint32).T)
    return np.argsort(x | (y << 1), kind="stable")


def spread_bits(number):
    """The lower 16 bits of numbers, (n,) uint32, with a zero between each two."""
    for shift, mask in MASKS:
        number = (number | (number << np.uint32(shift))) & np.uint32(mask)
    return number
