"""A folder of results that is whole or not there at all."""

import os
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError

NAMES = (
    "faces.csv",
    "groups.csv",
    "timeseries.nc",
    "transfer.nc",
    "city.city.json",
    "city.glb",
    "city.blend",
    "preview.png",
    "summary.json",
)


def check_folder(folder, overwrite):
    """Refuse a folder that results may not go to.

    Raises
    ------
    InputError
        If it is a file, or holds something and `overwrite` is False.
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
def whole_folder(folder):
    """A temporary folder beside the wanted one, which takes its place when the block ends without an error.

    Results of an earlier run in the wanted folder are replaced or taken away, other files stay. The summary goes first
    and comes last: where it stands, everything beside it belongs together.

    Yields
    ------
    pathlib.Path
    """
    folder = Path(folder).absolute()
    made = [place for place in folder.parents if not place.exists()]
    folder.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix=f".{folder.name}.unfinished-", dir=folder.parent))
    try:
        yield work
        work.chmod(0o755)
        if not folder.exists():
            work.rename(folder)
            return
        unknown = sorted({file.name for file in work.iterdir()} - set(NAMES))
        if unknown:
            raise ValueError(f"{', '.join(unknown)}: not among the names of results")
        (folder / NAMES[-1]).unlink(missing_ok=True)
        for name in NAMES:
            if (work / name).exists():
                (work / name).replace(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
        work.rmdir()
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        for place in made:
            place.rmdir()
        raise
