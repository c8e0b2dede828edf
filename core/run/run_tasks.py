"""Run tasks: in this process one after the other, or by the workers of a Dask cluster.

Tasks read from disk, under names that tell the content, and write to disk, so that only names pass
through the scheduler. What is finished stays beside the output folder until all is done, so that
the same command goes on from it. A worker that ends in the middle of a task is replaced, and the
task given to another one. Dask loads this file in each local worker first, see `_dask_setup`.
"""

import hashlib
import importlib.util
import json
import logging
import pickle
import re
import signal
import socket
import sys
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from ..results.output_folder import name_beside, write_whole
from ..settings.errors import InputError, count_of
from ..settings.version import __version__

SERIAL = "serial"
HOW_TO_START = (
    "start `dask scheduler` there (port 8786), and `dask worker` on each machine, or give local:N"
)
PATIENCE = 10  # [s] for a cluster to answer
SILENT = f"does not answer as a Dask scheduler within {PATIENCE} s", HOW_TO_START
HASH_LENGTH = 24  # of the hash in the name of a task's file
# Names of tasks, of their results, and of those files that were not written to their end.
OWN = re.compile(r"(run|[\d_]+|[0-9a-f]{24})_([0-9a-f]{24}|\d{5})\.(task|nc|npz|json)(\.\d+)?")
DEATHS = 3  # of workers under one task, after which it is given up


@dataclass
class _Workers:
    """Who runs the tasks: `client` is None for this process."""

    client: Any
    words: str  # for the user

    def run(self, function, tasks):
        """Results of tasks in the order in which they end.

        Parameters
        ----------
        workers : Workers
        function : callable
            Of a module, so that it can be found by its name.
        tasks : iterable of tuple
            Arguments, made one after the other while the first tasks run.

        Yields
        ------
        object

        Raises
        ------
        InputError
            A task has ended several workers.
        """
        if self.client is None:
            for task in tasks:
                yield function(*task)
            return
        from distributed import KilledWorker, as_completed

        waiting = as_completed(loop=self.client.loop)
        for task in tasks:
            waiting.add(self.client.submit(run_plainly, function, *task, pure=False))
        for future in waiting:
            try:
                result = future.result()
            except KilledWorker as error:
                raise InputError(
                    "--cluster",
                    f"a task has ended {DEATHS + 1} workers, probably for lack of memory",
                    "give a smaller --tile or fewer workers",
                ) from error
            future.release()
            yield result


def check_cluster(word, *, most_workers=1024):
    """Refuse what names no cluster, one that does not answer, or any without Dask, before anything
    long begins.

    Parameters
    ----------
    word : str
        "serial", "local:N" with a number of workers, "tcp://HOST:PORT" or "tls://HOST:PORT".

    Returns
    -------
    (str, int or str)
        ("serial", 1), ("local", 2) with the number of workers, or ("address", "tcp://host:8786").

    Raises
    ------
    InputError
    """
    # Without a cluster there is nothing to check. The word must be known, with 1 to `most_workers`
    # workers, then Dask installed; a local cluster passes with these.
    if word == SERIAL:
        return SERIAL, 1
    local = re.fullmatch(r"local:(\d{1,9})", word)
    if local and not 1 <= int(local[1]) <= most_workers:
        raise InputError(
            "--cluster", f"{word!r} asks for {local[1]} workers", f"give 1 to {most_workers}"
        )
    address = re.fullmatch(r"(tcp|tls)://(\[[0-9a-fA-F:]+\]|[^\s/:]+):(\d{1,5})", word)
    if not (local or address):
        raise InputError(
            "--cluster", f"{word!r} is not known", f"give local:N, tcp://HOST:PORT or {SERIAL}"
        )
    if any(importlib.util.find_spec(name) is None for name in ("dask", "distributed")):
        raise InputError(f"--cluster {word}", "needs Dask", "type: pip install distributed")
    if local:
        return "local", int(local[1])
    # A scheduler must answer at its address within some seconds.
    protocol, host, port = address.groups()
    try:
        with socket.create_connection(
            (host.strip("[]"), int(port)), timeout=PATIENCE
        ) as connection:
            # A scheduler's first message, of some dozen bytes, begins with its length. Dask's
            # client would wait for ever for one that is silent, and goes on trying where another
            # protocol is spoken. Of TLS only the connection is tried.
            start = connection.makefile("rb").read(8) if protocol == "tcp" else bytes(8)
        # A scheduler's first message has less than a megabyte.
        if len(start) < 8 or int.from_bytes(start, sys.byteorder) > 1 << 20:
            raise ConnectionError("another protocol")
    except (OSError, OverflowError) as error:
        raise InputError(f"--cluster {word}", *SILENT) from error
    return "address", word


@contextmanager
def open_workers(word):
    """Workers by the word of `--cluster`, closed at the end of the block.

    Parameters
    ----------
    word : str

    Yields
    ------
    Workers

    Raises
    ------
    InputError
        The cluster does not answer, or its workers have another CityPV.
    """
    kind, value = check_cluster(word)
    # This process alone needs no cluster.
    if kind == SERIAL:
        yield _Workers(None, "This process")
        return
    import dask
    from distributed import (
        Client,
        LocalCluster,
    )  # brings its settings, to be here still when the block has ended

    # Workers that die are replaced a few times; their own messages stay silent.
    settings = {
        "distributed.scheduler.allowed-failures": DEATHS,
        "distributed.worker.multiprocessing-method": "spawn",
        "distributed.logging.distributed": "error",
    }
    with dask.config.set(settings), ExitStack() as stack:
        for logger in map(
            logging.getLogger, ("distributed", "distributed.nanny", "distributed.worker", "tornado")
        ):  # a worker that is replaced is told by our own lines
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL)
        page = ""
        # Processes on this machine, or a scheduler somewhere else.
        if kind == "local":  # processes of one thread, and a page at any free port
            own = {"dashboard_address": ":0", "silence_logs": logging.CRITICAL, "preload": __name__}
            cluster = LocalCluster(n_workers=value, threads_per_worker=1, processes=True, **own)
            client = Client(stack.enter_context(cluster), timeout=PATIENCE, set_as_default=False)
            stack.enter_context(client)
            # The page that shows the tasks needs bokeh, and is named only with it.
            if importlib.util.find_spec("bokeh") is not None:
                page = f"; dashboard at {client.dashboard_link}"
        else:
            client = _open_remote(value, stack)
        yield _Workers(client, f"{count_of(len(client.nthreads()), 'worker')}{page}")


def _open_remote(address, stack):
    """Client of a scheduler that runs already, closed with the stack; refused where it does not
    answer, has no workers, or has one with another CityPV.
    """
    from distributed import Client

    try:
        # a default one lingers if it fails
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, MemoryError, RuntimeError, TypeError) as error:
        # A port that is open on tls:// wants another key, or finds none here; else another protocol
        # is spoken.
        untrusted = (
            "does not accept this machine's key, or finds none",
            "see docs/guide/many_machines.md, Who may reach it",
        )
        raise InputError(
            f"--cluster {address}", *(untrusted if address.startswith("tls:") else SILENT)
        ) from error
    stack.enter_context(client)
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise InputError(f"--cluster {address}", "has no workers", HOW_TO_START) from error
    versions = client.run(metadata.version, "citypv", on_error="return")
    for worker, version in versions.items():
        if version != __version__:
            raise InputError(
                f"--cluster {address}",
                f"worker {worker} has "
                f"{f'CityPV {version}' if isinstance(version, str) else 'no CityPV'}",
                f"install CityPV {__version__} on it",
            )
    return client


def run_plainly(function, *arguments):
    """Run a task. An InputError goes on without its causes, which may be objects that cannot be
    pickled.
    """
    try:
        return function(*arguments)
    except InputError as error:
        plain = InputError(error.source, error.problem, error.cure)
    raise plain


def _dask_setup(worker):
    """Ignore interrupts in a worker: Ctrl-C is for the process that started it, which then ends its
    workers.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def write_task(folder, stem, data):
    """Write what a task reads, bytes of a pickle, to a file whose name ends with their hash:
    pathlib.Path.
    """
    path = folder / f"{stem}_{hashlib.sha256(data).hexdigest()[:HASH_LENGTH]}.task"
    write_whole(path, lambda file: file.write_bytes(data))
    return path


def read_task(path):
    """What `write_task` has written. A pickle runs code, so nothing else is opened.

    Raises
    ------
    InputError
        The content does not belong to the name.
    """
    data, name = Path(path).read_bytes(), Path(path).stem
    if hashlib.sha256(data).hexdigest()[:HASH_LENGTH] != name.rpartition("_")[2]:
        raise InputError(
            path,
            "is not what was written for this task: somebody else has changed it, or the disk",
            "see who can write to this folder, delete it, and start again",
        )
    return pickle.loads(data)


def finish_task(result, write, told):
    """Write the result of a task, and beside it what is told of it: the result is there where both
    fit each other.

    Parameters
    ----------
    result : pathlib.Path
        Named by the task: by what it reads.
    write : callable
        Takes the path of the file to write.
    told : dict
        Plain values.
    """
    write_whole(result, write)
    content = json.dumps({"task": result.stem, "content": _hash_file(result), "told": told})
    signed = f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}"
    write_whole(result.with_suffix(".json"), lambda file: file.write_text(signed, encoding="utf-8"))


def read_told(result):
    """What `finish_task` was told of a result: dict. None unless both files are what it wrote for
    this very task.
    """
    try:
        signature, _, content = (
            result.with_suffix(".json").read_text(encoding="utf-8").partition("\n")
        )
        if hashlib.sha256(content.encode()).hexdigest() != signature:
            return None
        record = json.loads(content)
        fits = record["task"] == result.stem and record["content"] == _hash_file(result)
    except (OSError, ValueError):
        return None
    return record["told"] if fits else None


def _hash_file(path):
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def kept_beside(folder):
    """Folder in which finished tasks are kept for an output folder: Path."""
    return name_beside(Path(folder).resolve(), "", ".tasks")


def drop_kept(folder, cluster=True):
    """Remove what was kept for an output folder, if it was written in tasks."""
    if cluster:
        _drop_own(kept_beside(folder))


def _drop_own(folder):
    """Remove the files of tasks from a folder, and the folder if it holds nothing else."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if OWN.fullmatch(path.name):
            path.unlink(missing_ok=True)
    with suppress(OSError):  # files of others are in it
        folder.rmdir()


@contextmanager
def keeping(folder, tell):
    """Make a folder for finished tasks; if the block ends with an error, say where they are, or
    remove an empty one.

    Raises
    ------
    InputError
        The folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            folder, f"cannot be made ({error.strerror})", "choose another --out"
        ) from error
    try:
        yield
    except BaseException:
        count = sum(
            path.suffix == ".json" and OWN.fullmatch(path.name) is not None
            for path in folder.iterdir()
        )
        if count:
            tell(
                f"\n{count:,} finished tasks are kept in {folder}: the same command goes on from "
                "there"
            )
        else:
            _drop_own(folder)
        raise
