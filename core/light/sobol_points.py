"""Sobol's points: where 2^k of them are taken, every slice of the square that should hold one of them holds one."""

import numpy as np

# Of each dimension after the first: the inner coefficients of its primitive polynomial, read as a binary number, and
# the first direction numbers, one per degree of the polynomial.
POLYNOMIALS = ((0, (1,)), (1, (1, 3)), (1, (1, 3, 1)))
BITS = 24  # what float32 holds without rounding


def sobol_points(count, dimensions):
    """The first points of Sobol's sequence, in the order of their numbers.

    Parameters
    ----------
    count : int
    dimensions : int
        Up to 4.

    Returns
    -------
    (count, dimensions) float32 in [0, 1)

    References
    ----------
    I. M. Sobol (1967), doi:10.1016/0041-5553(67)90144-9. Direction numbers: S. Joe and F. Y. Kuo (2008),
    doi:10.1137/070709359.
    """
    number = np.arange(count, dtype=np.uint32)
    points = np.zeros((count, dimensions), np.uint32)
    for dimension in range(dimensions):
        for bit, direction in enumerate(direction_numbers(dimension)):
            points[:, dimension] ^= (number >> np.uint32(bit) & np.uint32(1)) * direction
    return points.astype(np.float32) / np.float32(1 << BITS)


def direction_numbers(dimension):
    """Direction numbers of one dimension, as fractions of 2^BITS: (BITS,) uint32."""
    if dimension == 0:
        return np.array([1 << (BITS - 1 - bit) for bit in range(BITS)], np.uint32)
    inner, first = POLYNOMIALS[dimension - 1]
    degree, found = len(first), list(first)
    for bit in range(degree, BITS):
        # m_k = 2 a₁ m_{k-1} ⊕ 2² a₂ m_{k-2} ⊕ … ⊕ 2^s m_{k-s} ⊕ m_{k-s}
        value = found[bit - degree] ^ found[bit - degree] << degree
        for back in range(1, degree):
            if inner >> (degree - 1 - back) & 1:
                value ^= found[bit - back] << back
        found.append(value)
    return np.array([value << (BITS - 1 - bit) for bit, value in enumerate(found)], np.uint32)
