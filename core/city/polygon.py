"""Polygons, references and file contents as passed from the readers to `assemble_city`."""

from dataclasses import dataclass, field

from .relief import Relief


@dataclass(slots=True)
class Polygon:
    """A polygon as read from a file."""

    surface_id: str  # "" if the file gives none
    building: int  # into FileContent.buildings
    part: int  # 0: the building itself, else the number of the BuildingPart in the file
    thematic: str  # WallSurface, …, or ""
    lod: str  # "0" … "4", "2.2"
    source: str  # surface, solid or multisurface: the geometry it belongs to
    rings: list  # of (k, 3) float64, the exterior first; the first point may be repeated at the end
    line: int = 0  # in the file
    flipped: bool = False
    more_lods: tuple = ()  # further LoDs that use it by reference
    implicit: bool = False  # instanced from a prototype in local coordinates
    material: str = ""  # name of its material, if the file gives one

    def lods(self):
        """Every LoD this polygon belongs to."""
        return (self.lod, *self.more_lods)


@dataclass(slots=True)
class Reference:
    """An xlink to a polygon or to a group of polygons."""

    target: str
    building: int
    part: int
    thematic: str
    lod: str
    source: str
    flipped: bool


@dataclass
class FileContent:
    """All polygons of one file at all LoDs, in input order."""

    path: object
    buildings: list = field(default_factory=list)  # ids of the top-level buildings, "" if unnamed
    part_count: int = 0
    polygons: list = field(default_factory=list)
    references: list = field(default_factory=list)
    groups: dict = field(default_factory=dict)  # id -> (first, last) into polygons
    prototypes: dict = field(default_factory=dict)  # id -> polygons of a shape in local coordinates
    instances: list = field(default_factory=list)  # (id of a prototype, anchor, place, name)
    srs_names: dict = field(default_factory=dict)  # spelling -> line of its first use
    skipped: dict = field(default_factory=dict)  # reason -> ids
    notes: list = field(default_factory=list)
    crs: str | None = None
    colours: dict = field(default_factory=dict)  # name of a material -> (3,) diffuse colour, or None if not given
    relief: Relief = field(default_factory=Relief)  # terrain of the file
    trees: list = field(default_factory=list)  # of Tree
    plants: "FileContent | None" = None  # polygons of the trees while they are read; `building` is the tree

    def skip(self, reason, identifier):
        """Record what was left out, and why."""
        self.skipped.setdefault(reason, []).append(identifier)
