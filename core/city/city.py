"""The city as read from the input files: polygons, and the building each belongs to; and what
single files hold.

A reader gives a FileContent: Polygons, references to them, a Relief and Trees. `join_contents`
makes one City of several.
"""

from array import array
from collections import defaultdict
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count

import numpy as np

from ..settings.errors import list_some

# columns of a City
LISTS = (
    *("surface_id", "building_id", "thematic", "lod", "material", "part"),
    "height_source",
)


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
    attributions: list = field(default_factory=list)  # whom to name with what is made of the files
    # what tells the heights of extruded buildings, as `City.height_source` -> number of buildings
    height_sources: dict = field(default_factory=dict)
    unit: str = "m"  # of `transform_crs.UNITS`, of files that name no reference system
    up: str = "z"  # upward axis of files that do not state it

    def repair(self, reason, names):
        """Record which surfaces were repaired, and how."""
        if len(names):
            self.repaired.setdefault(reason, []).extend(names)

    def skip(self, reason, names, area=None):
        """Record what was left out, why, and its area [m²] if known."""
        if len(names):
            self.skipped.setdefault(reason, []).extend(names)
        if len(names) and area is not None:
            self.skipped_area[reason] = self.skipped_area.get(reason, 0.0) + float(area)

    def note(self, words, names):
        """Add a sentence about some named things: their number, the words, and the first
        of them.
        """
        if names:
            self.notes.append(f"{len(names)} {words}: {list_some(names)}")


@dataclass
class City:
    """Polygons in the order of the input.

    A polygon's first ring is its exterior, the others are holes. Rings are open: the first point is
    not repeated.
    """

    surface_id: list  # (n,) str, unique
    building_id: list  # (n,) str, the top-level building
    thematic: list  # (n,) str: WallSurface, RoofSurface, GroundSurface, ClosureSurface, … or ""
    points: np.ndarray  # (m, 3) float64 [m], x east, y north, z up, in the plane below
    ring_start: np.ndarray  # (r + 1,) int64 into points
    polygon_start: np.ndarray  # (n + 1,) int64 into ring_start
    # of the files, as accepted by pyproj.CRS.from_user_input, or None if they give none
    crs: str | None
    report: ImportReport = field(default_factory=ImportReport)
    # (n,) str, "" in formats without levels of detail; None if not recorded
    lod: list | None = None
    # (n,) str, names of materials, "" if there is none; None if not recorded
    material: list | None = None
    # name of a material of the files -> (3,) diffuse colour, or None
    colours: dict = field(default_factory=dict)
    trees: list = field(default_factory=list)  # of Tree [m]
    # city.terrain.Terrain of the files, in the system of the points, or None
    terrain: object = None
    axes: str = "xy"  # order of coordinates in the files, of `transform_crs.Grid`
    plane: str | None = None  # system of the points, of `transform_crs.Grid`; None: the files' own
    part: list | None = (
        # (n,) str, the part of its building that each belongs to, "" if none; None if not recorded
        None
    )
    # (n,) str, of buildings that were extruded: the attribute that gives their height, "floors" or
    # "default"; None: not recorded
    height_source: list | None = None
    # (building, part or "") -> what the files tell of it in CityJSON's form: dict with `attributes`
    # and `address`, a list of dict; without an entry where they tell nothing
    attributes: dict = field(default_factory=dict)

    def __len__(self):
        return len(self.surface_id)

    @property
    def grid(self):
        """The system of the files, and the plane of the points: Grid."""
        from .transform_crs import Grid  # PROJ is not loaded for what Blender shows

        return Grid(self.crs, self.axes, self.plane)

    @property
    def shape(self):
        """Points, starts of rings, and starts of polygons: arguments of all that measures
        polygons.
        """
        return self.points, self.ring_start, self.polygon_start

    def names_of(self, chosen):
        """Ids of the polygons of a mask, (n,) bool: list of str."""
        return [self.surface_id[row] for row in np.flatnonzero(chosen)]

    def rings(self, polygon):
        """Rings of one polygon, the exterior first: list of (k, 3) float64 [m]."""
        first, last = self.polygon_start[polygon], self.polygon_start[polygon + 1]
        return [
            self.points[self.ring_start[r] : self.ring_start[r + 1]] for r in range(first, last)
        ]

    def take(self, kept):
        """Some polygons of a city, (n,) bool: City."""
        if np.all(kept):
            return self
        points, ring_start, polygon_start = _take_shape(*self.shape, kept)
        return replace(
            self,
            points=points,
            ring_start=ring_start,
            polygon_start=polygon_start,
            **self.take_lists(np.flatnonzero(kept)),
        )

    def append_shape(self, points, ring_start, polygon_start):
        """Points and rings of a city followed by others, as keywords of `replace`."""
        return {
            "points": np.concatenate([self.points, points]),
            "ring_start": np.append(self.ring_start, self.ring_start[-1] + ring_start[1:]),
            "polygon_start": np.append(
                self.polygon_start, self.polygon_start[-1] + polygon_start[1:]
            ),
        }

    def take_lists(self, rows):
        """The lists of a City for some polygons, (k,) int, as keywords of `replace`."""
        return {
            name: getattr(self, name) and [getattr(self, name)[row] for row in rows]
            for name in LISTS
        }


def _take_shape(points, ring_start, polygon_start, kept):
    """Points and starts of rings and of polygons, of some polygons, (n,) bool."""
    rings = np.repeat(kept, np.diff(polygon_start))
    points = points[np.repeat(rings, np.diff(ring_start))]
    return points, starts_of(np.diff(ring_start)[rings]), starts_of(np.diff(polygon_start)[kept])


def starts_of(counts):
    """Start index of each of consecutive pieces, and the end of the last one, (n + 1,) int64."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)


def number_names(names):
    """A number for each distinct name of a list, from 0 in the order in which they appear: (n,)
    int64.
    """
    numbers = defaultdict(count().__next__)
    return np.fromiter(map(numbers.__getitem__, names), np.int64, len(names))


def free_name(name, taken):
    """A name, or that with a free number behind it where it is taken: str.

    Parameters
    ----------
    name : str
    taken : dict of str to int
        Names that are taken, and the last number tried behind each, 1 to begin with; the new one is
        added.
    """
    free = name
    while free in taken:
        taken[name] += 1
        free = f"{name}~{taken[name]}"
    taken[free] = 1
    return free


def whole_of_cell(name):
    """Id of the polygon that a cell ``id#k`` was cut from; else the name itself."""
    whole, mark, cell = name.rpartition("#")
    return whole if mark and cell.isdigit() else name


@dataclass(slots=True)
class Polygon:
    """A polygon as read from a file."""

    surface_id: str  # "" if the file gives none
    building: int  # into FileContent.buildings
    part: int  # 0: the building itself, else the number of the BuildingPart in the file
    thematic: str  # WallSurface, …, or ""
    lods: tuple  # all it belongs to, its own first: "0" … "4", "2.2", "" in formats without
    source: str  # surface, solid or multisurface: the geometry it belongs to
    rings: list  # of (k, 3) float64, the exterior first; the first point may be repeated at the end
    line: int = 0  # in the file
    flipped: bool = False
    implicit: bool = False  # instanced from a prototype in local coordinates
    material: str = ""  # name of its material, if the file gives one
    installation: bool = False  # of what is attached to its building: a balcony, an antenna


@dataclass
class Relief:
    """Triangles of the TIN reliefs of one file, as they are read."""

    # LoD, "" where none is named -> array of 9 float64 per triangle, in the order and the units of
    # the file:
    corners: dict = field(default_factory=partial(defaultdict, partial(array, "d")))
    # spelling that the relief itself has -> line where it was met
    srs_names: dict = field(default_factory=dict)

    def count(self):
        """Number of triangles."""
        return sum(len(numbers) for numbers in self.corners.values()) // 9


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
    fault: str = ""  # why its numbers cannot be used; without a shape it is left out

    @property
    def where(self):
        """Place in the file, for messages."""
        return f"line {self.line}: {'PlantCover' if self.cover else 'tree'} {self.name!r}"


@dataclass
class Extent:
    """An envelope as read from a file, in its order and units."""

    srs_name: str  # "" if it names none
    labels: str  # names of its axes, "" if it gives none
    low: np.ndarray  # (2,) float64
    high: np.ndarray  # (2,) float64


@dataclass
class FileContent:
    """All polygons of one file at all LoDs, in input order."""

    path: object
    buildings: list = field(default_factory=list)  # ids of the top-level buildings, "" if unnamed
    part_count: int = 0
    polygons: list = field(default_factory=list)
    references: list = field(default_factory=list)  # (id of a polygon or a group, Place): xlinks
    groups: dict = field(default_factory=dict)  # id -> (first, last) into polygons
    prototypes: dict = field(default_factory=dict)  # id -> polygons of a shape in local coordinates
    instances: list = field(default_factory=list)  # (id of a prototype, matrix, place, name)
    srs_names: dict = field(default_factory=dict)  # spelling -> line of its first use
    skipped: dict = field(default_factory=dict)  # reason -> ids
    notes: list = field(default_factory=list)
    extents: list = field(default_factory=list)  # of Extent
    # (building, part) -> last day on which it stood
    demolitions: dict = field(default_factory=dict)
    attributes: dict = field(default_factory=dict)  # (building, part) -> as of City
    attributions: list = field(default_factory=list)  # of ImportReport
    crs: str | None = None
    axes: str = "xy"  # order of coordinates, of `transform_crs.Grid`
    up: str = "z"  # upward axis as read
    # name of a material -> (3,) diffuse colour, or None if not given
    colours: dict = field(default_factory=dict)
    relief: Relief = field(default_factory=Relief)  # terrain of the file
    trees: list = field(default_factory=list)  # of Tree
    # polygons of the trees while they are read; `building` is the tree
    plants: "FileContent | None" = None
    flat_map: object = None  # read.flat_map.FlatMap, of a file of outlines, until heights are known
    footprints: object = None  # extrude_footprints.Footprints, of a file of outlines with heights

    def skip(self, reason, identifier):
        """Record what was left out, and why."""
        self.skipped.setdefault(reason, []).append(identifier)

    def keep_buildings(self, kept):
        """Leave out all buildings but some, dict of int to str, which get the names that it gives;
        what is left is numbered anew.
        """
        number = {building: place for place, building in enumerate(kept)}
        self.buildings = list(kept.values())
        self.polygons = [polygon for polygon in self.polygons if polygon.building in number]
        for polygon in self.polygons:
            polygon.building = number[polygon.building]
        self.attributes = {
            (number[building], part): told
            for (building, part), told in self.attributes.items()
            if building in number
        }
