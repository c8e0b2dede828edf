"""Write results to a folder atomically: completely or not at all. Of what is there, only own files
are replaced.
"""

import ctypes
import errno
import json
import os
import shutil
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from ..settings.errors import InputError
from .exports import MODELS

NAMES = (
    "faces.csv",
    "groups.csv",
    "buildings.csv",
    "uses.csv",
    "districts.csv",
    "districts.geojson",
    "series.csv",
    "timeseries.nc",
    "surfaces.nc",
    "transfer.nc",
    "rays.nc",
)
NAMES += (
    "surfaces.csv",
    "change.csv",
    "before.csv",
    "world.nc",
    "world_map.png",
    "world_gain.png",
    "world_months.png",
    "world_day.png",
)
ASKED = "asked_weather"  # folder of answers of services
NAMES += (
    ASKED,
    *(model.file for model in MODELS.values()),
    "city.blend",
    "preview.png",
    "report.html",
    "summary.json",
)
SITE_NAMES = ("tiles", "buildings", "page", "index.html")  # of a solar map
SITE_FILES = "page/files.txt"  # of a solar map: all its files
LOCK, OLD = ".lock", "old"  # in the temporary folder: its lock, and the results before


def _check_folder(folder, overwrite, names=NAMES):
    """Raise an error if results cannot be written to a folder.

    Raises
    ------
    InputError
        If it is a file, a link to nothing, not writable, or not empty and `overwrite` is False; or
        if something of these names is there that CityPV has not written.
    """
    folder, cure = Path(folder), "choose another --out"
    try:
        if folder.is_symlink() and not folder.exists():
            raise InputError(folder, f"is a link to {folder.readlink()}, which is not there", cure)
        if folder.exists() and not folder.is_dir():
            raise InputError(folder, "is a file", "give a folder for the results")
        there = sorted(entry.name for entry in folder.iterdir()) if folder.is_dir() else []
        parent = next(place for place in (folder, *folder.absolute().parents) if place.is_dir())
    except OSError as error:
        raise InputError(folder, f"cannot be used ({error.strerror})", cure) from error
    if there and not overwrite:
        raise InputError(folder, "is not empty", f"{cure}, or add --overwrite")
    foreign = sorted(set(there) & set(names) - _own_names(folder))
    if foreign:
        raise InputError(
            folder,
            f"holds {', '.join(foreign)} without the results of a run of CityPV",
            f"move it away, or {cure}",
        )
    if not os.access(parent, os.W_OK):
        raise InputError(folder, "cannot be written", cure)


def _own_names(folder):
    """Names of what CityPV has written to a folder, by the file that each of its results and maps
    holds: set of str.
    """
    own = set(SITE_NAMES) if (folder / "page" / "map.json").is_file() else set()
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return own
    told = isinstance(summary, dict) and ("versions" in summary or "light_differs_in" in summary)
    return own | set(NAMES) if told else own


def name_beside(folder, begin, end):
    """Path beside a folder with its name between two words, cut where file systems could not take
    it: pathlib.Path.
    """
    name = folder.name
    while len(os.fsencode(f"{begin}{name}{end}")) > 255:  # bytes
        name = name[:-1]
    return folder.with_name(f"{begin}{name}{end}")


@contextmanager
def whole_folder(folder, overwrite=False, names=NAMES):
    """Temporary folder, whose content replaces the output folder's when the block ends without an
    error.

    It lies in one beside the output folder, which is locked, so that a second run into the same
    folder is refused. One left behind by a killed run is not locked and is reused. Results of an
    earlier run in the output folder are replaced or removed, other files stay. Whoever ends the
    process at any time leaves the earlier results or the new ones, each whole; where the system
    cannot exchange two folders, or this process works in the output folder, the summary is removed
    first and written last.

    Yields
    ------
    pathlib.Path

    Raises
    ------
    InputError
        The folder cannot be used, or another run is writing to it.
    """
    _check_folder(folder, overwrite, names)
    folder = Path(folder).resolve()
    place = name_beside(folder, ".", ".unfinished")
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            folder, f"cannot be made ({error.strerror})", "choose another --out"
        ) from error
    with _lock_folder(place, folder):
        try:
            work = place / "new"  # the results that are written
            work.mkdir()
            yield work
            _check_folder(folder, overwrite, names)  # hours may have passed
            _move_results(work, folder, names)
        finally:
            _empty(place)
            shutil.rmtree(place, ignore_errors=True)
    if sys.platform == "win32":  # which deletes no file that is open
        shutil.rmtree(place, ignore_errors=True)


@contextmanager
def _lock_folder(place, folder):
    """Hold a lock on the temporary folder while the block lasts; it is empty when the block begins.

    Raises
    ------
    InputError
        Another process has it, or it holds something else.
    """
    # A folder with something in it but no lock is none of ours, and is refused.
    busy = InputError(
        folder, "another run is writing to it", "wait for it to end, or choose another --out"
    )
    left = {entry.name for entry in place.iterdir()}
    if left and LOCK not in left:
        raise InputError(
            place,
            "holds something else than an unfinished run",
            "move it away, or choose another --out",
        )
    # The lock of the operating system goes with the process, however that ends.
    with (place / LOCK).open("a") as file:
        # Nobody waits for the lock: a folder that another run holds is refused at once.
        try:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise busy from error
        if not (place / LOCK).exists():  # whoever had it has just finished
            raise busy
        # Results that a run had set aside, when it was ended between two renamings, are put back if
        # the folder of results is missing. All else in the temporary folder is deleted.
        if (place / OLD).exists() and not folder.exists():
            (place / OLD).rename(folder)
        _empty(place)
        yield


def _empty(place):
    """Delete all in the temporary folder but the lock, by which the next run knows it: that goes
    last.
    """
    for entry in place.iterdir():
        if entry.name != LOCK:
            shutil.rmtree(entry, ignore_errors=True) if entry.is_dir() else entry.unlink()


def _move_results(work, folder, names=NAMES):
    """Replace the results in the output folder by those in the temporary folder."""
    unknown = sorted({file.name for file in work.iterdir()} - set(names))
    if unknown:
        raise ValueError(f"{', '.join(unknown)}: not among the names of results")
    if not folder.exists():
        work.rename(folder)
        return
    own = _own_names(folder)
    if os.path.ismount(folder) or Path.cwd().is_relative_to(folder):
        _replace_results(work, folder, own)
        return
    # The new results with all that is not ours, which is the same files under further names.
    for path in _foreign(folder, own):
        _link(folder / path, work / path)
    shutil.copymode(folder, work)
    if not _exchange(work, folder):
        folder.rename(work.with_name(OLD))
        work.rename(folder)


def _foreign(folder, own):
    """What in a folder is not CityPV's: yields relative paths, of files in a solar map's folders or
    of all else.
    """
    for entry in folder.iterdir():
        if entry.name not in own:
            yield entry.name
    if "page" in own and (folder / SITE_FILES).is_file():
        listed = set((folder / SITE_FILES).read_text(encoding="utf-8").splitlines())
        for name in SITE_NAMES[:-1]:
            inside = (folder / name).iterdir() if (folder / name).is_dir() else ()
            paths = [f"{name}/{entry.name}" for entry in inside]
            yield from (path for path in paths if path not in listed)


def _replace_results(work, folder, own):
    """Replace results one by one; the summary is removed first and written last."""
    written = {file.name for file in work.iterdir()}
    for name in [*reversed(NAMES), *SITE_NAMES]:
        path = folder / name
        if (
            name in own
            and path.exists()
            and (name == NAMES[-1] or path.is_dir() or name not in written)
        ):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    for name in (*SITE_NAMES, *NAMES):
        if name in written:
            (work / name).replace(folder / name)


def _link(source, target):
    """Give a file, or all in a folder, a further name; where the system cannot, copy it."""
    target.parent.mkdir(exist_ok=True)
    if source.is_dir() and not source.is_symlink():
        target.mkdir()
        for entry in source.iterdir():
            _link(entry, target / entry.name)
        shutil.copystat(source, target)
        return
    try:
        os.link(source, target, follow_symlinks=False)
    except (OSError, NotImplementedError):
        shutil.copy2(source, target, follow_symlinks=False)


def _exchange(one, other):
    """Exchange the names of two folders in one step, as Linux and macOS can: whether it
    was done.
    """
    # RENAME_EXCHANGE, RENAME_SWAP; AT_FDCWD
    paths, swap, here = (
        (os.fsencode(one), os.fsencode(other)),
        2,
        -100,
    )
    try:
        if sys.platform == "linux":
            return ctypes.CDLL(None).renameat2(here, paths[0], here, paths[1], swap) == 0
        if sys.platform == "darwin":
            return ctypes.CDLL(None).renamex_np(*paths, swap) == 0
    except (OSError, AttributeError):  # an old library
        return False
    return False


def write_whole(path, write):
    """Write a file completely or not at all, and through to the disk.

    Raises
    ------
    OSError
        With the name of the file.
    """
    unfinished = path.with_name(f"{path.name}.{time.monotonic_ns()}")
    try:
        write(unfinished)
        with unfinished.open("rb+") as file:
            os.fsync(file.fileno())
        unfinished.replace(path)
    except OSError as error:
        raise OSError(
            error.errno or errno.EIO,
            f"cannot be written ({error.strerror or error}): is the disk full?",
            str(path),
        ) from error
    finally:
        unfinished.unlink(missing_ok=True)


def copy_results(source, folder, overwrite=False):
    """Copy what a run wrote to another folder.

    Raises
    ------
    InputError
        The folder is not empty and `overwrite` is False, or cannot be written.
    """
    with whole_folder(folder, overwrite) as work:
        for name in NAMES:
            if (Path(source) / name).exists():
                shutil.copy2(Path(source) / name, work / name)
