"""A world in tasks: bands of places times environments, computed by the workers of a cluster.

    bands of places × environments ─► compute_band (a worker) ─► band.npz, on disk ─► World

A task opens the weather itself. Every place, hour and surface is computed as without tasks, so that the world is the
same bit by bit.
"""

import hashlib
import io
import json
import pickle
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..cluster.run_tasks import SERIAL, keeping, open_workers, read_task, run_tasks, write_task
from ..energy.pv_system import build_system
from ..results.output_folder import write_whole
from ..settings.version import __version__
from ..world.compute_world import compute_world, empty_world, find_groups
from .find_source import find_source

PLACES = 256  # of a band, about
STAGE = "world"
OF_GROUPS = ("full_load_hours", "standard_error", "gain_error", "without_reflections")  # fields of World


class WorldInputs(NamedTuple):
    """What all tasks of a world have in common."""

    request: object  # Request
    settings: object  # WorldSettings
    sky: str


def compute_in_tasks(environments, source, inputs, cluster, *, folder, log):
    """World of some environments, computed in tasks.

    Parameters
    ----------
    environments : list of Environment
    source : Source
        Of `find_source` with the same request and settings.
    inputs : WorldInputs
    cluster : ClusterSettings
    folder : Path
        Where finished tasks are kept until all are done.
    log : RunLog

    Returns
    -------
    World
    """
    world, bands = empty_world(environments, source, inputs.settings.way, inputs.sky), cut_bands(source.chunks)
    with keeping(folder, log.write), open_workers(cluster.cluster) as workers:
        log.write(f"  {len(bands) * len(environments):,} tasks; {workers.words}")
        threads = inputs.request.threads if cluster.cluster == SERIAL else 1
        results = {}
        tasks = list(list_tasks(environments, bands, inputs, folder, results=results, threads=threads))
        log.progress(STAGE, 0, len(results), "tasks")
        for done, _ in enumerate(run_tasks(workers, compute_band, tasks), start=1):
            log.progress(STAGE, len(results) - len(tasks) + done, len(results), "tasks")
        for path, number in results.items():
            read_band(world, number, path)
    return world


def cut_bands(chunks):
    """Runs of chunks of about PLACES places, by how many lie before each: list of list of int."""
    band = np.cumsum([0, *map(len, chunks)])[:-1] // PLACES
    return [np.flatnonzero(band == one).tolist() for one in np.unique(band)]


def list_tasks(environments, bands, inputs, folder, *, results, threads):
    """Write what tasks read, and yield those that no earlier run has finished.

    `results` is filled with the file of each task: its environment's number.
    """
    request, settings, sky = inputs
    common = replace(request, weather=absolute_weather(request.weather), threads=None), replace(settings, mix=None), sky
    stamps = stamp_files(request.weather)
    for number, environment in enumerate(environments):
        data = pickle.dumps((environment, *common), protocol=5)
        key = hashlib.sha256(__version__.encode() + stamps + data).hexdigest()[:24]
        path = write_task(folder, key, data)
        for first, band in enumerate(bands):
            result = folder / f"{key}_{first:05d}.npz"
            results[result] = number
            if not result.with_suffix(".json").exists():
                yield str(path), band, str(result), threads


def absolute_weather(weather):
    """The same files for a worker that runs in another folder."""
    if isinstance(weather, list):
        return [absolute_weather(one) for one in weather]
    return str(Path(weather).absolute()) if Path(weather).exists() else weather


def stamp_files(weather):
    """Size and time of change of weather files, so that results with other contents are not taken for theirs: bytes."""
    found = [Path(one) for one in (weather if isinstance(weather, list) else [weather])]
    files = [file for path in found for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    changed = [(str(file.absolute()), file.stat().st_size, file.stat().st_mtime_ns) for file in files if file.exists()]
    return repr(changed).encode()


def compute_band(path, band, result, threads):
    """Compute some chunks of a source's places for one environment, and write them to disk.

    Parameters
    ----------
    path : str
        Environment, Request, WorldSettings and sky, of `write_task`.
    band : list of int
        Numbers of the chunks.
    result : str
        File to write.
    threads : int or None
    """
    environment, request, settings, sky = read_task(path)
    with ExitStack() as stack:
        source = find_source(request, settings, stack)
        places = np.concatenate([source.chunks[one] for one in band])
        ends = np.cumsum([len(source.chunks[one]) for one in band])
        chunks = np.split(np.arange(len(places)), ends[:-1])
        part = replace(source, places=places, chunks=chunks, read=lambda chunk: source.read(places[chunk]))
        chosen = {"way": settings.way, "sky": sky, "threads": threads}
        world = compute_world([environment], part, build_system(request), **chosen)

    arrays = {name: getattr(world, name) for name in OF_GROUPS}
    np.savez(stored := io.BytesIO(), places=places, weather=world.weather, years=world.years, **arrays)
    write_whole(Path(result), lambda file: file.write_bytes(stored.getvalue()))
    count = json.dumps({"places": len(places)})
    write_whole(Path(result).with_suffix(".json"), lambda file: file.write_text(count, encoding="utf-8"))
    return result


def read_band(world, number, path):
    """Write the results of a task, for the environment of some number, into the world."""
    with np.load(path) as stored:
        places, own = stored["places"][:, None], find_groups(world, number)
        world.weather[places[:, 0]] = stored["weather"]
        world.years = float(stored["years"]) if stored["weather"].any() else world.years
        for name in OF_GROUPS:
            getattr(world, name)[places, number, own] = stored[name][:, 0]
