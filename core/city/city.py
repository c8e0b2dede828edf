"""The city as read from the input files: polygons, and the building each belongs to."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class ImportReport:
    """What the readers found, chose, repaired and left out."""

    files: list = field(default_factory=list)  # paths, as given
    building_count: int = 0
    part_count: int = 0
    lods_met: dict = field(default_factory=dict)  # LoD -> number of polygons
    lods_chosen: dict = field(default_factory=dict)  # LoD -> number of polygons kept
    repaired: dict = field(default_factory=dict)  # reason -> list of surface ids
    skipped: dict = field(default_factory=dict)  # reason -> list of ids
    skipped_area: dict = field(default_factory=dict)  # reason -> [m²] left out, if it has geometry
    notes: list = field(default_factory=list)  # sentences for the user

    def repair(self, reason, names):
        """Record which surfaces were repaired, and how."""
        if len(names):
            self.repaired.setdefault(reason, []).extend(names)

    def skip(self, reason, names, area=None):
        """Record what was left out, why, and its area [m²] if known."""
        if len(names):
            self.skipped.setdefault(reason, []).extend(names)
        if area is not None:
            self.skipped_area[reason] = self.skipped_area.get(reason, 0.0) + float(area)


@dataclass
class City:
    """Polygons in the order of the input.

    A polygon's first ring is its exterior, the others are holes. Rings are open: the first point is not repeated.
    """

    surface_id: list  # (n,) str, unique
    building_id: list  # (n,) str, the top-level building
    thematic: list  # (n,) str: WallSurface, RoofSurface, GroundSurface, ClosureSurface, … or ""
    points: np.ndarray  # (m, 3) float64 [m], x east, y north, z up, in the coordinate reference system of the file
    ring_start: np.ndarray  # (r + 1,) int64 into points
    polygon_start: np.ndarray  # (n + 1,) int64 into ring_start
    crs: str | None  # as accepted by pyproj.CRS.from_user_input, or None if the file gives none
    report: ImportReport = field(default_factory=ImportReport)
    lod: list | None = None  # (n,) str, "" in formats without levels of detail; None if not recorded
    material: list | None = None  # (n,) str, names of materials, "" if there is none; None if not recorded
    colours: dict = field(default_factory=dict)  # name of a material of the files -> (3,) diffuse colour, or None
    trees: list = field(default_factory=list)  # of Tree [m]
    terrain: object = None  # ground.terrain.Terrain of the files, in the system of the points, or None

    def __len__(self):
        return len(self.surface_id)

    def rings(self, polygon):
        """Rings of one polygon, the exterior first: list of (k, 3) float64 [m]."""
        first, last = self.polygon_start[polygon], self.polygon_start[polygon + 1]
        return [self.points[self.ring_start[r] : self.ring_start[r + 1]] for r in range(first, last)]


def number_names(names):
    """A number for each distinct name of a list, from 0 in the order in which they appear: (n,) int64."""
    numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
    return np.fromiter((numbers[name] for name in names), np.int64, len(names))
