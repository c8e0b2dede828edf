"""The triangulated scene for ray tracing, with its surfaces and site."""

from dataclasses import dataclass, field

import numpy as np

from ..city.city import ImportReport
from ..city.crowns import Crowns


@dataclass
class Site:
    """Location of the scene on Earth."""

    latitude: float | None  # [°]
    longitude: float | None  # [°]
    altitude: float  # [m]
    convergence: float  # [°] azimuth of grid north from true north; the scene is already rotated by it
    crs: str | None
    origin: tuple  # (3,) [m] the scene's origin in the coordinate reference system of the files


@dataclass
class Surfaces:
    """Surfaces, one per polygon of the city, in input order: the rows of all results."""

    surface_id: list  # (n,) str
    building_id: list  # (n,) str
    thematic: list  # (n,) str
    kind: np.ndarray  # (n,) str: facade, roof, flat, steep, downward, ground, rack
    orientation: np.ndarray  # (n,) str: north, east, south, west, none
    eligible: np.ndarray  # (n,) bool
    area: np.ndarray  # (n,) float64 [m²]
    surface_tilt: np.ndarray  # (n,) float64 [°]
    surface_azimuth: np.ndarray  # (n,) float64 [°] clockwise from true north; 0 if the surface is level
    normal: np.ndarray  # (n, 3) float64, unit length
    material: list | None = None  # (n,) str, names of materials, "" if there is none; None if not recorded

    def __len__(self):
        return len(self.surface_id)


@dataclass
class Scene:
    """Triangles with the surface each belongs to; axes x true east, y true north, z up; metres; local origin."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int32 into vertices, counter-clockwise seen from outside
    triangle_surface: np.ndarray  # (t,) int32 into surfaces; -1 for generated ground, terrain, backs of racks
    footprint: np.ndarray  # (t,) bool: footprint of a building; counts as a back face from both sides
    closure: np.ndarray  # (t,) bool: ClosureSurface between buildings; blocks rays, receives no light
    surfaces: Surfaces
    site: Site
    report: ImportReport = field(default_factory=ImportReport)
    colours: dict = field(default_factory=dict)  # name of a material of the files -> (3,) linear RGB, None if not given
    sheet: np.ndarray | None = None  # (t,) bool: open sheet without thickness, lit on both sides; None: none
    back_of: np.ndarray | None = None  # (t,) int32, for back sides made by `add_backs`: their triangle, else -1
    racks: np.ndarray | None = None  # (k, 4, 3) float64 [m], corners of the fronts, which are the last k surfaces
    rack_of_back: np.ndarray | None = None  # (t,) int32: surface of the rack whose underside or edge it is, else -1
    back_albedo: float = 0.0  # of those undersides and edges
    trees: Crowns | None = None  # None: the model has no vegetation
    number: np.ndarray | None = None  # (t,) int64 among the triangles of its surface; None: counted here
    terrain_laid: bool = False  # whether the ground without rows in the tables is measured terrain
    halo: np.ndarray | None = None  # (t,) int8, of a tile: its OWN, NEAR and FAR surroundings; None: not a tile


OWN, NEAR, FAR = 0, 1, 2  # surroundings have no results; FAR ones pass light on only where a ray meets them
