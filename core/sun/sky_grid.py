"""A grid of sun directions over the whole sky, valid for every latitude and year, and interpolation
between them.

The grid and its mirror image below the horizon are triangulated; the search for a direction's
triangle starts at the triangle of the direction before it, which for the hours of a year is a few
steps across the sky.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial import ConvexHull

from ..settings.errors import InputError
from .suns import Suns


def sky_grid_suns(count):
    """Directions with equal areas of the upper hemisphere, on a Fibonacci spiral.

    Parameters
    ----------
    count : int
        Number of directions.

    Returns
    -------
    Suns
        Sampling "sky-grid:N", with equal weights, without days and steps.

    Notes
    -----
    Equal steps in height are equal areas on a sphere (Archimedes); the golden angle between
    neighbours keeps them apart, :doi:`10.1007/s11004-009-9257-x`.
    """
    height = (np.arange(count) + 0.5) / count
    azimuth = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    radius = np.sqrt(1.0 - height**2)
    direction = np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), height], axis=-1)
    none = np.full(count, -1, np.int32)
    return Suns(f"sky-grid:{count}", direction, np.full(count, 1.0 / count), none, none.copy())


@dataclass
class SkyTriangles:
    """Triangles of a sky grid and of its mirror image below the horizon."""

    count: int  # directions of the grid
    direction: np.ndarray  # (count, 3), unit vectors
    corners: np.ndarray  # (f, 3) int64 into the grid and then its mirror image
    neighbours: np.ndarray  # (f, 3) int64, the triangle across the edge opposite to each corner
    inverse: np.ndarray  # (f, 3, 3): times a direction gives the weights of the corners
    reach: float  # longest edge [°]: no direction is further from a corner of its triangle

    def match(self, direction):
        """The corners of the triangle around each direction, and their barycentric weights.

        A mirrored corner counts as its original above the horizon.

        Parameters
        ----------
        direction : numpy.ndarray, (t, 3)
            Unit vectors; fastest in the order of time.

        Returns
        -------
        index : numpy.ndarray, (t, 3) int64
            Into the grid.
        weight : numpy.ndarray, (t, 3) float64
            Not negative; rows sum to 1.
        """
        triangle_rows = _find_triangles(
            self.neighbours, self.inverse, np.ascontiguousarray(direction, float)
        )
        weight = np.maximum(np.einsum("tij,tj->ti", self.inverse[triangle_rows], direction), 0.0)
        return self.corners[triangle_rows] % self.count, weight / weight.sum(axis=1, keepdims=True)

    @staticmethod
    def of(suns):
        """Triangulate a sky grid.

        Parameters
        ----------
        suns : Suns
            A sky grid, all of it.

        Returns
        -------
        SkyTriangles
            The convex hull of points on a sphere is their Delaunay triangulation.

        Raises
        ------
        InputError
            If the suns are not a whole sky grid.
        """
        if suns.sampling != f"sky-grid:{len(suns)}":
            raise InputError(
                "suns", f"{len(suns)} directions of {suns.sampling}", "give a whole sky grid"
            )
        points = np.concatenate([suns.direction, suns.direction * [1.0, 1.0, -1.0]])
        hull = ConvexHull(points)
        corners = hull.simplices.astype(np.int64)
        sides = points[corners]  # (f, 3, 3)
        cosine = np.einsum("fik,fik->fi", sides, np.roll(sides, 1, axis=1))
        return SkyTriangles(
            len(suns),
            suns.direction,
            corners,
            hull.neighbors.astype(np.int64),
            np.linalg.inv(sides.transpose(0, 2, 1)),
            float(np.degrees(np.arccos(np.clip(cosine.min(), -1.0, 1.0)))),
        )


@njit(nogil=True, cache=True)
def _find_triangles(neighbours, inverse, direction):
    """Triangle of each direction, by a visibility walk through the triangulation: (t,) int64.

    From a triangle the walk crosses the edge behind which the direction lies furthest. In a
    Delaunay triangulation it never runs in a circle (Devillers, Pion, Teillaud 2002,
    doi:10.1142/S0129054102001047).

    Parameters
    ----------
    neighbours : numpy.ndarray, (m, 3) int64
        Triangle beyond the edge opposite each corner.
    inverse : numpy.ndarray, (m, 3, 3) float64
        Matrices that turn a direction into barycentric weights, not normalised.
    direction : numpy.ndarray, (t, 3) float64
        Unit vectors.
    """
    triangle_rows = np.empty(len(direction), np.int64)
    here = 0
    for row in range(len(direction)):
        x, y, z = direction[row]
        for _ in range(len(neighbours)):
            side, least = 0, np.inf
            for corner in range(3):
                weight = (
                    inverse[here, corner, 0] * x
                    + inverse[here, corner, 1] * y
                    + inverse[here, corner, 2] * z
                )
                if weight < least:
                    side, least = corner, weight
            # A direction may lie on an edge: rounding gives it a weight just below 0.
            if least >= -1e-12:
                break
            here = neighbours[here, side]
        triangle_rows[row] = here
    return triangle_rows
