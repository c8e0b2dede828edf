"""Where the modules of a city lie: in rows along eaves or storeys, upright or lying, whichever
holds more.

A polygon is seen in its own plane, x to the right and y upwards as one sees it from outside. What
modules may take of it, `free`, is given; they keep a distance from its edges, and from one another.
"""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from .module_rows import fill_polygons


@dataclass(frozen=True)
class ModuleLayout:
    """All modules of a city, m of them, sorted by surface, then row, then from left to right."""

    surface: np.ndarray  # (m,) int64, row of the surfaces table that carries it
    corner: np.ndarray  # (m, 3) float64 [m] its lower left corner seen from outside, in the scene
    along: np.ndarray  # (m, 3) float64 [m] its edge along the row
    up: np.ndarray  # (m, 3) float64 [m] its edge up the slope
    # (m,) int64, number of the row within its surface, from below; of facades, of the storey
    row: np.ndarray

    def __len__(self):
        return len(self.surface)

    def take(self, chosen):
        """Some of the modules, (m,) bool or (k,) int: ModuleLayout."""
        return ModuleLayout(**{name: values[chosen] for name, values in vars(self).items()})

    @staticmethod
    def join(parts):
        """Layouts of different surfaces as one: ModuleLayout."""
        joined = {
            name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])
        }
        order = np.lexsort((joined["row"], joined["surface"]))
        return ModuleLayout(**joined).take(order)

    def renumber(self, number):
        """The layout with other numbers of surfaces, (n,) int; those with -1 are gone."""
        kept = self.take(number[self.surface] >= 0)
        return ModuleLayout.join([replace(kept, surface=number[kept.surface])])

    def corners(self, lift=0.05):
        """Corners of the modules as they are drawn, counter-clockwise seen from outside: (m, 4, 3)
        float64 [m].

        They stand `lift` [m] before their faces, so that these do not show through.
        """
        normal = np.cross(self.along, self.up)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        low = self.corner + lift * normal / np.maximum(length, np.finfo(float).tiny)
        high = low + self.up
        return np.stack([low, low + self.along, high + self.along, high], axis=1)

    def triangles(self):
        """Triangles into the corners of all modules, four after the other: (2 m, 3) int64."""
        first = 4 * np.arange(len(self))[:, None, None]
        return (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)


@dataclass(frozen=True)
class Planes:
    """Planes of n polygons."""

    origin: np.ndarray  # (n, 3) float64 [m] in the scene
    right: np.ndarray  # (n, 3) float64, unit vectors along the rows
    upward: np.ndarray  # (n, 3) float64, unit vectors up the slope


# kind -> distance [m] from edges, and between every second row and the next: a way to clean and
# mend them
SPACING = {"facade": (0.1, 0.0), "roof": (0.3, 0.0), "steep": (0.3, 0.0), "flat": (0.5, 0.6)}


def lay_modules(free, planes, kind, size, *, boxes=None, storeys=None, gap=0.02):
    """Lay modules on polygons.

    Parameters
    ----------
    free : array, (n,) of shapely polygons or multipolygons
        What modules may take of each polygon, in its plane [m], without holes and what is covered;
        empty for those that carry none.
    planes : Planes
        n of them.
    kind : array, (n,) str
        Of the surfaces: facade, roof, steep, flat.
    size : tuple of float
        Length and width of a module [m].
    boxes : list of array, (b, 4) float64 [m], optional
        Least x and y, largest x and y of what else each polygon keeps free, such as bands of
        windows.
    storeys : tuple of array, (n,) and (n,) float64 [m], optional
        y of the lowest floor in each plane, and storeys along y; NaN where rows are numbered.
    gap : float
        [m] Between modules.

    Returns
    -------
    ModuleLayout
        `surface` are numbers of the polygons.
    """
    count = len(free)
    # Distances by kind of surface; a kind without its own has a flat roof's.
    spacing = np.array([SPACING.get(name, SPACING["flat"]) for name in np.asarray(kind).tolist()])
    spacing = spacing.reshape(-1, 2)
    # Edges keep their distance; of what is left all edges count, of outlines and of holes.
    inset = shapely.buffer(free, -spacing[:, 0], join_style="mitre", mitre_limit=2.0)
    parts, part_owner = shapely.get_parts(inset, return_index=True)
    rings, ring_part = shapely.get_rings(parts, return_index=True)
    places, ring = shapely.get_coordinates(rings, return_index=True)
    follows = np.flatnonzero(ring[1:] == ring[:-1])
    edges = np.column_stack([places[follows], places[follows + 1]])
    edge_start = np.searchsorted(part_owner[ring_part][ring[follows]], np.arange(count + 1))
    boxes = [np.empty((0, 4))] * count if boxes is None else boxes
    box_start = np.concatenate([[0], np.cumsum([len(own) for own in boxes])]).astype(np.int64)
    # As many as the area holds at most.
    room = (shapely.area(inset) / (size[0] * size[1]) + 1e-3).astype(np.int64)
    most = np.concatenate([[0], np.cumsum(room)])
    upright = np.array([[size[1], size[0]], [size[0], size[1]]], float)
    gaps = np.column_stack([np.full(count, gap), np.maximum(spacing[:, 1], gap)])
    shapes = edges, edge_start, np.concatenate([np.empty((0, 4)), *boxes]), box_start
    number, chosen, left, low, row = fill_polygons(shapes, upright, gaps, most)
    # From the results' places to modules, and from planes to the scene.
    surface = np.repeat(np.arange(count), number)
    place = np.arange(len(surface)) + np.repeat(most[:-1] - np.cumsum(number) + number, number)
    left, low, row = left[place], low[place], row[place]
    width, height = upright[chosen[surface]].T
    # Where the lowest floor is known, rows are numbered by the storey of their middle.
    if storeys is not None:
        lowest, storey = (values[surface] for values in storeys)
        level = np.floor((low + 0.5 * height - lowest) / storey)
        row = np.where(np.isfinite(level), level, row).astype(np.int64)
    right, upward = planes.right[surface], planes.upward[surface]
    corner = planes.origin[surface] + left[:, None] * right + low[:, None] * upward
    return ModuleLayout(surface, corner, width[:, None] * right, height[:, None] * upward, row)
