"""The modules of a whole city: what each surface leaves to them, and how many it carries."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely

from ..city.city import number_names, whole_of_cell
from ..city.plan_geometry import draw_outlines
from ..city.polygons import plane_axes
from ..city.racks import RACK
from ..settings.tolerances import GEOMETRY
from .lay_modules import ModuleLayout, Planes, lay_modules
from .window_bands import window_boxes

WINDOWS = ("Window", "WindowSurface")
OPENINGS = (*WINDOWS, "Door", "DoorSurface")  # classes of surfaces that carry no modules


class FacadeRow(NamedTuple):
    """A line of the file of facades; None for what it leaves open."""

    storey: float | None = None  # [m]
    window_band: float | None = None  # [m]
    usable: float | None = None  # share


@dataclass(frozen=True)
class LayoutRules:
    """How modules are laid out."""

    size: tuple  # length and width of a module [m]
    storey: float = 3.0  # [m]
    window_band: float = 1.4  # [m] of each storey
    ground_floor: bool = False  # whether the lowest storey carries modules
    facades: dict = field(default_factory=dict)  # id or kind -> FacadeRow
    rows: bool = True  # whether modules lie in rows; else every square metre carries them

    @property
    def area(self):
        """Of a module [m²]."""
        return self.size[0] * self.size[1]

    def of_surfaces(self, surfaces, name, value):
        """One of a FacadeRow's values for each surface, (n,): its own, its kind's, or `value`."""
        default = np.broadcast_to(value, len(surfaces)).astype(float)
        if not self.facades:
            return default
        values = default.copy()
        for row, (own, kind) in enumerate(zip(surfaces.surface_id, surfaces.kind, strict=True)):
            for key in (own, whole_of_cell(own), str(kind)):
                given = getattr(self.facades.get(key), name, None)
                if given is not None:
                    values[row] = given
                    break
        return values


def lay_city(surfaces, outlines, carries, rules, *, hidden, taken=None):
    """Lay modules on the surfaces of a city.

    Parameters
    ----------
    surfaces : Surfaces
        n of them.
    outlines : Outlines
    carries : array, (n,) bool
        Which may carry modules.
    rules : LayoutRules
    hidden : array, (n,) float
        Share of each that a neighbour covers or stands close before: above a tenth a wall has no
        windows.
    taken : array, (n,) of shapely geometries or None, optional
        What is covered or has no room of each, in the axes of `plane_axes`.

    Returns
    -------
    layout : ModuleLayout
    count : array, (n,) float64
        Modules of each surface; cells of a grid share their polygon's by what they leave free.
    """
    kind = np.asarray(surfaces.kind)
    carries = carries & ~np.isin(np.asarray(surfaces.thematic, str), OPENINGS)
    racks = np.flatnonzero(carries & (kind == RACK))
    drawn = np.diff(outlines.surface_start) > 0
    rows = np.flatnonzero(carries & (kind != RACK) & drawn)
    count = np.zeros(len(surfaces))
    parts = [_lay_racks(surfaces, outlines, racks[drawn[racks]], rules)]
    count[racks] = np.floor(surfaces.area[racks] / rules.area + 1e-6)
    if len(rows):
        polygons = _draw_polygons(surfaces, outlines, rows, taken)
        parts.append(_lay_polygons(surfaces, outlines, polygons, rules, hidden))
        count += _share_out(parts[-1], polygons, len(surfaces))
    return ModuleLayout.join(parts), count


class _Polygons(NamedTuple):
    """Polygons that carry modules, p of them, of k surfaces; more than one of cut ones."""

    rows: np.ndarray  # (k,) int, surfaces
    polygon: np.ndarray  # (k,) int, of each surface
    cells: np.ndarray  # (k,) shapely, what each surface leaves free, in the plane of its polygon
    free: np.ndarray  # (p,) shapely
    first: np.ndarray  # (p,) int, a surface of each
    planes: Planes  # p


def _draw_polygons(surfaces, outlines, rows, taken):
    """What surfaces, (k,) int, leave to modules, in planes whose x runs along their rows:
    _Polygons.
    """
    # Cells of a grid are one polygon again.
    polygon = number_names([whole_of_cell(surfaces.surface_id[row]) for row in rows])
    _, first, of_row = np.unique(polygon, return_index=True, return_inverse=True)
    # Rows run along the horizontal of each plane, on level roofs along the longest edge.
    right, upward = plane_axes(surfaces.normal[rows[first]])
    turn = np.zeros(len(first))
    for number in np.flatnonzero(np.asarray(surfaces.kind)[rows[first]] == "flat"):
        own = rows[of_row == number] if len(first) < len(rows) else rows[first[number], None]
        turn[number] = _angle_of_longest_edge(outlines, own, right[number], upward[number])
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    axes = np.stack([cos * right + sin * upward, cos * upward - sin * right], axis=1)
    shape = outlines.points.astype(float), outlines.ring_start, outlines.surface_start
    # Outlines in these axes, without skylights and other openings.
    cells = draw_outlines(shape, rows, np.zeros((len(rows), 3)), axes[of_row])
    _cut_openings(surfaces, shape, rows, axes[of_row], cells)
    # Less what is covered or has no room, where this is given.
    if taken is not None:
        for number in [place for place, row in enumerate(rows) if taken[row] is not None]:
            (c,), (s,) = cos[of_row[number]], sin[of_row[number]]
            lost = shapely.transform(
                taken[rows[number]], lambda places, c=c, s=s: places @ np.array([[c, -s], [s, c]])
            )
            cells[number] = shapely.difference(cells[number], lost, grid_size=GEOMETRY.computed)
    # Cells of one polygon are joined, so that modules may lie across their borders.
    free = cells[first].copy()
    if len(first) < len(rows):
        many = np.bincount(of_row)
        for number in np.flatnonzero(many > 1):
            free[number] = shapely.union_all(cells[of_row == number], grid_size=GEOMETRY.corner)
    # Each plane by the foot of its normal and its two axes.
    normal = surfaces.normal[rows[first]]
    corner = outlines.points[outlines.ring_start[outlines.surface_start[rows[first]]]]
    origin = np.einsum("ij,ij->i", normal, corner.astype(float))[:, None] * normal
    return _Polygons(rows, of_row, cells, free, rows[first], Planes(origin, axes[:, 0], axes[:, 1]))


def _cut_openings(surfaces, shape, rows, axes, cells, *, depth=0.5):
    """Cut windows and doors of the same building out of what surfaces, (k,) int, leave free: those
    that lie in their plane or up to `depth` [m] before or behind it. `cells` are changed.

    Parameters
    ----------
    shape : tuple
        Of all surfaces, as of `draw_outlines`.
    axes : array, (k, 2, 3)
    """
    openings = np.flatnonzero(np.isin(np.asarray(surfaces.thematic, str), OPENINGS))
    building = np.asarray(number_names([str(name) for name in surfaces.building_id]))
    points, ring_start, surface_start = shape
    corner = points[np.minimum(ring_start[surface_start[:-1]], len(points) - 1)]
    for place, row in enumerate(rows) if len(openings) else ():
        own = openings[building[openings] == building[row]]
        normal = surfaces.normal[row]
        turned = np.abs(surfaces.normal[own] @ normal) < GEOMETRY.facing
        own = own[~turned & (np.abs((corner[own] - corner[row]) @ normal) < depth)]
        if len(own):
            plane = np.broadcast_to(axes[place], (len(own), 2, 3))
            holes = draw_outlines(shape, own, np.zeros((len(own), 3)), plane)
            cells[place] = shapely.difference(cells[place], shapely.union_all(holes))


def _angle_of_longest_edge(outlines, rows, right, upward):
    """Direction of the longest edge of some surfaces, from the axis `right` to `upward` [rad]."""
    rings = [outlines.rings(row)[0].astype(float) for row in rows]
    edges = np.concatenate([np.roll(ring, -1, axis=0) - ring for ring in rings])
    along = np.column_stack([edges @ right, edges @ upward])
    x, y = along[np.argmax((along**2).sum(axis=1))]
    # Of both directions the one to the right.
    return np.arctan2(y, x) if x > 0 else np.arctan2(-y, -x)


def _lay_polygons(surfaces, outlines, polygons, rules, hidden):
    """ModuleLayout of polygons, whose `surface` is the number of the polygon.

    `hidden`, (n,), is the share of each surface that a neighbour covers or stands close before.
    """
    first, planes = polygons.first, polygons.planes
    kind = np.asarray(surfaces.kind)[first]
    walls = np.flatnonzero(kind == "facade")
    storey = rules.of_surfaces(surfaces, "storey", rules.storey)[first]
    band = rules.of_surfaces(surfaces, "window_band", rules.window_band)[first]
    # Heights along y: of a plane's point z = y · upward_z + origin_z. A wall's lowest floor lies at
    # the lowest corner of its building.
    building = number_names([str(name) for name in surfaces.building_id])
    starts = outlines.ring_start[outlines.surface_start]
    lowest = np.full(building.max() + 1, np.inf)
    np.minimum.at(lowest, np.repeat(building, np.diff(starts)), outlines.points[:, 2])
    floor, rise = np.full(len(first), np.nan), planes.upward[:, 2]
    floor[walls] = (lowest[building[first[walls]]] - planes.origin[walls, 2]) / rise[walls]
    # Bands of windows are kept free on walls, but not on buildings whose windows are drawn, nor
    # where a neighbour hides more than a tenth of the wall, it is lower than a storey, or the rules
    # have no bands for it.
    thematic = np.asarray(surfaces.thematic, str)
    drawn = np.isin(building, np.unique(building[np.isin(thematic, WINDOWS)]))[first]
    area = np.asarray(surfaces.area)[polygons.rows]
    shut = np.bincount(polygons.polygon, np.asarray(hidden)[polygons.rows] * area)
    shut /= np.bincount(polygons.polygon, area)
    bounds = shapely.bounds(polygons.free)
    low = (bounds[:, 3] - bounds[:, 1]) * rise < storey
    blind = drawn | (shut > 0.1) | low | (band <= 0)
    boxes = [np.empty((0, 4))] * len(first)
    lit = walls[~blind[walls] & ~shapely.is_empty(polygons.free[walls])]
    for wall, outline in zip(lit, _outline_largest(polygons.free[lit]), strict=True):
        boxes[wall] = window_boxes(
            outline,
            floor[wall],
            storey[wall] / rise[wall],
            band[wall] / rise[wall],
            ground_floor=rules.ground_floor,
        )
    storeys = floor, np.where(np.isfinite(floor), storey / np.where(rise > 0, rise, 1.0), np.nan)
    return lay_modules(polygons.free, planes, kind, rules.size, boxes=boxes, storeys=storeys)


def _outline_largest(shapes):
    """Outer rings of the largest parts of some shapes, (k,): list of (c, 2) float64, closed and
    counter-clockwise.
    """
    if not len(shapes):
        return []
    parts, owner = shapely.get_parts(shapes, return_index=True)
    first = np.searchsorted(owner, np.arange(len(shapes)))
    largest = parts[np.lexsort((-shapely.area(parts), owner))[first]]
    # Normalised rings are clockwise.
    rings = shapely.get_exterior_ring(shapely.normalize(largest))
    places, ring = shapely.get_coordinates(rings, return_index=True)
    outlines = np.split(places, np.flatnonzero(np.diff(ring)) + 1)
    return [outline[::-1] for outline in outlines]


def _share_out(layout, polygons, surfaces):
    """Modules of each surface, (n,) float64, from a layout of polygons; cells by their area.

    `layout.surface` is changed into rows of surfaces: of cells the one below a module's middle.
    """
    number = np.bincount(layout.surface, minlength=len(polygons.free))
    area, whole = shapely.area(polygons.cells), np.zeros(len(polygons.free))
    np.add.at(whole, polygons.polygon, area)
    share = np.divide(area, whole[polygons.polygon], out=np.zeros(len(area)), where=area > 0)
    count = np.zeros(surfaces)
    count[polygons.rows] = number[polygons.polygon] * share
    owner = polygons.first[layout.surface]
    many = np.bincount(polygons.polygon)[layout.surface] > 1
    if many.any():
        planes, own = polygons.planes, layout.surface[many]
        middle = (layout.corner + 0.5 * (layout.along + layout.up))[many]
        places = shapely.points(
            np.einsum("ij,ij->i", middle, planes.right[own]),
            np.einsum("ij,ij->i", middle, planes.upward[own]),
        )
        for polygon in np.unique(own):
            cells = np.flatnonzero(polygons.polygon == polygon)
            chosen = np.flatnonzero(own == polygon)
            nearest = shapely.STRtree(polygons.cells[cells]).nearest(places[chosen])
            owner[np.flatnonzero(many)[chosen]] = polygons.rows[cells[nearest]]
    layout.surface[:] = owner
    return count


def _lay_racks(surfaces, outlines, racks, rules):
    """Modules side by side on racks, (k,) int: as many as their area holds, as deep as they are."""
    number = np.floor(surfaces.area[racks] / rules.area + 1e-6).astype(np.int64)
    first = outlines.ring_start[outlines.surface_start[racks]]
    corners = outlines.points[first[:, None] + np.arange(4)].astype(float)  # the lower edge first
    surface = np.repeat(np.arange(len(racks)), number)
    place = np.arange(len(surface)) - np.repeat(np.cumsum(number) - number, number)
    along = ((corners[:, 1] - corners[:, 0]) / np.maximum(number, 1)[:, None])[surface]
    corner = corners[surface, 0] + place[:, None] * along
    up = (corners[:, 3] - corners[:, 0])[surface]
    return ModuleLayout(racks[surface], corner, along, up, np.zeros(len(surface), np.int64))
