"""The triangulated scene for ray tracing, with its surfaces and site.

Each triangle of a sheet, a face without thickness, gets a second one for its back, which receives
and reflects light.
"""

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from ..settings.errors import check_array, check_triangles
from .city import ImportReport
from .site import Site


@dataclass
class Crowns:
    """Closed surfaces around the leaves of k trees, and surfaces of their trunks; axes and origin
    of the scene.
    """

    vertices: np.ndarray  # (v, 3) float64 [m]
    # (t, 3) int32 into vertices; of crowns counter-clockwise seen from outside
    triangles: np.ndarray
    tree: np.ndarray  # (t,) int32
    trunk: np.ndarray  # (t,) bool: opaque
    names: list  # (k,) str
    height: np.ndarray  # (k,) float64 [m]
    evergreen: np.ndarray  # (k,) bool
    area_density: np.ndarray  # (k,) float64 [m²/m³] of leaves; NaN: not given

    def __len__(self):
        return len(self.names)

    @property
    def volume(self):
        """Volume inside each crown: (k,) float64 [m³]."""
        leaves = self.triangles[~self.trunk]
        middle = self.vertices.mean(axis=0)
        return np.bincount(
            self.tree[~self.trunk], volumes_below(self.vertices - middle, leaves), len(self)
        )


@dataclass
class Surfaces:
    """Surfaces, one per polygon of the city, in input order: the rows of all results."""

    surface_id: list  # (n,) str
    building_id: list  # (n,) str
    thematic: list  # (n,) str
    kind: np.ndarray  # (n,) str: facade, roof, flat, steep, downward, ground, rack
    orientation: np.ndarray  # (n,) str: of ORIENTATIONS, or none
    eligible: np.ndarray  # (n,) bool
    area: np.ndarray  # (n,) float64 [m²]
    surface_tilt: np.ndarray  # (n,) float64 [°]
    # (n,) float64 [°] clockwise from true north; 0 if the surface is level
    surface_azimuth: np.ndarray
    normal: np.ndarray  # (n, 3) float64, unit length
    # (n,) str, names of materials, "" if there is none; None if not recorded
    material: list | None = None
    # (n,) float64 [m], of `measure_edge_distance`; None: unknown
    edge_distance: np.ndarray | None = None
    height_source: list | None = None  # of City

    def __len__(self):
        return len(self.surface_id)

    def take(self, rows):
        """Some surfaces, (k,) int: Surfaces."""
        taken = {}
        for name, values in vars(self).items():
            taken[name] = (
                values[rows]
                if isinstance(values, np.ndarray)
                else values and [values[row] for row in rows]
            )
        return Surfaces(**taken)

    def join(self, other):
        """Surfaces of both, the first ones first; what the other ones do not record is NaN or
        empty: Surfaces.
        """
        joined = {}
        for name, own in vars(self).items():
            more = getattr(other, name)
            if isinstance(own, np.ndarray):
                joined[name] = np.concatenate(
                    [own, np.full(len(other), np.nan) if more is None else more]
                )
            else:
                joined[name] = own and [*own, *(more or [""] * len(other))]
        return Surfaces(**joined)


class Halo(IntEnum):
    """What a triangle is to a tile: its own, or of its surroundings, which have no results."""

    OWN = 0
    NEAR = 1
    FAR = 2


@dataclass
class Scene:
    """Triangles with the surface each belongs to; axes x true east, y true north, z up; metres;
    local origin.
    """

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int32 into vertices, counter-clockwise seen from outside
    # (t,) int32 into surfaces; -1 for generated ground, terrain, backs of racks
    triangle_surface: np.ndarray
    # (t,) bool: footprint of a building; counts as a back face from both sides
    footprint: np.ndarray
    # (t,) bool: ClosureSurface between buildings; blocks rays, receives no light
    closure: np.ndarray
    surfaces: Surfaces
    site: Site
    report: ImportReport = field(default_factory=ImportReport)
    # name of a material of the files -> (3,) linear RGB, None if not given
    colours: dict = field(default_factory=dict)
    # (t,) bool: open sheet without thickness, lit on both sides; None: none
    sheet: np.ndarray | None = None
    # (t,) int32, for back sides made by `with_backs`: their triangle, else -1
    back_of: np.ndarray | None = None
    # (k, 4, 3) float64 [m], corners of the fronts, which are the last k surfaces
    racks: np.ndarray | None = None
    # (t,) int32: surface of the rack whose underside or edge it is, else -1
    rack_of_back: np.ndarray | None = None
    back_albedo: float = 0.0  # of those undersides and edges
    trees: Crowns | None = None  # None: the model has no vegetation
    # (t,) int64 among the triangles of its surface; None: counted here
    number: np.ndarray | None = None
    lattice: tuple | None = None  # build_ground.Lattice of generated ground
    ground_albedo: float = 0.25  # of the open ground around, to the horizon
    terrain_laid: bool = False  # whether the ground without rows in the tables is measured terrain
    # (t,) int8 of Halo, of a tile; None: not a tile
    halo: np.ndarray | None = None

    def check(self):
        """Raise an error if a scene cannot be traced.

        Raises
        ------
        InputError
        """
        check_triangles(self.vertices, self.triangles)
        count, own = len(self.triangles), len(self.surfaces)
        check_array(
            "triangle_surface", self.triangle_surface, (count,), kind="i", least=-1, most=own - 1
        )
        for name in ("footprint", "closure", "sheet"):
            if name != "sheet" or self.sheet is not None:
                check_array(name, getattr(self, name), (count,), kind="b")
        for name, most in (("back_of", count - 1), ("rack_of_back", own - 1)):
            if getattr(self, name) is not None:
                check_array(name, getattr(self, name), (count,), kind="i", least=-1, most=most)

    def with_backs(self):
        """The scene with a reversed triangle appended for each triangle of a sheet.

        These belong to no row of the tables; `back_of` has the triangle whose back each is. Rays do
        not hit them: they hit the sheet, from one side or the other.

        Returns
        -------
        Scene
            `self` itself if there are no sheets.
        """
        if self.sheet is None or not self.sheet.any() or self.back_of is not None:
            return self
        rows = np.flatnonzero(self.sheet).astype(np.int32)
        none = np.full(len(self.triangles), -1, np.int32)
        return replace(self, back_of=none).append_triangles(
            self.triangles[rows][:, [0, 2, 1]], back_of=rows
        )

    @property
    def own(self):
        """Triangles that have results: (t,) bool; of a tile those that are its own."""
        return np.ones(len(self.triangles), bool) if self.halo is None else self.halo == Halo.OWN

    @property
    def surface_of_triangle(self):
        """Surface that each triangle is a part of, or the back of: (t,) int, -1 on generated
        ground.
        """
        surface = self.triangle_surface
        if self.back_of is not None:
            surface = np.where(self.back_of >= 0, surface[self.back_of], surface)
        if self.rack_of_back is not None:
            surface = np.where(self.rack_of_back >= 0, self.rack_of_back, surface)
        return surface

    @property
    def other_sides(self):
        """The triangle on the other side of each triangle of a sheet: (t,) int32, -1 for all
        others.
        """
        other = np.full(len(self.triangles), -1, np.int32)
        if self.back_of is not None:
            backs = np.flatnonzero(self.back_of >= 0)
            other[backs] = self.back_of[backs]
            other[self.back_of[backs]] = backs
        return other

    @property
    def ground_reach(self):
        """Extent of the generated ground beyond the city, in building heights, for which its edge
        costs less than 0.1 % of the light: float.

        Ground further away is taken as unshaded. At its edge, r building heights away, a row of
        buildings hides (1 - cos β)/2 ≈ 1/(4 r²) of its sky, with tan β = 1/r, and the light that it
        passes on grows with its albedo: the same error needs a reach in proportion to the root of
        the albedo.
        """
        # Ground that absorbs nothing reaches eight building heights, dark ground at least three.
        return max(3.0, 8.0 * self.ground_albedo**0.5)

    def corners_of(self, chosen):
        """Corners of some triangles, (t,) bool or (k,) int: (k, 3, 3) float64 [m]."""
        return np.asarray(self.vertices, float)[self.triangles[chosen]]

    def append_triangles(
        self, triangles, surface=-1, *, footprint=False, closure=False, back_of=-1, rack_of_back=-1
    ):
        """The scene with more triangles, (k, 3) int into its vertices; the others are (k,) or one
        for all, as of Scene.
        """
        new = {
            "triangle_surface": surface,
            "footprint": footprint,
            "closure": closure,
            "sheet": False,
        }
        new |= {"back_of": back_of, "rack_of_back": rack_of_back}
        for name, values in new.items():
            old = getattr(self, name)
            own = (
                None
                if old is None
                else np.broadcast_to(np.asarray(values, old.dtype), len(triangles))
            )
            new[name] = None if old is None else np.concatenate([old, own])
        return replace(
            self, triangles=np.concatenate([self.triangles, triangles.astype(np.int32)]), **new
        )


def volumes_below(vertices, triangles):
    """Volumes between triangles and the origin, (t,) float64 [m³]; the triangles of a closed body
    add up to its own volume.
    """
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.einsum("ti,ti->t", a, np.cross(b, c)) / 6
