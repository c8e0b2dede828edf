"""One polygon on its way from a file into a City, and a reference to one."""

from dataclasses import dataclass, field


@dataclass(slots=True)
class Polygon:
    """A polygon as a reader met it."""

    surface_id: str  # "" where the file names none
    building: int  # into FileContent.buildings
    part: int  # 0: the building itself, else the number of the BuildingPart in the file
    thematic: str  # WallSurface, …, or ""
    lod: str  # "0" … "4", "2.2"
    source: str  # surface, solid or multisurface: what it is drawn in
    rings: list  # of (k, 3) float64, the outline first; the first point may be repeated at the end
    line: int = 0  # in the file
    flipped: bool = False
    more_lods: tuple = ()  # further LoDs that use it by reference
    implicit: bool = False  # set down from a shape that is drawn about its own origin
    material: str = ""  # name of what it is made of, where the source says so

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
    """All polygons of one file, in its order, before any choice."""

    path: object
    buildings: list = field(default_factory=list)  # ids of the top-level buildings, "" where unnamed
    part_count: int = 0
    polygons: list = field(default_factory=list)
    references: list = field(default_factory=list)
    groups: dict = field(default_factory=dict)  # id -> (first, last) into polygons
    prototypes: dict = field(default_factory=dict)  # id -> polygons of a shape about its own origin
    instances: list = field(default_factory=list)  # (id of a shape, anchor, place, name) to be set down
    srs_names: dict = field(default_factory=dict)  # spelling -> line where it was met first
    skipped: dict = field(default_factory=dict)  # reason -> ids
    notes: list = field(default_factory=list)
    crs: str | None = None
    colours: dict = field(default_factory=dict)  # name of a material -> (3,) diffuse colour, or None where not told

    def skip(self, reason, identifier):
        """Remember what was left out, and why."""
        self.skipped.setdefault(reason, []).append(identifier)
