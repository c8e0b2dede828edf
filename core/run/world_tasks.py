"""A world in tasks: bands of places times environments, computed by the workers of a cluster.

    bands of places × environments ─► compute_band (a worker) ─► band.npz, on disk ─► World

A task opens the weather itself. Every place, hour and surface is computed as without tasks, so that
the world is the same bit by bit.
"""

import hashlib
import io
import pickle
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..energy.pv_system import build_system
from ..settings.version import __version__
from ..weather.find_source import find_source
from ..world.compute_world import compute_world, empty_world
from .run_tasks import (
    SERIAL,
    finish_task,
    keeping,
    open_workers,
    read_task,
    read_told,
    write_task,
)

STAGE = "world"
# fields of World
OF_GROUPS = (
    "full_load_hours",
    "standard_error",
    "gain_error",
    "without_reflections",
)


def compute_in_tasks(environments, source, request, settings, cluster, *, folder, log):
    """World of some environments, computed in tasks.

    Parameters
    ----------
    environments : list of Environment
    source : Source
        Of `find_source` with the same request and settings.
    request : Request
        With the model of the sky that the environments were built for.
    settings : WorldSettings
    cluster : ClusterSettings
    folder : Path
        Where finished tasks are kept until all are done.
    log : RunLog

    Returns
    -------
    World
    """
    world = empty_world(environments, source, settings.way, request.sky)
    # Bands are runs of chunks of about 256 places, by how many lie before each.
    band_of = np.cumsum([0, *map(len, source.chunks)])[:-1] // 256
    bands = [np.flatnonzero(band_of == one).tolist() for one in np.unique(band_of)]
    with keeping(folder, log.write), open_workers(cluster.cluster) as workers:
        tasks = _list_tasks(environments, bands, request, settings, folder)
        log.write(f"  {len(tasks):,} tasks; {workers.words}")
        threads = request.threads if cluster.cluster == SERIAL else 1
        missing = [(*task, threads) for _, task in tasks if read_told(Path(task[-1])) is None]
        before = len(tasks) - len(missing)  # finished by an earlier run
        log.progress(STAGE, 0, len(tasks), "tasks")
        for done, _ in enumerate(workers.run(_compute_band, missing), start=before + 1):
            log.progress(STAGE, done, len(tasks), "tasks")
        for number, (*_, result) in tasks:
            with np.load(result) as stored:
                places, own = stored["places"][:, None], world.columns_of(number)
                world.weather[places[:, 0]] = stored["weather"]
                world.years = float(stored["years"]) if stored["weather"].any() else world.years
                for name in OF_GROUPS:
                    getattr(world, name)[places, number, own] = stored[name][:, 0]
    return world


def _list_tasks(environments, bands, request, settings, folder):
    """Write what tasks read: list of an environment's number, and `path`, `band` and `result` of
    `_compute_band`.
    """
    request = replace(request, weather=_absolute_weather(request.weather), threads=None)
    stamps, tasks = stamp_files(request.weather), []
    for number, environment in enumerate(environments):
        data = pickle.dumps((environment, request, replace(settings, mix=None)), protocol=5)
        key = hashlib.sha256(__version__.encode() + stamps + data).hexdigest()[:24]
        path = write_task(folder, key, data)
        tasks += [
            (number, (str(path), band, str(folder / f"{key}_{k:05d}.npz")))
            for k, band in enumerate(bands)
        ]
    return tasks


def _absolute_weather(weather):
    """Weather with absolute paths, for a worker that runs in another folder."""
    if isinstance(weather, list):
        return [_absolute_weather(one) for one in weather]
    return str(Path(weather).absolute()) if Path(weather).exists() else weather


def stamp_files(weather):
    """Size and time of change of weather files, so that results with other contents are not taken
    for theirs: bytes.
    """
    paths = [Path(source) for source in (weather if isinstance(weather, list) else [weather])]
    files = [
        file for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])
    ]
    changed = [
        (str(file.absolute()), file.stat().st_size, file.stat().st_mtime_ns)
        for file in files
        if file.exists()
    ]
    return repr(changed).encode()


def _compute_band(path, band, result, threads):
    """Compute some chunks of a source's places for one environment, and write them to disk.

    Parameters
    ----------
    path : str
        Environment, Request and WorldSettings, of `write_task`.
    band : list of int
        Numbers of the chunks.
    result : str
        File to write.
    threads : int or None
    """
    environment, request, settings = read_task(path)
    with ExitStack() as stack:
        source = find_source(request, settings, stack)
        places = np.concatenate([source.chunks[one] for one in band])
        ends = np.cumsum([len(source.chunks[one]) for one in band])
        chunks = np.split(np.arange(len(places)), ends[:-1])
        part = replace(
            source, places=places, chunks=chunks, read=lambda chunk: source.read(places[chunk])
        )
        chosen = {"way": settings.way, "sky": request.sky, "threads": threads}
        world = compute_world([environment], part, build_system(request), **chosen)

    arrays = {name: getattr(world, name) for name in OF_GROUPS}
    np.savez(
        stored := io.BytesIO(), places=places, weather=world.weather, years=world.years, **arrays
    )
    finish_task(
        Path(result), lambda file: file.write_bytes(stored.getvalue()), {"places": len(places)}
    )
    return result
