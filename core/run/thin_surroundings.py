"""Few patches for the surroundings of a tile, the fewer the further away: the rest of them is met
as one of these.

    tile            ▕▔▔▏                       ┌───┐            Patches of one cell that look the same way form a
    ▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▕  ▏▁▁▁▁▁▕▔▏▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁│▔▔▏│▁▁▁▁▁       cluster. One of them, drawn among those that rays
    own patches: all          near: nearly all │  ▏│ one of     from the tile meet, passes light on for all.
                                               └───┘ a cell

Light that a receiver finds in a direction then comes from a patch a few degrees away, of the same
albedo, which is lit alike on average: a cluster is met as often as its members would be, and its
patch is drawn as often as it is met. What hides what stays exact, because rays still meet all
triangles of the tile: only arrays have rows of fewer patches.
"""

import numpy as np

from ..rays.hemisphere_rays import hemisphere_rays
from ..rays.random_numbers import mix, uniform
from ..rays.sample_points import sobol_digits
from .part_of_city import keep_patches
from .tiles import gap


def thin_surroundings(scene, prepared, reported):
    """The tile with fewer patches around it.

    Parameters
    ----------
    scene : Scene
        Of a tile.
    prepared : PreparedScene
        Of it, with its tree.
    reported : (m,) int
        Surfaces of the scene that the tile reports.

    Returns
    -------
    PartOfCity
        The whole tile where hardly a patch would be saved, or with trees or mirrors: crowns and
        mirrors need the very triangles that are hit.
    """
    cluster = _cluster_patches(prepared.scene, prepared.patches)
    members = draw_members(cluster, _count_met(prepared, prepared.scene.own), prepared.patches)[
        cluster
    ]
    return keep_patches(scene, prepared, members, reported)


def _cluster_patches(scene, patches):
    """Cluster of each patch, (p,) int from 0 on: one for each of the tile's own and of those close
    to it.

    Cells are cubes, aligned with the axes, of a power of two of a metre: WIDTH of their distance
    from the tile in plan or less. Patches of one cluster have the same albedo and nearly the same
    normal, and are all generated ground or all not.
    """
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    own = scene.own
    low, high = corners[own].min(axis=(0, 1)), corners[own].max(axis=(0, 1))
    distance = gap(corners.min(axis=1), corners.max(axis=1), low, high)
    # Size of the cubes by distance, as a power of two; patches larger than their cube stay alone.
    # A cell is 0.3 times as wide as its distance from the tile.
    level = np.floor(np.log2(np.maximum(0.3 * distance, 1e-9)))
    longest = np.ptp(corners, axis=1).max(axis=1)
    alone = own | (np.exp2(level) < longest)
    cell = np.floor(corners.mean(axis=1) / np.exp2(level)[:, None])
    # Rounded to whole numbers after this: 26 directions, 45° apart.
    facet = np.rint(1.2 * patches.normal)
    kind = np.column_stack([patches.albedo, scene.triangle_surface < 0, patches.receives])
    # Same cube, direction, albedo and kind: one cluster.
    told = np.column_stack([level, cell, facet, kind])[~alone]
    cluster = np.empty(len(corners), np.int64)
    cluster[alone] = np.arange(alone.sum())
    cluster[~alone] = alone.sum() + np.unique(told, axis=0, return_inverse=True)[1].ravel()
    return cluster


def _count_met(prepared, own, *, patches_per_task=1 << 16):
    """How many of some rays from a tile's own patches, (p,) bool, meet the front of each patch:
    (p,) int.
    """
    patches, ray_scene = prepared.patches, prepared.plan.ray_scene
    rows = np.flatnonzero(own & patches.receives)
    keys = patches.key.copy()
    # Other rays than the ones that are traced for light.
    keys[rows] = mix(keys[rows] ^ np.uint64(0x7417))
    others = type(patches)(**{**vars(patches), "key": keys})
    sequence, met = sobol_digits(1), np.zeros(len(patches), np.int64)
    for first in range(0, len(rows), patches_per_task):
        chosen = rows[first : first + patches_per_task]
        origins, directions, _ = hemisphere_rays(others, chosen, sequence)
        directions = directions.reshape(-1, 3)
        hit = ray_scene.trace_places(origins.reshape(-1, 3), directions).triangle
        front = (hit >= 0) & (
            np.einsum("ij,ij->i", directions, patches.facing[hit, :3]) + patches.facing[hit, 3] < 0
        )
        met += np.bincount(hit[front], minlength=len(met))
    return met


def draw_members(cluster, met, patches):
    """Patch of each cluster that is met for all: (c,) int.

    Drawn in proportion to the rays that meet each; where none was met, by area.
    """
    count = int(cluster.max(initial=-1)) + 1
    seen = np.bincount(cluster, met, count)[cluster] > 0
    weight = np.where(seen, met, patches.area)
    chance = np.maximum(
        uniform(mix(patches.key ^ np.uint64(0xD7A3)), 1)[:, 0].astype(float), 2.0**-25
    )
    # Of numbers with exponential distributions, each is the least with a chance in proportion to
    # its rate.
    with np.errstate(divide="ignore"):
        order = np.lexsort((-np.log(chance) / weight, cluster))
    return order[np.searchsorted(cluster[order], np.arange(count))]
