"""Keep traced light beside the .blend: written when the file is saved, found again when it is opened."""

import shutil
from pathlib import Path

import bpy

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .session import Session, find_session, list_cities, open_session

KEPT, HOME, PROBLEM = (PREFIX + name for name in ("transfer_file", "transfer_folder", "transfer_problem"))
SUFFIX = ".citypv.nc"


def keep_transfers(path):
    """Write the traced light of all cities beside a .blend that is about to be saved.

    Each object remembers its file, relative to the .blend. Light that is still in an earlier file only (of a .blend
    that was opened and is saved elsewhere) is copied.

    Parameters
    ----------
    path : str
        The .blend file.
    """
    for city in {item for scene in bpy.data.scenes for item in list_cities(scene)}:
        name = f"{Path(path).stem}.{bpy.path.clean_name(city.name)}{SUFFIX}"
        try:
            written = _keep(city, Path(path).with_name(name))
        except (InputError, OSError) as error:
            # The .blend itself is saved; the panel shows what is missing.
            city[PROBLEM] = f"The traced light could not be kept: {error}"
            continue
        if written:
            city[KEPT], city[HOME], city[PROBLEM] = "//" + name, str(Path(path).absolute().parent), ""


def find_kept(city):
    """File with the traced light of a city: Path, or None if none was kept. It may be missing by now.

    It is beside this .blend, or beside the one that the city was appended from.
    """
    if city is None or not city.get(KEPT):
        return None
    beside, home = Path(bpy.path.abspath(city[KEPT])), Path(city.get(HOME, ""), city[KEPT].removeprefix("//"))
    return home if not beside.is_file() and city.get(HOME) and home.is_file() else beside


def has_transfer(city):
    """Whether the light of a city is traced: in this session, or in a file that is there."""
    session, kept = find_session(city), find_kept(city)
    return (session is not None and session.transfer is not None) or (kept is not None and kept.is_file())


def describe_missing(city):
    """What the panel says of a city whose traced light was kept and is gone; "" for others."""
    if city is None or city.get(PROBLEM):
        return city[PROBLEM] if city is not None else ""
    kept = find_kept(city)
    if has_transfer(city) or (kept is None and not was_traced(city)):
        return ""
    if kept is None:
        return "A copy keeps its results, but has no traced light of its own: for others select the city itself, or \
import and trace again"
    return f"{kept.name} with the traced light is not beside this file: put it there, or import and trace again"


def was_traced(city):
    """Whether the faces of a city have results of a trace, whether or not its light is still there."""
    return PREFIX + "diffuse_relative" in city.data.attributes


def reopen_session(city):
    """Session of a city, a new one if the file was opened since: Session."""
    session = find_session(city)
    if session is None:
        session = Session()
        open_session(city, session)
    return session


def read_kept(session, path):
    """Bring the traced light of a file into a session that has none.

    Raises
    ------
    InputError
        The file is missing or damaged.
    """
    from ..core.results.read_transfer import read_transfer

    if session.transfer is None:
        session.transfer = read_transfer(path)


def _keep(city, target):
    from ..core.results.write_transfer import write_transfer

    session, kept = find_session(city), find_kept(city)
    if session is not None and session.transfer is not None:
        write_transfer(target, session.transfer)
        return True
    if kept is not None and kept.is_file():
        if kept.resolve() != target.resolve():
            shutil.copyfile(kept, target)
        return True
    return False
