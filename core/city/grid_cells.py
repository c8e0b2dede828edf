"""Split large polygons into grid cells on their own plane, and outlines of what results keep of
them.
"""

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from ..settings.errors import InputError
from ..settings.tolerances import GEOMETRY
from .check_geometry import check_city
from .city import starts_of
from .polygons import measure_polygons, plane_axes


def split_into_cells(city, grid_size):
    """City whose polygons larger than a cell are split along a grid.

    Parameters
    ----------
    city : City
    grid_size : float [m]
        Side of a cell; rows are horizontal, columns run up the slope.

    Returns
    -------
    city : City
        Cells are named ``id#1``, ``id#2``, …; polygons that fit into one cell keep their name.
    parent : array, (n,) int64
        Index of the original polygon of each.

    Raises
    ------
    InputError
        grid_size is not positive or gives too many cells, or the city is invalid.
    """
    if not grid_size > 0:
        raise InputError(
            "--grid-size", f"{grid_size} is not positive", "give the side of a cell in metres"
        )
    check_city(city)
    # Axes in the plane of each polygon, level and up the slope, along which it is cut.
    _, normal = measure_polygons(*city.shape)
    axes = np.stack([*plane_axes(normal), normal], axis=1)  # (n, 3, 3), rows right, upward, outward
    pieces, parent, names = [], [], []
    for polygon in range(len(city)):
        rings = city.rings(polygon)
        cells = _cut(rings, axes[polygon], grid_size)
        pieces += cells
        parent += [polygon] * len(cells)
        own = city.surface_id[polygon]
        names += [own] if len(cells) == 1 else [f"{own}#{k + 1}" for k in range(len(cells))]
    # Cells as polygons of a city; each takes what its polygon has, and a number.
    rings = [ring for piece in pieces for ring in piece]
    split = replace(
        city,
        points=np.concatenate(rings),
        ring_start=starts_of(list(map(len, rings))),
        polygon_start=starts_of(list(map(len, pieces))),
        **city.take_lists(parent) | {"surface_id": names},
    )
    return split, np.array(parent, np.int64)


def _cut(rings, axes, grid_size):
    """A polygon cut by a square grid in its own plane: pieces, each a list of rings (k, 3)."""
    # The polygon in its own plane, and how many cells of the grid its bounds take along both axes.
    origin = rings[0][0]
    flat = [(ring - origin) @ axes.T for ring in rings]
    low, high = flat[0][:, :2].min(axis=0), flat[0][:, :2].max(axis=0)
    columns, rows = np.maximum(np.ceil((high - low) / grid_size - 1e-9), 1)
    # A polygon of more than a million cells is refused.
    if columns * rows > 1e6:
        raise InputError(
            "--grid-size",
            f"{grid_size:g} m gives {columns * rows:.0e} cells in one polygon",
            "give a larger size",
        )
    # A polygon that fits one cell, or is not valid, stays whole.
    shape = shapely.Polygon(flat[0][:, :2], [ring[:, :2] for ring in flat[1:]])
    if columns * rows == 1 or not shape.is_valid:
        return [rings]
    # Else it is cut with the square of each cell.
    height = np.concatenate(flat)[:, 2].mean()
    x, y = (low[k] + grid_size * np.arange(n) for k, n in enumerate((columns, rows)))
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    parts = shapely.get_parts(
        shapely.intersection(shape, shapely.box(x, y, x + grid_size, y + grid_size))
    )
    # Pieces below a square millimetre are rounding errors, and dropped.
    parts = parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > GEOMETRY.area)]
    pieces = []
    # Back from the plane into space: pieces are flat, at the mean height of all corners over it.
    for part in map(orient, parts):
        rings = [np.asarray(ring.coords)[:-1, :2] for ring in (part.exterior, *part.interiors)]
        pieces.append(
            [np.column_stack([ring, np.full(len(ring), height)]) @ axes + origin for ring in rings]
        )
    return pieces


@dataclass
class Outlines:
    """Rings of n surfaces. A surface's first ring is its outline, the others are holes; rings are
    open.
    """

    # (m, 3) float32 [m], x true east, y true north, z up, from the scene's origin
    points: np.ndarray
    ring_start: np.ndarray  # (r + 1,) int32 into points
    surface_start: np.ndarray  # (n + 1,) int32 into ring_start

    def rings(self, surface):
        """Rings of one surface, the outline first: list of (k, 3) float32 [m]."""
        first, last = self.surface_start[surface], self.surface_start[surface + 1]
        return [
            self.points[self.ring_start[r] : self.ring_start[r + 1]] for r in range(first, last)
        ]

    @staticmethod
    def of(city, surfaces, site):
        """Outlines of the surfaces of a scene.

        Parameters
        ----------
        city : City
            Cut into cells where the scene is.
        surfaces : Surfaces
            Of the scene that was built from it; those behind the city's own polygons get no rings.
        site : Site

        Returns
        -------
        Outlines
        """
        start = np.full(len(surfaces) + 1, city.polygon_start[-1], np.int32)
        start[: len(city) + 1] = city.polygon_start
        points = site.from_files(city.points).astype(np.float32)
        return Outlines(points, np.asarray(city.ring_start, np.int32), start)
