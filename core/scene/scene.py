"""The triangulated scene: what the rays meet."""

from dataclasses import dataclass, field

import numpy as np

from ..city.city import ImportReport


@dataclass
class Site:
    """Where the scene stands on Earth."""

    latitude: float | None  # [°]
    longitude: float | None  # [°]
    altitude: float  # [m]
    convergence: float  # [°] azimuth of grid north seen from true north; the scene is already turned by it
    crs: str | None
    origin: tuple  # (3,) [m] the scene's origin in the coordinate reference system of the files


@dataclass
class Surfaces:
    """The units of results: the polygons of the city, in the order of the input."""

    surface_id: list  # (n,) str
    building_id: list  # (n,) str
    thematic: list  # (n,) str
    kind: np.ndarray  # (n,) str: facade, roof, flat, steep, downward, ground
    orientation: np.ndarray  # (n,) str: north, east, south, west, none
    eligible: np.ndarray  # (n,) bool
    area: np.ndarray  # (n,) float64 [m²]
    surface_tilt: np.ndarray  # (n,) float64 [°]
    surface_azimuth: np.ndarray  # (n,) float64 [°] clockwise from true north; 0 where the surface is level
    normal: np.ndarray  # (n, 3) float64, unit length
    material: list | None = None  # (n,) str, names of materials, "" where there is none; None where nobody noted it

    def __len__(self):
        return len(self.surface_id)


@dataclass
class Scene:
    """Triangles with the surface each belongs to; axes x true east, y true north, z up; metres; local origin."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int32 into vertices, counter-clockwise seen from outside
    triangle_surface: np.ndarray  # (t,) int32 into surfaces; -1 on ground that was generated or is terrain
    footprint: np.ndarray  # (t,) bool: lies under a building; meets every ray with its back
    closure: np.ndarray  # (t,) bool: closes a building towards its neighbour; blocks, and receives nothing
    surfaces: Surfaces
    site: Site
    report: ImportReport = field(default_factory=ImportReport)
    colours: dict = field(default_factory=dict)  # name of a material of the files -> (3,) linear light, None: not told
    sheet: np.ndarray | None = None  # (t,) bool: has no thickness and encloses nothing: its back is lit too; None: none
    back_of: np.ndarray | None = None  # (t,) int32, on backs that `add_backs` made the triangle they belong to, else -1
