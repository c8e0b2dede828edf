"""Trace a city tile by tile. Read this first.

    Scene ─► cut_tiles ─► take_part ─► part.pickle ─► trace_part (a worker) ─► tile.nc ─► join_tiles ─► Transfer
             who reports   triangles    on disk        thins the surroundings,
             and what is   and surfaces                reads and writes files
             around it

What is decided from the whole is the same in each tile: suns, number of reflections, effects, materials, terrain. All
triangles keep the random numbers that they have in the whole, so that a tile's result depends neither on who traces it
nor on how the rest is cut; it differs from that of the whole by what its surroundings leave out, see `bound_halo`.
"""

import hashlib
import json
import pickle
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..effects.beyond_scene import terrain_alone
from ..results.read_transfer import read_transfer
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import option_of
from ..settings.version import __version__
from .bound_halo import SHARES
from .join_tiles import join_records, join_tiles
from .run_tasks import SERIAL, check_cluster, open_workers, run_tasks
from .take_part import prepare_whole, take_part
from .tiles import DEFAULT, assign_tiles, bin_pieces, box_pieces, check_tile_size, surround
from .trace_part import Part, Run, trace_part

MEASURED = 8  # tiles in which the error of sun sampling is measured
TASK_VERSION = 3  # raised when results of earlier runs are no longer to be used
KEY_LENGTH = 24
SETTLED = ("reflections", "far-ground", "perez", "trees", "specular")  # effects that every tile takes over as decided
ONE_MACHINE = ("target_error", "time_budget")
STAGE = "tiles"


@dataclass
class ClusterSettings:
    """How a city is cut, and who traces the tiles."""

    cluster: str  # word of `--cluster`
    tile: float = DEFAULT  # [m]
    dashboard: str | None = ":0"  # address of the page of a local cluster


def check_cluster_settings(settings, request):
    """Refuse settings of tiles that mean nothing.

    Raises
    ------
    InputError
    """
    if settings is None:
        return
    check_tile_size(settings.tile)
    check_cluster(settings.cluster)
    for name in ONE_MACHINE:
        if getattr(request, name) is not None:
            raise InputError(option_of(name), "is for runs without tiles", "leave it out, or leave out --cluster")
    if request.estimator != "gather":
        raise InputError("--estimator forward", "traces whole cities only", "use gather, or leave out --cluster")


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
        Exists; tiles are kept there until all are done, and found again by a later run of the same city and settings.
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
    tell(describe_squares(squares, settings.tile))
    kept, found = set(), []
    with open_workers(settings.cluster, settings.dashboard) as workers:
        tell(workers.words)
        tasks = make_tasks(scene, squares, (prepared, weather, request, settings), folder, (kept, found))
        progress(STAGE, 0, len(squares), STAGE)
        for done, _ in enumerate(run_tasks(workers, trace_part, tasks), start=1):
            progress(STAGE, len(kept) + done, len(squares), STAGE)
    if kept:
        tell(f"{len(kept):,} of them were traced by an earlier run")
    return gather_tiles(found, prepared, request, settings, folder)


def describe_squares(squares, size):
    """How many tiles there are, and how many squares between them hold nothing, as a line of text."""
    places = np.array([[int(part) for part in name.split("_")] for name, _ in squares])
    empty = int(np.prod(places.max(axis=0) + 1)) - len(squares)
    passed = f"; {empty:,} squares without buildings are passed over" if empty else ""
    return f"{len(squares):,} tiles of {size:g} m{passed}"


def make_tasks(scene, squares, inputs, folder, lists):
    """Cut tiles, write their parts to disk, and yield the tasks that trace them.

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
    prepared, weather, request, settings = inputs
    pieces, (kept, found) = box_pieces(scene), lists
    bins = bin_pieces(pieces, settings.tile)
    built = slice(0, len(scene.surfaces))  # the ground beyond is lit like the far ground that takes its place
    city = pieces.low[built, :2].min(axis=0), pieces.high[built, :2].max(axis=0)
    run_path, run_key = write_run(
        folder, Run(settle(prepared.plan, request), prepared.suns, weather, city, terrain_alone(prepared.plan))
    )
    threads = request.threads if settings.cluster == SERIAL else 1
    measured = set(np.linspace(0, len(squares) - 1, min(MEASURED, len(squares))).round().astype(int).tolist())
    for index, (name, rows) in enumerate(squares):
        tile = surround(name, rows, pieces, bins, request.ground_albedo)
        part = part_of_tile(scene, pieces, tile, prepared.materials, measure=index in measured)
        data = pickle.dumps(part, protocol=5)
        key = hashlib.sha256(run_key + data).hexdigest()[:KEY_LENGTH]
        result = folder / f"{name}_{key}.nc"
        found.append((forget_around(tile), result))
        if result.with_suffix(".json").exists():
            kept.add(result)
            continue
        path = folder / f"{name}_{key}.part"
        path.write_bytes(data)
        yield str(run_path), str(path), str(result), threads


def forget_around(tile):
    """A tile without what lies around it, which takes a byte for each piece of the whole city."""
    return replace(tile, around=tile.around[:0])


def write_run(folder, run):
    """Write what all tiles share; its path, and the bytes by which results are recognised."""
    data = pickle.dumps(run, protocol=5)
    path = folder / f"run_{hashlib.sha256(data).hexdigest()[:KEY_LENGTH]}.pickle"
    path.write_bytes(data)
    return path, f"{__version__} {TASK_VERSION}".encode() + data


def settle(plan, request):
    """The request with the decisions of the plan for the whole, so that every tile takes them over: Request."""
    effects = {key: on for key, on in request.effects.items() if key != "terrain-horizon"}
    effects |= {key: plan[key].on for key in SETTLED}
    return replace(request, threads=None, horizon=None, max_bounces=plan.max_bounces, effects=effects)


def part_of_tile(scene, pieces, tile, materials, *, measure):
    """What a worker needs for a tile: Part."""
    part, rows, moved, complete = take_part(scene, pieces, tile, materials)
    own = np.searchsorted(rows, tile.rows)
    found = [materials[row] for row in rows.tolist()] + materials[-1:]
    inner = tile.box[0][:2], tile.box[1][:2]
    return Part(part, own, found, moved, inner, complete, measure)


def gather_tiles(found, prepared, request, settings, folder):
    """Transfer of all tiles, and what they took.

    Parameters
    ----------
    found : list of (Tile, Path)
    prepared, request, settings, folder
        As of `trace_tiles`.

    Returns
    -------
    Transfer
    dict
    """
    figures = [json.loads(path.with_suffix(".json").read_text(encoding="utf-8")) for _, path in found]
    records = []

    def read_parts():
        for tile, path in found:
            transfer = read_transfer(path)
            records.append(transfer.record)
            yield tile.rows, transfer

    transfer = join_tiles(read_parts(), prepared, request, folder)
    transfer = replace(transfer, record=join_records(records, prepared.plan, request, figures))
    return transfer, describe_tiles([tile for tile, _ in found], figures, settings)


def describe_tiles(tiles, figures, settings):
    """Tiles, what they took, and what their surroundings leave out, for the summary: dict."""
    area = np.array([sum(one["areas"].values()) for one in figures])
    share = area / area.sum() if area.any() else np.full(len(area), 1 / len(area))
    halo = {key: [one["halo"].get(key, 0.0) for one in figures] for key in SHARES}
    peaks = [one["peak_memory_bytes"] for one in figures if one["peak_memory_bytes"]]
    return {
        "cluster": settings.cluster,
        "tile": settings.tile,
        "tiles": len(tiles),
        "near": max(tile.reach for tile in tiles),
        "farthest": max(tile.reach + tile.farthest for tile in tiles),
        "own_triangles": sum(one["own_triangles"] for one in figures),
        "triangles": sum(one["triangles"] for one in figures),
        "processor_seconds": sum(one["processor_seconds"] for one in figures),
        "peak_memory_bytes_of_a_worker": max(peaks, default=None),
        "left_out": {key: float(share @ np.array(values)) for key, values in halo.items()},
        "unit": "m, s, shares of the hemisphere",
    }
