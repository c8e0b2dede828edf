"""Write results to a folder atomically: completely or not at all."""

import os
import shutil
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from ..settings.errors import InputError

NAMES = (
    "faces.csv",
    "groups.csv",
    "buildings.csv",
    "series.csv",
    "timeseries.nc",
    "surfaces.nc",
    "transfer.nc",
    "rays.nc",
)
NAMES += (
    "surfaces.csv",
    "change.csv",
    "world.nc",
    "world_map.png",
    "world_gain.png",
    "world_months.png",
    "world_day.png",
)
NAMES += ("tiles", "buildings", "page", "index.html")
NAMES += ("city.city.json", "city.glb", "city.gpkg", "city.blend", "preview.png", "report.html", "summary.json")
LOCK = ".lock"


def check_folder(folder, overwrite):
    """Raise an error if results cannot be written to a folder.

    Raises
    ------
    InputError
        If it is a file, not writable, or not empty and `overwrite` is False.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "is a file", "give a folder for the results")
    if folder.is_dir() and any(folder.iterdir()) and not overwrite:
        raise InputError(folder, "is not empty", "choose another --out, or add --overwrite")
    parent = next(place for place in (folder, *folder.absolute().parents) if place.is_dir())
    if not os.access(parent, os.W_OK):
        raise InputError(folder, "cannot be written", "choose another --out")


@contextmanager
def whole_folder(folder, overwrite=False):
    """Temporary folder beside the output folder, which replaces it when the block ends without an error.

    The temporary folder is locked, so that a second run into the same folder is refused. One left behind by a killed
    run is not locked and is reused. Results of an earlier run in the output folder are replaced or removed, other files
    stay. The summary is removed first and written last: if it exists, all results beside it belong to the same run.

    Yields
    ------
    pathlib.Path

    Raises
    ------
    InputError
        The folder cannot be used, or another run is writing to it.
    """
    check_folder(folder, overwrite)
    folder = Path(folder).absolute()
    work = folder.parent / f".{folder.name}.unfinished"
    try:
        work.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot be made ({error.strerror})", "choose another --out") from error
    with lock_folder(work, folder):
        try:
            yield work
            check_folder(folder, overwrite)  # hours may have passed
            (work / LOCK).unlink()
            move_results(work, folder)
        except BaseException:
            shutil.rmtree(work, ignore_errors=True)
            raise


@contextmanager
def lock_folder(work, folder):
    """Lock the temporary folder for this process, and empty it.

    Raises
    ------
    InputError
        Another process has it.
    """
    busy = InputError(folder, "another run is writing to it", "wait for it to end, or choose another --out")
    with (work / LOCK).open("a") as file:
        try:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise busy from error
        if not (work / LOCK).exists():  # whoever had it has just finished
            raise busy
        for entry in work.iterdir():
            if entry.name != LOCK:
                shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        yield


def move_results(work, folder):
    """Replace the results in the output folder by those in the temporary folder."""
    unknown = sorted({file.name for file in work.iterdir()} - set(NAMES))
    if unknown:
        raise ValueError(f"{', '.join(unknown)}: not among the names of results")
    if not folder.exists():
        work.rename(folder)
        return
    (folder / NAMES[-1]).unlink(missing_ok=True)
    for name in NAMES:
        if (work / name).exists():
            if (folder / name).is_dir():
                shutil.rmtree(folder / name)
            (work / name).replace(folder / name)
        elif not (folder / name).is_dir():
            (folder / name).unlink(missing_ok=True)
    work.rmdir()


def write_whole(path, write):
    """Write a file completely or not at all."""
    unfinished = path.with_name(f"{path.name}.{time.monotonic_ns()}")
    try:
        write(unfinished)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
