"""Where a scene stands on Earth, and the way between its own frame and the coordinates of its
files.

The frame has a local origin and y to true north; meridian convergence is the azimuth of grid north
from true north.
"""

import math
from dataclasses import dataclass

import numpy as np
import pyproj

from .transform_crs import Grid, find_globe_places, plane_of, transform_crs


@dataclass
class Site:
    """Location of the scene on Earth."""

    latitude: float | None  # [°]
    longitude: float | None  # [°]
    altitude: float  # [m]
    convergence: (
        float  # [°] azimuth of grid north from true north; the scene is already rotated by it
    )
    crs: str | None  # of the files
    origin: tuple  # (3,) [m] the scene's origin in the plane below
    axes: str = "xy"  # order of coordinates in the files, of `transform_crs.Grid`
    plane: str | None = None  # system in true metres, of `transform_crs.Grid`; None: the files' own

    def from_files(self, points):
        """Points of the files in the scene's frame.

        What large coordinates leave behind the micrometre is rounding: the same city is the same
        scene anywhere.

        Parameters
        ----------
        points : array, (m, 3) float64 [m]
        site : Site

        Returns
        -------
        array, (m, 3) float64 [m]
        """
        return np.round(
            turn_to_true_north(points - np.array(self.origin), self.convergence), MICROMETRE
        )

    def find_on_earth(self, points):
        """Latitudes and longitudes of points of the scene's frame, (m, 3) float64 [m].

        By the reference system or, where the city has none or was set up elsewhere, by its own
        place and north.

        Returns
        -------
        latitude, longitude : array, (m,) float64 [°]
            NaN where the place is not known.
        """
        if self.latitude is None or self.longitude is None:
            return np.full((2, len(points)), np.nan)
        if (plane := self._plane_of_place()) is not None:
            globe_places = np.array(find_globe_places(self.to_files(points)[:, :2], plane))
            return np.where(np.isfinite(globe_places), globe_places, np.nan)
        ways = np.full((4, len(points)), [[self.longitude], [self.latitude], [0.0], [0.0]])
        ways[2:] = (
            np.degrees(np.arctan2(points[:, 0], points[:, 1])),
            np.hypot(points[:, 0], points[:, 1]),
        )
        # As lists: pyproj tries to make a number of an array with one point, and NumPy below 2.4
        # warns of it.
        longitude, latitude, _ = pyproj.Geod(ellps="WGS84").fwd(*ways.tolist())
        return np.array([latitude, longitude])

    def from_system(self, places, crs):
        """Places of any reference system in the plan of the scene's frame, as `find_on_earth` has
        it.

        Parameters
        ----------
        places : array, (k, 2) float64
            East or longitude first, in the units of the system.
        crs : str

        Returns
        -------
        array, (k, 2) float64 [m]
            Not finite where either system ends.
        """
        if (plane := self._plane_of_place()) is not None:
            there = transform_crs(places, crs, plane)
            return self.from_files(np.column_stack([there, np.zeros(len(there))]))[:, :2]
        # Distance and azimuth from the city's own place.
        return transform_crs(
            places,
            crs,
            f"+proj=aeqd +lat_0={self.latitude} +lon_0={self.longitude} +datum=WGS84",
        )

    def _plane_of_place(self):
        """Plane of the reference system; None where the city has none, or was set up elsewhere."""
        if self.crs is None:
            return None
        plane, _ = plane_of(self.plane or self.crs)
        own = np.array(find_globe_places(np.array([self.origin])[:, :2], plane))
        at_place = np.allclose(own[:, 0], [self.latitude, self.longitude], rtol=0, atol=1e-6)
        return plane if at_place else None

    @property
    def grid(self):
        """The system of the files, and the plane that the origin is in."""
        return Grid(self.crs, self.axes, self.plane)

    def to_files(self, points):
        """Points of the scene's frame in the coordinates of the files: the inverse of
        `from_files`.
        """
        return turn_to_true_north(points, -self.convergence) + np.array(self.origin)


MICROMETRE = 6  # decimals of a metre


def turn_to_true_north(points, convergence):
    """Turn grid coordinates so that y points to true north.

    A direction of grid azimuth a has true azimuth a + convergence.

    Parameters
    ----------
    points : array, (…, 3) float64 [m]
    convergence : float [°]
    """
    sine, cosine = math.sin(math.radians(convergence)), math.cos(math.radians(convergence))
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=-1)
