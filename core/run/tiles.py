"""Tiles of a city: which surfaces each reports, and what around it shades these or reflects onto
them.

                    │<─ reach ─>│                    A square tile reports the surfaces whose
                    centres lie in it. Its
  far      far      ┌───────────┐     far            near surroundings, some building heights wide,
  are traced with
   ▲        ┊       │   near    │      ┊             it. Of all that lies further out, what rises by
   less than 2° █  ┄ ┄ ┄ ┊ ┄ ┄ ┄ │  ┌─────┐  │      ┊             above the lowest point there is
   left out: no sun that is █        ▄       │  │tile │  │      ▄             traced stands so low.
   The rest shades, and reflects light
───█────────█───────┴──┴─────┴──┴──────█─── ground   where a ray from within meets it.
 kept    left out                   left out
"""

from dataclasses import dataclass, replace

import numpy as np

from ..city.build_ground import SHORTEST_REACH
from ..city.city import ImportReport
from ..city.scene import Crowns, Halo
from ..patches.patches import number_triangles
from ..sun.solar_position import MINIMUM_ELEVATION

DEFAULT = 1000.0  # [m]
RISE = np.tan(np.radians(MINIMUM_ELEVATION))
LEFT_OUT = np.int8(-1)


@dataclass
class _Pieces:
    """What is kept or left out together: n surfaces, then each triangle of the ground, then each
    tree's crown.
    """

    low: np.ndarray  # (k, 3) float64 [m]
    high: np.ndarray  # (k, 3) float64 [m]
    of_triangle: np.ndarray  # (t,) int into pieces
    first_crown: int  # pieces from here on are crowns


@dataclass
class _Tile:
    """A tile and its surroundings."""

    name: str
    rows: np.ndarray  # (m,) int, surfaces that it reports, ascending
    box: tuple  # bounds of the tile with its near surroundings, two (3,) float64 [m]
    around: np.ndarray  # (k,) int8 of pieces: Halo.OWN, Halo.NEAR, Halo.FAR or LEFT_OUT
    lowest: float  # [m] lowest point in the box
    reach: float  # [m] width of the near surroundings
    farthest: float  # [m] from the near surroundings to the farthest piece that is kept


def box_pieces(scene):
    """Bounding boxes of a scene's pieces: Pieces."""
    owner, count = scene.surface_of_triangle, len(scene.surfaces)
    ground = owner < 0
    piece = owner.astype(np.int64)
    piece[ground] = count + np.arange(ground.sum())
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    low, high = _box_members(corners, piece, count + int(ground.sum()))
    first_crown = len(low)
    if scene.trees is not None:
        crowns = scene.trees
        box = _box_members(
            np.asarray(crowns.vertices, float)[crowns.triangles], crowns.tree, len(crowns)
        )
        low, high = np.concatenate([low, box[0]]), np.concatenate([high, box[1]])
    return _Pieces(low, high, piece, first_crown)


def _box_members(corners, member, count):
    """Lowest and highest corner of some sets of triangles: two (count, 3) float64; infinite where a
    set is empty.
    """
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, member, corners.min(axis=1))
    np.maximum.at(high, member, corners.max(axis=1))
    return low, high


def find_centres(scene):
    """Centres of the bounding boxes of the surfaces in plan: (n, 2) float64 [m].

    A surface without triangles takes the centre of the one before it.
    """
    own, count = scene.triangle_surface >= 0, len(scene.surfaces)
    corners = np.asarray(scene.vertices, float)[scene.triangles[own]]
    low, high = _box_members(corners, scene.triangle_surface[own], count)
    known = np.flatnonzero(np.isfinite(low[:, 0]))
    if not len(known):
        return np.zeros((count, 2))
    before = known[np.maximum(np.searchsorted(known, np.arange(count), side="right") - 1, 0)]
    return (low[before, :2] + high[before, :2]) / 2


def assign_tiles(scene, size):
    """Surfaces of each square that has any; every surface is in exactly one.

    Parameters
    ----------
    scene : Scene
    size : float
        [m] Side of a square.

    Returns
    -------
    list of (str, (m,) int)
        Name, of column and row from the south-west, and rows of surfaces, ascending.
    """
    centres = find_centres(scene)
    place = np.floor((centres - centres.min(axis=0)) / size).astype(np.int64)
    squares, member = np.unique(place[:, ::-1], axis=0, return_inverse=True)
    order = np.argsort(member.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(member.ravel(), minlength=len(squares)))
    names = [f"{x:03d}_{y:03d}" for y, x in squares.tolist()]
    return list(zip(names, np.split(order, ends[:-1]), strict=True))


def surround(name, rows, pieces, ground_reach):
    """A tile with what lies around it.

    Parameters
    ----------
    name : str
    rows : (m,) int
    pieces : Pieces
    ground_reach : float
        Of the whole scene: how far the near surroundings reach, in heights of the tile's own
        surfaces, from the lowest to the highest point.

    Returns
    -------
    Tile
    """
    around = np.full(len(pieces.low), LEFT_OUT)
    real = rows[np.isfinite(pieces.low[rows, 0])]
    if not len(real):  # nothing but surfaces without triangles
        around[rows] = Halo.OWN
        return _Tile(name, rows, (np.zeros(3), np.zeros(3)), around, 0.0, 0.0, 0.0)
    low, high = pieces.low[real].min(axis=0), pieces.high[real].max(axis=0)
    reach = max(ground_reach * float(high[2] - low[2]), SHORTEST_REACH)
    near = gap(pieces.low, pieces.high, low, high) <= reach
    lowest = min(float(pieces.low[near, 2].min()), float(low[2]))
    box = low - reach, high + reach
    far = _rises(pieces.low, pieces.high, box, lowest)
    around[far], around[near], around[rows] = Halo.FAR, Halo.NEAR, Halo.OWN
    kept = gap(pieces.low[far], pieces.high[far], *box)
    return _Tile(name, rows, box, around, lowest, reach, float(kept.max(initial=0.0)))


def _rises(low, high, box, lowest):
    """Whether boxes rise by more than 2° as seen from anywhere in another box: (k,) bool."""
    return high[:, 2] - lowest > RISE * gap(low, high, *box)


def gap(low, high, other_low, other_high):
    """Distance in plan between boxes and another box: (k,) float64 [m]."""
    apart = np.maximum(low[:, :2] - other_high[:2], other_low[:2] - high[:, :2])
    return np.hypot(*np.maximum(apart, 0).T)


def prepare_whole(scene):
    """The scene with what its parts inherit from it: backs of sheets, and the numbers of its
    triangles.
    """
    scene = scene.with_backs()
    return replace(scene, number=number_triangles(scene))


def take_part(scene, pieces, tile):
    """Scene of a tile and its surroundings, with the origin, the axes and the random numbers of the
    whole.

    Parameters
    ----------
    scene : Scene
        Of `prepare_whole`.
    pieces : Pieces
    tile : Tile

    Returns
    -------
    scene : Scene
    rows : (k,) int
        Its surfaces in the whole.
    complete : bool
        Whether nothing of the whole is left out.
    """
    # Far pieces without what is low on them: only what rises into the tile's sky counts.
    around = tile.around[pieces.of_triangle]
    far = np.flatnonzero(around == Halo.FAR)
    corners = np.asarray(scene.vertices, float)[scene.triangles[far]]
    # lower parts of facades
    low = ~_rises(corners.min(axis=1), corners.max(axis=1), tile.box, tile.lowest)
    around[far[low]] = LEFT_OUT
    complete = bool((tile.around > LEFT_OUT).all() and (around > LEFT_OUT).all())
    kept = np.flatnonzero(around > LEFT_OUT)
    # Vertices and surfaces of what is kept, numbered anew; its surroundings carry no modules.
    used, triangles = np.unique(scene.triangles[kept], return_inverse=True)
    count = len(scene.surfaces)
    rows = np.flatnonzero(tile.around[:count] > LEFT_OUT)
    place = np.full(count + 1, -1, np.int32)  # the generated ground's -1 takes the last
    place[rows] = np.arange(len(rows), dtype=np.int32)
    surfaces = scene.surfaces.take(rows)
    surfaces.eligible &= np.isin(rows, tile.rows)  # only its own
    # What every scene has of each triangle, and what some have.
    of_triangles = {
        name: getattr(scene, name) for name in ("footprint", "closure", "number", "sheet")
    }
    part = replace(
        scene,
        **{name: values[kept] for name, values in of_triangles.items() if values is not None},
        vertices=scene.vertices[used],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        triangle_surface=place[scene.triangle_surface[kept]],
        surfaces=surfaces,
        report=ImportReport(),
        halo=around[kept],
        trees=_take_crowns(scene.trees, tile.around[pieces.first_crown :] > LEFT_OUT),
    )
    # Links between triangles and racks, in the new numbers.
    if scene.back_of is not None:
        triangle = np.full(len(scene.triangles) + 1, -1, np.int32)
        triangle[kept] = np.arange(len(kept), dtype=np.int32)
        part.back_of = triangle[scene.back_of[kept]]
    if scene.rack_of_back is not None:
        part.rack_of_back = place[scene.rack_of_back[kept]]
    if scene.racks is not None:
        first = count - len(scene.racks)
        part.racks = scene.racks[rows[rows >= first] - first]
    return part, rows, complete


def _take_crowns(crowns, chosen):
    """Some trees: Crowns, or None without any."""
    if crowns is None or not chosen.any():
        return None
    kept = np.flatnonzero(chosen[crowns.tree])
    place = np.cumsum(chosen) - 1
    used, triangles = np.unique(crowns.triangles[kept], return_inverse=True)
    trees = np.flatnonzero(chosen)
    return Crowns(
        crowns.vertices[used],
        triangles.reshape(-1, 3).astype(crowns.triangles.dtype),
        place[crowns.tree[kept]].astype(crowns.tree.dtype),
        crowns.trunk[kept],
        [crowns.names[tree] for tree in trees.tolist()],
        crowns.height[trees],
        crowns.evergreen[trees],
        crowns.area_density[trees],
    )
