"""The part of a scene that a tile needs."""

from dataclasses import fields, replace

import numpy as np

from ..city.city import ImportReport
from ..city.scene import FAR, OWN, add_backs
from ..patches.patches import number_triangles
from ..patches.read_albedo import brdfs_of_triangles
from ..trees.crowns import Crowns
from .coarsen_surroundings import coarsen
from .tiles import LEFT_OUT, rises


def prepare_whole(scene):
    """The scene with what its parts inherit from it: backs of sheets, and the numbers of its triangles."""
    scene = add_backs(scene)
    return replace(scene, number=number_triangles(scene))


def take_part(scene, pieces, tile, materials):
    """Scene of a tile and its surroundings, with the origin, the axes and the random numbers of the whole.

    Parameters
    ----------
    scene : Scene
        Of `prepare_whole`.
    pieces : Pieces
    tile : Tile
    materials : list of Found
        Of all surfaces and the ground.

    Returns
    -------
    scene : Scene
    rows : (k,) int
        Its surfaces in the whole.
    moved : (t,) bool
        Triangles of the scene that were made coarser.
    complete : bool
        Whether nothing of the whole is left out.
    """
    around = tile.around[pieces.of_triangle]
    around[hide_below(scene, np.flatnonzero(around == FAR), tile)] = LEFT_OUT
    complete = bool((tile.around > LEFT_OUT).all() and (around > LEFT_OUT).all())
    kept = np.flatnonzero(around > LEFT_OUT)
    used, triangles = number_corners(scene.triangles[kept], len(scene.vertices))
    exact = (around[kept] == OWN) | (brdfs_of_triangles(scene, None, materials).index[kept] >= 0)
    vertices, triangles, distinct, moved = coarsen(scene.vertices[used], triangles, around[kept] == OWN, exact)
    kept = kept[distinct]
    count = len(scene.surfaces)
    rows = np.flatnonzero(tile.around[:count] > LEFT_OUT)
    place = np.full(count + 1, -1, np.int32)  # the generated ground's -1 takes the last
    place[rows] = np.arange(len(rows), dtype=np.int32)
    part = replace(
        scene,
        vertices=vertices,
        triangles=triangles,
        triangle_surface=place[scene.triangle_surface[kept]],
        footprint=scene.footprint[kept],
        closure=scene.closure[kept],
        surfaces=take_surfaces(scene.surfaces, rows, tile.rows),
        report=ImportReport(),
        number=scene.number[kept],
        halo=around[kept],
        trees=take_crowns(scene.trees, tile.around[pieces.first_crown :] > LEFT_OUT),
    )
    return replace(part, **take_optional(scene, kept, place, rows)), rows, moved, complete


def hide_below(scene, far, tile):
    """Those triangles of the far surroundings that do not rise by 2° themselves: lower parts of facades, (k,) int."""
    corners = np.asarray(scene.vertices, float)[scene.triangles[far]]
    return far[~rises(corners.min(axis=1), corners.max(axis=1), tile.box, tile.lowest)]


def number_corners(triangles, count):
    """Which of `count` vertices some triangles have, (w,) int, and the triangles as rows of these, (t, 3) int32."""
    used = np.zeros(count, bool)
    used[triangles.ravel()] = True
    return np.flatnonzero(used), (np.cumsum(used, dtype=np.int32) - 1)[triangles]


def take_surfaces(surfaces, rows, own):
    """Some rows of the Surfaces, of which only a tile's own are eligible."""
    taken = {}
    for one in fields(surfaces):
        values = getattr(surfaces, one.name)
        taken[one.name] = take_rows(values, rows)
    taken["eligible"] = taken["eligible"] & np.isin(rows, own)
    return type(surfaces)(**taken)


def take_rows(values, rows):
    """Some rows of an array or a list; None of None."""
    if values is None or isinstance(values, np.ndarray):
        return None if values is None else values[rows]
    return [values[row] for row in rows.tolist()]


def take_optional(scene, kept, place, rows):
    """Fields that not every scene has: sheets with their backs, and racks."""
    found = {}
    if scene.sheet is not None:
        found["sheet"] = scene.sheet[kept]
    if scene.back_of is not None:
        triangle = np.full(len(scene.triangles) + 1, -1, np.int32)
        triangle[kept] = np.arange(len(kept), dtype=np.int32)
        found["back_of"] = triangle[scene.back_of[kept]]
    if scene.rack_of_back is not None:
        found["rack_of_back"] = place[scene.rack_of_back[kept]]
    if scene.racks is not None:
        first = len(scene.surfaces) - len(scene.racks)
        found["racks"] = scene.racks[rows[rows >= first] - first]
    return found


def take_crowns(crowns, chosen):
    """Some trees: Crowns, or None without any."""
    if crowns is None or not chosen.any():
        return None
    kept = np.flatnonzero(chosen[crowns.tree])
    place = np.cumsum(chosen) - 1
    used, triangles = number_corners(crowns.triangles[kept], len(crowns.vertices))
    trees = np.flatnonzero(chosen)
    return Crowns(
        crowns.vertices[used],
        triangles.astype(crowns.triangles.dtype),
        place[crowns.tree[kept]].astype(crowns.tree.dtype),
        crowns.trunk[kept],
        [crowns.names[tree] for tree in trees.tolist()],
        crowns.height[trees],
        crowns.evergreen[trees],
        crowns.area_density[trees],
    )
