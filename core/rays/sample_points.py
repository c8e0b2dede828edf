"""Sample points on triangles and cosine-weighted directions of the hemisphere."""

import functools
from typing import NamedTuple

import numpy as np

DIGITS = 24  # binary digits of float32 numbers below 1
# independent sets of hemisphere rays per patch; their variance gives the standard error
HEMISPHERE_REPLICATES = 4


def additive_recurrence(count, dimensions):
    """Low-discrepancy points (R-sequence): multiples of the powers of the generalised golden ratio,
    modulo 1.

    Returns
    -------
    (count, dimensions) float32 in [0, 1)

    References
    ----------
    M. Roberts (2018), The unreasonable effectiveness of quasirandom sequences: the R-sequences.
    """
    ratio = 2.0
    for _ in range(64):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    return np.mod(np.arange(1.0, count + 1)[:, None] * steps, 1).astype(np.float32)


def sobol_digits(count):
    """The first four-dimensional points of Sobol's sequence, as binary fractions.

    The first 2^k of them form a digital net; a digital shift (XOR of each coordinate with a random
    number) keeps this property.

    Returns
    -------
    (count, 4) uint32
        Multiples of 2^-DIGITS.

    References
    ----------
    I. M. Sobol (1967), doi:10.1016/0041-5553(67)90144-9. Direction numbers: S. Joe and F. Y. Kuo
    (2008), doi:10.1137/070709359. The same points come from `scipy.stats.qmc`, whose import takes
    longer than a draft's rays.
    """
    return sobol_points(np.arange(count))


def sobol_points(index):
    """Points of the same sequence by their numbers, from 0: (n, 4) uint32 of (n,) int.

    Points k 2^m to (k + 1) 2^m - 1, for any k, are the first 2^m moved by the digital shift that is
    the first of them. So rounds that take such parts one after the other continue one net.
    """
    gray = np.asarray(index, np.uint32)
    gray = gray ^ (gray >> np.uint32(1))
    points = np.zeros((len(gray), 4), np.uint32)
    for digit, direction in enumerate(_all_directions()[: int(gray.max(initial=0)).bit_length()]):
        points ^= ((gray[:, None] >> np.uint32(digit)) & np.uint32(1)) * direction
    return points


@functools.cache
def _all_directions():
    """Direction numbers of all four dimensions, multiples of 2^-DIGITS: (DIGITS, 4) uint32."""
    # The first dimension is the van der Corput sequence; the others follow from their polynomials
    # by the recurrence of Sobol.
    direction_numbers = [[1 << (DIGITS - digit) for digit in range(1, DIGITS + 1)]]
    # Dimensions 2 to 4: coefficients of the primitive polynomial, and initial numbers.
    for coefficients, initial in ((0, (1,)), (1, (1, 3)), (1, (1, 3, 1))):
        degree, numbers = len(initial), list(initial)
        for digit in range(degree, DIGITS):
            last = numbers[digit - degree]
            number = last ^ (last << degree)
            for step in range(1, degree):
                number ^= ((coefficients >> (degree - 1 - step)) & 1) * (
                    numbers[digit - step] << step
                )
            numbers.append(number)
        direction_numbers.append(
            [number << (DIGITS - 1 - digit) for digit, number in enumerate(numbers)]
        )
    return np.array(direction_numbers, np.uint32).T


def barycentric_of_square(u, v):
    """Uniform points of a triangle from uniform points of the square.

    The map is area-preserving and continuous (Heitz 2019, A low-distortion map between triangle and
    square).

    Returns
    -------
    b1, b2 : (...) float32
        Weights of the second and third vertex.
    """
    below = v > u
    b1 = np.where(below, u * np.float32(0.5), u - v * np.float32(0.5))
    b2 = np.where(below, v - u * np.float32(0.5), v * np.float32(0.5))
    return b1, b2


def cosine_direction(u, v):
    """Directions of the upper hemisphere with density cos(zenith)/π.

    Returns
    -------
    x, y, z : (...) float32
    """
    radius, angle = np.sqrt(u), np.float32(2 * np.pi) * v
    return radius * np.cos(angle), radius * np.sin(angle), np.sqrt(np.maximum(np.float32(0), 1 - u))


class Cells(NamedTuple):
    """The `divisions`² congruent sub-triangles of a triangle.

    A row of cells runs along b2 = const; within it upright and inverted cells alternate.
    """

    divisions: int

    def of_point(self, b1, b2):
        """Which of the cells contains a point.

        Returns
        -------
        (...) unsigned int, of the smallest sufficient size
        """
        divisions = self.divisions
        dtype = np.min_scalar_type(divisions**2 - 1)
        row = np.minimum(b2 * divisions, divisions - 1).astype(np.int32)
        along = np.minimum(b1 * divisions, divisions - 1).astype(np.int32)
        inverted = (b1 + b2) * divisions - row - along >= 1
        place = np.minimum(2 * along + inverted, 2 * (divisions - 1 - row))
        return (row * (2 * divisions - row) + place).astype(dtype)

    def places(self):
        """Row and position in the row of each cell: two (cells,) int."""
        rows = np.arange(self.divisions)
        row = np.repeat(rows, 2 * (self.divisions - rows) - 1)
        return row, np.arange(self.divisions**2) - row * (2 * self.divisions - row)

    @functools.cache  # noqa: B019
    def corners(self):
        """Barycentric coordinates of the vertices of the cells.

        Returns
        -------
        (divisions², 3, 2) float32
            For each cell three vertices, each with the coordinates for the second and third vertex
            of the triangle.
        """
        row, place = self.places()
        along, inverted = np.divmod(place, 2)
        steps = np.array([[(0, 0), (1, 0), (0, 1)], [(1, 1), (0, 1), (1, 0)]])[inverted]
        corners = np.stack([along, row], axis=1)[:, None] + steps
        return corners.astype(np.float32) / np.float32(self.divisions)

    @functools.cache  # noqa: B019
    def inside(self, larger):
        """Which of the `larger`² cells contains each of these, by centroid if it overlaps several:
        (divisions²,) int.
        """
        middle = self.corners().mean(axis=1)
        return Cells(larger).of_point(middle[:, 0], middle[:, 1]).astype(int)
