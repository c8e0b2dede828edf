"""Trace a city tile by tile. Read this first.

    Scene ─► cut_tiles ─► take_part ─► part.pickle ─► trace_part (a worker) ─► tile.nc ─► join_tiles
    ─► Transfer
             who reports   triangles    on disk        thins the surroundings,
             and what is   and surfaces                reads and writes files
             around it

What is decided from the whole is the same in each tile: suns, number of reflections, effects,
materials, terrain. All triangles keep the random numbers that they have in the whole, so that a
tile's result depends neither on who traces it nor on how the rest is cut; it differs from the same
surfaces in a run of the whole by what its surroundings leave out, see `trace_part`.
"""

import hashlib
import pickle
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..effects.effect import TracePlan
from ..effects.rays import count_surely
from ..light.prepare_scene import PreparedScene
from ..patches.read_albedo import name_brdfs
from ..results.transfer_file import read_transfer
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import BEST_SKY, option_of
from ..settings.version import __version__
from .join_tiles import join_tiles
from .run_tasks import SERIAL, check_cluster, open_workers, read_told, write_task
from .study import prepare_study
from .tiles import DEFAULT, assign_tiles, box_pieces, prepare_whole, surround, take_part
from .trace_part import SHARES, Part, Run, trace_part

LARGEST = 1_000_000  # triangles that are planned as a whole
STAGE = "tiles"


@dataclass
class ClusterSettings:
    """How a city is cut, and who traces the tiles."""

    cluster: str  # word of `--cluster`
    tile: float = DEFAULT  # [m]


def check_cluster_settings(settings, request, *, smallest=20.0):
    """Refuse settings of tiles that mean nothing.

    Raises
    ------
    InputError
    """
    if settings is None:
        return
    # Tiles are at least twice the patches.
    if not smallest <= settings.tile < np.inf:
        raise InputError(
            "--tile",
            f"{settings.tile:g} m is too small",
            f"give {smallest:g} m or more, such as {DEFAULT:g}",
        )
    check_cluster(settings.cluster)
    for name in ("target_error", "time_budget"):
        if getattr(request, name) is not None:
            raise InputError(
                option_of(name), "is for runs without tiles", "leave it out, or leave out --cluster"
            )
    if request.estimator != "gather":
        raise InputError(
            "--estimator forward", "traces whole cities only", "use gather, or leave out --cluster"
        )


def plan_tiles(scene, weather, request, settings, tell):
    """What tracing a city in tiles calls for: PreparedScene; of a large one without patches, which
    only its tiles have.

    A large city is planned from the tile with most surfaces: patches of the whole would take more
    memory on one machine than any worker needs for its tile.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
    settings : ClusterSettings
    tell : callable
        Takes lines for the user.
    """
    if len(scene.triangles) <= LARGEST:
        return prepare_study(scene, weather, request)
    materials, whole = name_brdfs(scene, request), prepare_whole(scene)
    pieces = box_pieces(whole)
    name, rows = max(assign_tiles(whole, settings.tile), key=lambda square: len(square[1]))
    tile = surround(name, rows, pieces, scene.ground_reach)
    part, rows, _ = take_part(whole, pieces, tile)
    tell(f"  (decided for tile {name}, which has most surfaces)")
    of_part = [materials[row] for row in rows.tolist()] + materials[-1:]
    prepared = prepare_study(part, weather, request, materials=of_part)
    return PreparedScene(whole, materials, None, prepared.plan, prepared.suns)


def trace_tiles(prepared, weather, request, settings, folder, *, progress=silent, tell=print):
    """Transfer of a city, traced in tiles.

    Parameters
    ----------
    prepared : PreparedScene
        Of the whole, with its suns.
    weather : Weather
    request : Request
    settings : ClusterSettings
    folder : path-like
        Exists; tiles are kept there until all are done, and found again by a later run of the same
        city and settings.
    progress : callable, optional
    tell : callable, optional
        Takes lines for the user.

    Returns
    -------
    transfer : Transfer
    told : dict
        Tiles, what they took, and what their surroundings leave out.

    Raises
    ------
    InputError
        The cluster does not answer, or cannot trace a tile.
    """
    folder = Path(folder)
    scene = prepare_whole(prepared.scene)
    squares = assign_tiles(scene, settings.tile)
    places = np.array([[int(part) for part in name.split("_")] for name, _ in squares])
    empty = int(np.prod(places.max(axis=0) + 1)) - len(squares)
    passed = f"; {empty:,} squares without buildings are passed over" if empty else ""
    tell(f"{len(squares):,} tiles of {settings.tile:g} m{passed}")
    kept, found = set(), []
    with open_workers(settings.cluster) as workers:
        tell(workers.words)
        tasks = make_tasks(
            scene, squares, (prepared, weather, request, settings), folder, (kept, found)
        )
        progress(STAGE, 0, len(squares), STAGE)
        for done, _ in enumerate(workers.run(trace_part, tasks), start=1):
            progress(STAGE, len(kept) + done, len(squares), STAGE)
    if kept:
        tell(f"{len(kept):,} of them were traced by an earlier run")
    figures = [_told_of(path) for _, path in found]
    parts = ((tile.rows, read_transfer(path)) for tile, path in found)
    transfer = join_tiles(parts, prepared, request, figures, folder)
    return transfer, _describe_tiles([tile for tile, _ in found], figures, settings)


def _told_of(path):
    """Figures of a finished tile: dict. InputError where its files are not what its task has
    written.
    """
    told = read_told(path)
    if told is None:
        raise InputError(
            path,
            "is not what was written for this tile: somebody else has changed it, or the disk",
            "start again: it is traced again, all others are kept",
        )
    return told


def make_tasks(scene, squares, inputs, folder, lists):
    """Cut tiles, write their parts to disk, and yield the tasks that trace them: paths of Run, Part
    and result, and the number of threads.

    Parameters
    ----------
    scene : Scene
        Of `prepare_whole`.
    squares : list
        Of `assign_tiles`.
    inputs : tuple of PreparedScene, Weather, Request and ClusterSettings
    folder : Path
    lists : tuple of set and list
        Filled with the results that are there already, and with each Tile and its result.
    """
    # What all tiles share is written once: settings, suns, weather, horizon of the whole.
    prepared, weather, request, settings = inputs
    pieces, (kept, found) = box_pieces(scene), lists
    # the ground beyond is lit like the far ground that takes its place
    built = slice(0, len(scene.surfaces))
    city = pieces.low[built, :2].min(axis=0), pieces.high[built, :2].max(axis=0)
    plan = prepared.plan  # the tiles' own plans take the terrain from it
    terrain = TracePlan(
        [plan["terrain-horizon"]], terrain=plan.terrain, hidden_suns=plan.hidden_suns
    )
    shared = pickle.dumps(
        Run(_settle(prepared, request), prepared.suns, weather, city, terrain), protocol=5
    )
    run_path = write_task(folder, "run", shared)
    # Raised when results of earlier runs are no longer to be used.
    task_version = 6
    run_key = f"{__version__} {task_version}".encode() + shared
    threads = request.threads if settings.cluster == SERIAL else 1
    # The error of sun sampling is measured where most modules may be.
    eligible = np.where(scene.surfaces.eligible, scene.surfaces.area, 0.0)
    fullest = int(np.argmax([eligible[rows].sum() for _, rows in squares]))
    # A tile after the other: its part of the city, its materials, and which surfaces are its own.
    for index, (name, rows) in enumerate(squares):
        tile = surround(name, rows, pieces, scene.ground_reach)
        part, taken, complete = take_part(scene, pieces, tile)
        materials = [prepared.materials[row] for row in [*taken.tolist(), -1]]
        inner = tile.box[0][:2], tile.box[1][:2]
        own = np.searchsorted(taken, tile.rows)
        data = pickle.dumps(
            Part(part, own, materials, inner, complete, index == fullest), protocol=5
        )
        # A result is named by the hash of all that it depends on, so that one that exists can stay,
        # and its tile gives no task.
        key = hashlib.sha256(run_key + data).hexdigest()[:24]
        result = folder / f"{name}_{key}.nc"
        # Kept without `around`, which has a byte for each piece of the whole city.
        found.append((replace(tile, around=tile.around[:0]), result))
        if read_told(result) is not None:  # else it is traced again, over what is there
            kept.add(result)
            continue
        yield str(run_path), str(write_task(folder, name, data)), str(result), threads


def _settle(prepared, request):
    """The request with what is decided for the whole, so that every tile takes it over: Request.

    A tile alone would find a number of reflections of its own: where none is asked for, all take as
    many as the brightest albedo calls for.
    """
    plan, brightest = (
        prepared.plan,
        max(float(np.max(found.brdf.albedo)) for found in prepared.materials),
    )
    effects = {key: on for key, on in request.effects.items() if key != "terrain-horizon"}
    effects |= {
        key: plan[key].on for key in ("reflections", "far-ground", BEST_SKY, "trees", "specular")
    }
    bounces = count_surely(brightest) if plan.max_bounces is None else plan.max_bounces
    return replace(request, threads=None, horizon=None, max_bounces=bounces, effects=effects)


def _describe_tiles(tiles, figures, settings):
    """Tiles, what they took, and what their surroundings leave out, for the summary: dict."""
    area = np.array([figure["area"] for figure in figures])
    share = area / area.sum() if area.any() else np.full(len(area), 1 / len(area))
    peaks = [own["peak_memory_bytes"] for own in figures if own["peak_memory_bytes"]]
    return {
        "cluster": settings.cluster,
        "tile": settings.tile,
        "tiles": len(tiles),
        "near": max(tile.reach for tile in tiles),
        "farthest": max(tile.reach + tile.farthest for tile in tiles),
        "own_triangles": sum(figure["own_triangles"] for figure in figures),
        "triangles": sum(figure["triangles"] for figure in figures),
        "processor_seconds": sum(figure["processor_seconds"] for figure in figures),
        "peak_memory_bytes_of_a_worker": max(peaks, default=None),
        "left_out": {
            key: float(share @ [figure["halo"].get(key, 0.0) for figure in figures])
            for key in SHARES
        },
        "unit": "m, s, shares of the hemisphere",
    }
