"""What light has no part in: which parts of surfaces lie inside or under something, and which have
no room for modules.

│ │        A ray from each cover cell goes straight ahead. There is no room where it meets a face
           turned against its own
│→│ house  within the clearance: a neighbour's wall, the back of a lift shaft, a canopy close above
           a roof. What is
│ │        narrower than `Tolerances.accuracy` touches, all else is a gap: light falls into it and
           leaves it again, but
           does not count in the means of surfaces whose other parts may carry modules.
"""

import numpy as np

from ..city.racks import RACK, find_racked_roofs
from ..patches.cover_cells import unpack_cells
from ..patches.facing_scene import FacingScene
from ..patches.find_covered import find_covered_cells
from ..patches.near_faces import cells_near_faces
from ..patches.patches import Patches
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..settings.progress import silent
from ..settings.system_settings import CLEARANCES
from ..settings.threads import map_in_order, usable_threads
from .sun_matrix import area_means, cover_of_surfaces

COVER_STAGE = "finding interior surfaces"
PATCHES_PER_TASK = 1 << 11


def measure_cover(scene, threads=None, progress=silent):
    """Covered share of each surface, as a run with the same patches finds it.

    Parameters
    ----------
    scene : Scene
    threads : int, optional
    progress : callable, optional
        See `core.settings.progress`.

    Returns
    -------
    (n,) float64
    """
    scene = scene.with_backs()
    patches = Patches.of_scene(scene, np.zeros(len(scene.triangles)), seed=0)
    threads = usable_threads(threads)
    ray_scene = FacingScene(scene, patches, threads)
    covered = find_cover(
        ray_scene, patches, patches.receives & (scene.triangle_surface >= 0), threads, progress
    )
    means = area_means(scene.triangle_surface, patches.area, len(scene.surfaces))
    return cover_of_surfaces(means, covered.mean(axis=1, dtype=np.float32))


def find_cover(ray_scene, patches, wanted, threads, progress=silent):
    """Which cells of patches are covered, as a run of either estimator finds it, whatever its seed
    and samples.

    Parameters
    ----------
    wanted : (p,) bool
        Patches whose cells are examined.

    Returns
    -------
    (p, CELL_DIVISIONS²) bool
        False for patches that receive light and are not wanted; True for those that receive none.
    """
    covered = np.zeros((len(patches), CELL_DIVISIONS**2), bool)
    covered[~patches.receives] = True
    rows = np.flatnonzero(wanted & patches.receives)
    tasks, done = (
        [rows[start : start + PATCHES_PER_TASK] for start in range(0, len(rows), PATCHES_PER_TASK)],
        0,
    )
    covered_parts = map_in_order(
        lambda chosen: find_covered_cells(ray_scene, patches, chosen), tasks, threads
    )
    if tasks:
        progress(COVER_STAGE, done, len(rows), "patches")
    for chosen, cells in zip(tasks, covered_parts, strict=True):
        covered[chosen] = cells
        done += len(chosen)
        progress(COVER_STAGE, done, len(rows), "patches")
    return covered


def list_clearances(request):
    """Clearances for which a run keeps the room: the paper's, the default and its own, ascending
    [m].
    """
    return tuple(sorted({*CLEARANCES, request.clearance}))


def average_room(to_surface, share):
    """Share of surfaces that is open but has no room, (n, k) float64, from the share of patches,
    (p, k).
    """
    return np.stack([cover_of_surfaces(to_surface, column) for column in share.T], axis=1)


def find_cramped(ray_scene, patches, scene, *, clearances, threads, asked=True):
    """Which cells of patches look at a face from less than each clearance: (p, k) uint64, as of
    `pack_cells`.

    `clearances` are k lengths [m]; `asked` the patches that are looked at, (p,) bool.
    """
    owner, kind = scene.triangle_surface, np.append(np.asarray(scene.surfaces.kind), RACK)
    cramped = np.zeros((len(patches), len(clearances)), np.uint64)
    # Ground and racks carry no further modules.
    wanted = patches.receives & ~np.isin(kind[owner], ("ground", RACK))
    rows = np.flatnonzero(wanted & asked)
    tasks = [
        rows[start : start + PATCHES_PER_TASK] for start in range(0, len(rows), PATCHES_PER_TASK)
    ]
    cramped_parts = map_in_order(
        lambda chosen: cells_near_faces(ray_scene, patches, chosen, clearances), tasks, threads
    )
    for chosen, cells in zip(tasks, cramped_parts, strict=True):
        cramped[chosen] = cells
    return cramped


def share_without_room(cramped, covered):
    """Share of patches that is not covered, but has no room: (p, k) float32 from their cells,
    (p, k) uint64 and (p, c) bool.
    """
    share, rows = np.zeros(cramped.shape, np.float32), np.flatnonzero(cramped.any(axis=1))
    share[rows] = (unpack_cells(cramped[rows]) & ~covered[rows, None]).mean(axis=2)
    return share


def choose_left_out(scene, to_surface, request, cramped):
    """Cells whose light is left out of the means of their surfaces: (p,) uint64.

    They have no room at the run's own clearance, on surfaces that have room on half of their area
    or more and may carry modules there. The light of other surfaces remains what falls on them.

    Parameters
    ----------
    scene : Scene
    to_surface : (n, p) sparse
        Averages patches over their surface.
    request : Request
    cramped : (p, k) uint64
        Of `find_cramped` at the clearances of `list_clearances`.
    """
    cells = cramped[:, list_clearances(request).index(request.clearance)]
    share = np.zeros(len(cells))
    rows = np.flatnonzero(cells)
    share[rows] = unpack_cells(cells[rows]).mean(axis=1)
    surfaces = scene.surfaces
    carries = (to_surface @ share <= 0.5) & ~find_racked_roofs(surfaces.surface_id, surfaces.kind)
    # The ground's -1 takes the last.
    return np.where(np.append(carries, False)[scene.triangle_surface], cells, np.uint64(0))
