"""Files of tasks: what they read, under a name that tells its content, and what is kept beside the output folder.

What is finished stays there until all is done, so that the same command goes on from it.
"""

import hashlib
import pickle
import shutil
from contextlib import contextmanager
from pathlib import Path

from ..settings.errors import InputError

HASH_LENGTH = 24  # of the hash in the name of a task's file


def write_task(folder, stem, data):
    """Write what a task reads, bytes of a pickle, to a file whose name ends with their hash: pathlib.Path."""
    path = folder / f"{stem}_{hashlib.sha256(data).hexdigest()[:HASH_LENGTH]}.task"
    path.write_bytes(data)
    return path


def read_task(path):
    """What `write_task` has written. A pickle runs code, so nothing else is opened.

    Raises
    ------
    InputError
        The content is not that of the name.
    """
    data, name = Path(path).read_bytes(), Path(path).stem
    if hashlib.sha256(data).hexdigest()[:HASH_LENGTH] != name.rpartition("_")[2]:
        problem = "is not what was written for this task: somebody else has changed it, or the disk"
        raise InputError(path, problem, "see who can write to this folder, delete it, and start again")
    return pickle.loads(data)


def kept_beside(folder):
    """Folder in which finished tasks are kept for an output folder: Path."""
    folder = Path(folder).absolute()
    return folder.with_name(f"{folder.name}.tasks")


def drop_kept(folder, cluster=True):
    """Remove what was kept for an output folder, if it was written in tasks."""
    if cluster:
        shutil.rmtree(kept_beside(folder), ignore_errors=True)


@contextmanager
def keeping(folder, tell):
    """Make a folder for finished tasks; if the block ends with an error, say where they are, or remove an empty one.

    Raises
    ------
    InputError
        The folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot be made ({error.strerror})", "choose another --out") from error
    try:
        yield
    except BaseException:
        count = len(list(folder.glob("*.json")))
        if count:
            tell(f"\n{count:,} finished tasks are kept in {folder}: the same command goes on from there")
        else:
            shutil.rmtree(folder, ignore_errors=True)
        raise
