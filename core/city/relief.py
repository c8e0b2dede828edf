"""Terrain that stands in a file of buildings, as it is read: triangles by level of detail."""

from array import array
from dataclasses import dataclass, field


@dataclass
class Relief:
    """Triangles of the TIN reliefs of one file."""

    corners: dict = field(default_factory=dict)  # LoD, "" where none is named -> array of 9 float64 per triangle
    srs_names: dict = field(default_factory=dict)  # spelling that the relief itself has -> line where it was met

    def add(self, lod, numbers):
        """Take the corners of triangles: 9 numbers each, in the order and the units of the file."""
        self.corners.setdefault(lod, array("d")).extend(numbers)

    def count(self):
        """Number of triangles."""
        return sum(len(numbers) for numbers in self.corners.values()) // 9
