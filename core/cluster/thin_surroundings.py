"""Few patches for the surroundings of a tile, the fewer the further away: the rest of them is met as one of these.

    tile            ▕▔▔▏                       ┌───┐            Patches of one cell that look the same way form a
    ▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▕  ▏▁▁▁▁▁▕▔▏▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁│▔▔▏│▁▁▁▁▁       cluster. One of them, drawn among those that rays
    own patches: all          near: nearly all │  ▏│ one of     from the tile meet, passes light on for all.
                                               └───┘ a cell

Light that a receiver finds in a direction is then that of a patch a few degrees away, of the same albedo, which is lit
alike on average: a cluster is met as often as its members would be, and its patch is drawn as often as it is met. What
hides what stays exact, because rays still meet all triangles of the tile: only arrays have rows of fewer patches.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from ..city.scene import OWN
from ..effects.shadow_rays import ShadowRays
from ..light.transfer import take_fields
from ..patches.patches import take_patches
from ..rays.hemisphere_rays import hemisphere_rays
from ..rays.random_numbers import mix, uniform
from ..rays.sample_points import sobol_digits
from .tiles import gap

WIDTH = 0.3  # of a cell, as a share of its distance from the tile
FACETS = 1.2  # components of normals are rounded to whole numbers after this: 26 directions, 45° apart
PATCHES_PER_TASK = 1 << 16
STREAM, DRAWN = np.uint64(0x7417), np.uint64(0xD7A3)
BACKS = 4  # rows for backs of what has no row: of sheets or not, of the ground from below or not
PATCH_ARRAYS = ("sky-rays", "receivers", "reflectors")  # effects whose setting may have a row for each patch


@dataclass
class ThinTile:
    """A tile with few patches around it, ready to be traced."""

    scene: object  # Scene of the surfaces that have patches
    prepared: object  # PreparedScene
    surfaces: np.ndarray  # (n,) int, their rows in the tile


class RaysOfTile:
    """The tree of a whole tile, with hits told as rows of the patches that are kept.

    Parameters
    ----------
    rows : tuple of (p,) int32 and (p,) int32
        Row that stands for each patch of the tile when its front is hit, and when its back is.
    whole : tuple
        Tree of the tile, its Patches, and the patch of each row.
    """

    canopy = None

    def __init__(self, rows, whole):
        self.whole, self._rows = whole, rows
        self._whole, self._facing = whole[0], whole[1].facing
        self.engine = self._whole.engine
        self.trace_shadow_rays, self.trace_blocked = self._whole.trace_shadow_rays, self._whole.trace_blocked

    @property
    def thread_seconds(self):
        """Spent in Embree, summed over the threads [s]."""
        return self._whole.thread_seconds

    def trace_places(self, ray_origins, ray_directions):
        """As of `FacingScene`."""
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        places = self._whole.trace_places(ray_origins, ray_directions)
        turn_to_rows(self._rows, self._facing, ray_directions, places.triangle)
        return places

    def trace_closest(self, ray_origins, ray_directions):
        """As of `RayScene`."""
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        hit = self._whole.trace_closest(ray_origins, ray_directions)
        turn_to_rows(self._rows, self._facing, ray_directions, hit)
        return hit


@njit(nogil=True, cache=True)
def turn_to_rows(rows, facing, directions, hit):
    """Change patches that rays hit, (m,) int32, to rows of `RaysOfTile`, in place; `directions` are (m, 3) float32."""
    front, back = rows
    for ray in range(len(hit)):
        met = hit[ray]
        if met >= 0:
            along = directions[ray, 0] * facing[met, 0] + directions[ray, 1] * facing[met, 1]
            along += directions[ray, 2] * facing[met, 2] + facing[met, 3]
            hit[ray] = back[met] if along > 0 else front[met]


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
    ThinTile
        The whole tile where hardly a patch would be saved, or with trees or mirrors: crowns and mirrors need the very
        triangles that are hit.
    """
    plan, whole = prepared.plan, ThinTile(scene, prepared, np.arange(len(scene.surfaces)))
    specular = plan["specular"]
    if plan["trees"].on or specular.on or specular.bound is None:  # without a bound: switched off, such faces are black
        return whole
    cluster = cluster_patches(prepared.scene, prepared.patches)
    members = draw_members(cluster, count_met(prepared, prepared.scene.halo == OWN), prepared.patches)[cluster]
    rows = np.flatnonzero(members == np.arange(len(members)))
    if len(rows) + BACKS >= len(members):
        return whole
    return keep_members(scene, prepared, rows, members, np.asarray(reported, int))


def keep_members(scene, prepared, rows, members, reported):
    """A tile of which some patches, `rows`, are met in place of others, (p,) int `members`: ThinTile."""
    whole, owner = prepared.patches, prepared.scene.triangle_surface
    surfaces = np.union1d(owner[rows][owner[rows] >= 0], reported)
    taken = np.concatenate([rows, np.zeros(BACKS, int)])
    patches = take_patches(whole, taken)
    for name, value in (("receives", False), ("ground", False), ("other_side", -1), ("area", 0)):
        getattr(patches, name)[-BACKS:] = value
    patches.facing[-BACKS:] = 0, 0, 0, 1  # hit from behind whatever the direction
    patches.other_side[[-3, -1]] = 0
    patches.ground[-2:], patches.normal[-2:] = True, (0, 0, 1)
    own = np.full(len(taken), -1, np.int32)
    own[:-BACKS] = np.where(owner[rows] >= 0, np.searchsorted(surfaces, owner[rows]), -1)
    few = replace(
        prepared.scene,
        triangles=prepared.scene.triangles[taken],
        triangle_surface=own,
        footprint=prepared.scene.footprint[taken],
        closure=prepared.scene.closure[taken],
        surfaces=take_fields(scene.surfaces, surfaces),
        **dict.fromkeys(("sheet", "back_of", "racks", "rack_of_back", "number", "halo")),
    )
    front = np.searchsorted(rows, members).astype(np.int32)
    back = len(rows) + (whole.other_side >= 0) + 2 * (whole.ground & (whole.normal[:, 2] > 0))
    back[rows] = np.arange(len(rows))
    tree = RaysOfTile((front, back.astype(np.int32)), (prepared.plan.ray_scene, whole, taken))
    plan = replace(prepared.plan, effects=[take_effect(one, taken) for one in prepared.plan.effects], ray_scene=tree)
    materials = [prepared.materials[k] for k in [*surfaces, -1]]
    return ThinTile(few, replace(prepared, scene=few, materials=materials, patches=patches, plan=plan), surfaces)


def take_effect(effect, taken):
    """An Effect for some patches."""
    setting = effect.setting
    if effect.key in PATCH_ARRAYS and isinstance(setting, np.ndarray):
        return replace(effect, setting=setting[taken])
    if isinstance(setting, ShadowRays):
        return replace(effect, setting=replace(setting, unobstructed=setting.unobstructed[taken]))
    return effect


def cluster_patches(scene, patches):
    """Cluster of each patch, (p,) int from 0 on: one for each of the tile's own and of those close to it.

    Cells are cubes, aligned with the axes, of a power of two of a metre: WIDTH of their distance from the tile in plan
    or less. Patches of one cluster have the same albedo and nearly the same normal, and are all generated ground or all
    not.
    """
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    own = scene.halo == OWN
    low, high = corners[own].min(axis=(0, 1)), corners[own].max(axis=(0, 1))
    distance = gap(corners.min(axis=1), corners.max(axis=1), low, high)
    level = np.floor(np.log2(np.maximum(WIDTH * distance, 1e-9)))
    longest = np.ptp(corners, axis=1).max(axis=1)
    alone = own | (np.exp2(level) < longest)
    cell = np.floor(corners.mean(axis=1) / np.exp2(level)[:, None])
    facet = np.rint(FACETS * patches.normal)
    kind = np.column_stack([patches.albedo, scene.triangle_surface < 0, patches.receives])
    told = np.column_stack([level, cell, facet, kind])[~alone]
    cluster = np.empty(len(corners), np.int64)
    cluster[alone] = np.arange(alone.sum())
    cluster[~alone] = alone.sum() + np.unique(told, axis=0, return_inverse=True)[1].ravel()
    return cluster


def count_met(prepared, own):
    """How many of some rays from a tile's own patches, (p,) bool, meet the front of each patch: (p,) int."""
    patches, ray_scene = prepared.patches, prepared.plan.ray_scene
    rows = np.flatnonzero(own & patches.receives)
    keys = patches.key.copy()
    keys[rows] = mix(keys[rows] ^ STREAM)  # other rays than those that are traced for light
    others = type(patches)(**{**vars(patches), "key": keys})
    sequence, met = sobol_digits(1), np.zeros(len(patches), np.int64)
    for first in range(0, len(rows), PATCHES_PER_TASK):
        chosen = rows[first : first + PATCHES_PER_TASK]
        origins, directions, _ = hemisphere_rays(others, chosen, sequence)
        directions = directions.reshape(-1, 3)
        hit = ray_scene.trace_places(origins.reshape(-1, 3), directions).triangle
        front = (hit >= 0) & (np.einsum("ij,ij->i", directions, patches.facing[hit, :3]) + patches.facing[hit, 3] < 0)
        met += np.bincount(hit[front], minlength=len(met))
    return met


def draw_members(cluster, met, patches):
    """Patch of each cluster that is met for all: (c,) int.

    Drawn in proportion to the rays that meet each; where none was met, by area.
    """
    count = int(cluster.max(initial=-1)) + 1
    seen = np.bincount(cluster, met, count)[cluster] > 0
    weight = np.where(seen, met, patches.area)
    chance = np.maximum(uniform(mix(patches.key ^ DRAWN), 1)[:, 0].astype(float), 2.0**-25)
    # The least of numbers with exponential distributions of some rates is that of each in proportion to its rate.
    with np.errstate(divide="ignore"):
        order = np.lexsort((-np.log(chance) / weight, cluster))
    return order[np.searchsorted(cluster[order], np.arange(count))]
