"""Outlines of the surfaces, for plans: the only shapes that results keep."""

from dataclasses import dataclass

import numpy as np

from .grid_cells import split_into_cells
from .local_frame import bring_to_origin


@dataclass
class Outlines:
    """Rings of n surfaces. A surface's first ring is its outline, the others are holes; rings are open."""

    points: np.ndarray  # (m, 3) float32 [m], x true east, y true north, z up, from the scene's origin
    ring_start: np.ndarray  # (r + 1,) int32 into points
    surface_start: np.ndarray  # (n + 1,) int32 into ring_start

    def rings(self, surface):
        """Rings of one surface, the outline first: list of (k, 3) float32 [m]."""
        first, last = self.surface_start[surface], self.surface_start[surface + 1]
        return [self.points[self.ring_start[r] : self.ring_start[r + 1]] for r in range(first, last)]


def outline_surfaces(city, surfaces, site, grid_size=None):
    """Outlines of the surfaces of a scene.

    Parameters
    ----------
    city : City
        As it was read.
    surfaces : Surfaces
        Of the scene that was built from it; those behind the city's own polygons get no rings.
    site : Site
    grid_size : float, optional
        [m] As the scene was built with.

    Returns
    -------
    Outlines
    """
    if grid_size is not None:
        city, _ = split_into_cells(city, grid_size)
    start = np.full(len(surfaces) + 1, city.polygon_start[-1], np.int32)
    start[: len(city) + 1] = city.polygon_start
    points = bring_to_origin(city.points, site).astype(np.float32)
    return Outlines(points, np.asarray(city.ring_start, np.int32), start)
