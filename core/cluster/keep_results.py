"""Results of finished tasks, kept beside the output folder until all are done."""

import shutil
from contextlib import contextmanager
from pathlib import Path

from ..settings.errors import InputError


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
