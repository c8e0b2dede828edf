"""A city reduced to some of its patches: arrays have rows of these only, all other triangles still
block rays.

    rows       of the part │ when backs of others are hit │ when generated ground is hit from below
               as they are │ neither receives nor reflects │ the same, and faces up

Each patch of the part can be met for others that are like it, as in the surroundings of a tile. The
tree still holds the whole city. Patches keep their random numbers, so that their rays and hits do
not change; only the time and memory of arrays for the other patches are saved.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from ..city.scene import Scene
from ..light.prepare_scene import PreparedScene

BACKS = 2  # rows for backs: of others, and of the ground from below


@dataclass
class PartOfCity:
    """Some patches of a city, ready to be traced."""

    scene: Scene  # of the surfaces of the part, for the tables
    prepared: PreparedScene
    patches: np.ndarray  # (k,) int, rows in the whole city; the first k of the part
    surfaces: np.ndarray  # (n,) int, likewise for the surfaces


class _RaysOfPart:
    """The tree of a whole city, with hits told as rows of a part.

    Parameters
    ----------
    rows : tuple of (p,) int32 and (p,) int32
        Row that stands for each patch when its front is hit, and when its back is.
    whole : tuple
        Of `RayScene`.
    """

    canopy, states = None, 1  # with trees a city is traced as a whole

    def __init__(self, rows, whole):
        self.whole, self._rows = whole, rows
        self._whole, self._facing = whole[0], whole[1].facing
        self._whole.canopy = None
        self.engine = self._whole.engine
        self.trace_shadow_states = self._whole.trace_shadow_states

    @property
    def thread_seconds(self):
        """Spent in Embree, summed over the threads [s]."""
        return self._whole.thread_seconds

    def trace_places(self, ray_origins, ray_directions):
        """As of `FacingScene`."""
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        places = self._whole.trace_places(ray_origins, ray_directions)
        _turn_to_rows(self._rows, self._facing, ray_directions, places.triangle)
        return places

    def trace_closest(self, ray_origins, ray_directions):
        """As of `RayScene`."""
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        hit = self._whole.trace_closest(ray_origins, ray_directions)
        _turn_to_rows(self._rows, self._facing, ray_directions, hit)
        return hit


@njit(nogil=True, cache=True)
def _turn_to_rows(rows, facing, directions, hit):
    """Change patches that rays hit, (m,) int32, to rows of a part, in place.

    Parameters
    ----------
    rows : tuple of (p,) int32 and (p,) int32
        Of `RaysOfPart`.
    facing : (p, 4) float32
    directions : (m, 3) float32
    """
    front, back = rows
    for ray in range(len(hit)):
        met = hit[ray]
        if met >= 0:
            along = directions[ray, 0] * facing[met, 0] + directions[ray, 1] * facing[met, 1]
            along += directions[ray, 2] * facing[met, 2] + facing[met, 3]
            hit[ray] = back[met] if along > 0 else front[met]


def keep_patches(scene, prepared, members, reported=()):
    """Reduce a city to some of its patches.

    Parameters
    ----------
    scene : Scene
    prepared : PreparedScene
        With its tree.
    members : (p,) int
        Patch of the part that is met in place of each; a patch of the part stands for itself.
    reported : (m,) int, optional
        Surfaces that have rows whether or not any of their patches is in the part.

    Returns
    -------
    PartOfCity
        The whole city where hardly a row would be saved, or where it cannot be reduced.
    """
    every = np.arange(len(members))
    rows = np.flatnonzero(members == every)
    # Crowns and mirrors need the very triangles that are hit, and so do mirrors that are switched
    # off, which are black. Then, or where hardly a row would be saved, the whole city is returned.
    plan, specular = prepared.plan, prepared.plan["specular"]
    by_triangles = plan.foliage is not None or specular.on or specular.bound is None
    if len(rows) + BACKS >= len(every) or by_triangles:
        return PartOfCity(scene, prepared, every, np.arange(len(scene.surfaces)))
    # Rows that stay, with the surfaces that they belong to, and backs that stand for all others.
    owner = prepared.scene.triangle_surface
    surfaces = np.union1d(owner[rows][owner[rows] >= 0], np.asarray(reported, int))
    taken = np.concatenate([rows, np.zeros(BACKS, int)])
    patches = _add_backs(prepared.patches.take(taken), len(rows))
    own = np.full(len(taken), -1, np.int32)
    own[: len(rows)] = np.where(owner[rows] >= 0, np.searchsorted(surfaces, owner[rows]), -1)
    # Fields of triangles, patches and plan, each for these rows only.
    of_triangles = {
        name: getattr(prepared.scene, name)[taken] for name in ("triangles", "footprint", "closure")
    }
    # Links between triangles, and marks of a tile, are not kept.
    unknown = dict.fromkeys(("sheet", "back_of", "rack_of_back", "number", "halo"))
    racks = scene.racks
    if racks is not None:
        first = len(scene.surfaces) - len(racks)
        racks = racks[surfaces[surfaces >= first] - first]
    few = replace(
        prepared.scene,
        **of_triangles,
        triangle_surface=own,
        surfaces=scene.surfaces.take(surfaces),
        racks=racks,
        **unknown,
    )
    materials = [prepared.materials[k] for k in [*surfaces, -1]]
    # Rays still meet the whole city; a hit is told as the row that stands for it, in its own place
    # or as a back.
    whole = prepared.plan.ray_scene, prepared.patches, taken
    ray_scene = _RaysOfPart(_rows_of_hits(prepared.patches, rows, members), whole)
    of_patches = {
        name: getattr(plan, name) for name in ("unobstructed", "open_to_suns", "receivers")
    }
    of_rows = {name: values[taken] for name, values in of_patches.items() if values is not None}
    plan = replace(plan, **of_rows, ray_scene=ray_scene)
    return PartOfCity(
        few,
        replace(prepared, scene=few, materials=materials, patches=patches, plan=plan),
        rows,
        surfaces,
    )


def _add_backs(patches, first):
    """The rows from the first on as what is hit of others from behind; the last one is the ground
    from below.
    """
    for name, value in (("receives", False), ("ground", False), ("other_side", -1), ("area", 0)):
        getattr(patches, name)[first:] = value
    patches.facing[first:] = 0, 0, 0, 1  # hit from behind whatever the direction
    patches.ground[-1], patches.normal[-1] = True, (0, 0, 1)
    return patches


def _rows_of_hits(patches, rows, members):
    """Rows of `RaysOfPart`; members as of `keep_patches`."""
    front = np.searchsorted(rows, members).astype(np.int32)
    back = len(rows) + (patches.ground & (patches.normal[:, 2] > 0))
    back[rows] = front[rows]
    return front, back.astype(np.int32)
