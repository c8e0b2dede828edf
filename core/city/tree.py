"""A tree as passed from the readers to the scene."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Tree:
    """A tree, a hedge or a group of plants as read from a file: a shape, or a place and numbers."""

    name: str
    path: object  # file
    line: int
    cover: bool = False  # PlantCover: an area with plants
    polygons: list = field(default_factory=list)  # of Polygon, of its best level of detail
    place: np.ndarray | None = None  # (3,) float64, foot, in the units of the file, later [m]
    height: float | None = None  # [m]; of a PlantCover the mean one
    crown_diameter: float | None = None  # [m]
    trunk_diameter: float | None = None  # [m]
    evergreen: bool = False
    area_density: float | None = None  # [m²/m³] of leaves, where the file gives one

    @property
    def where(self):
        """Place in the file, for messages."""
        return f"line {self.line}: {'PlantCover' if self.cover else 'tree'} {self.name!r}"
