"""Keep traced light beside the .blend: written when the file is saved, found again when it is
opened.
"""

import shutil
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ...core.settings.errors import InputError
from .edit_marks import check_unedited
from .keys import Key
from .read_settings import read_settings, state_of_step
from .session import Session, find_city, list_cities


@persistent
def keep_transfers(path, *_):
    """Write the traced light of all cities beside a .blend that is about to be saved.

    Each object remembers its file, relative to the .blend. Light that is still in an earlier file
    only (of a .blend that was opened and is saved elsewhere) is copied.

    Parameters
    ----------
    path : str
        The .blend file; "" where none is written.
    """
    from ...core.results.transfer_file import write_transfer

    for city in {item for scene in bpy.data.scenes if path for item in list_cities(scene)}:
        name = f"{Path(path).stem}.{bpy.path.clean_name(city.name)}.citypv.nc"
        target, session, kept = Path(path).with_name(name), Session.of(city), find_kept(city)
        try:
            if session is not None and session.transfer is not None:
                write_transfer(target, session.transfer)
            elif kept is None or not kept.is_file():
                continue
            elif kept.resolve() != target.resolve():
                shutil.copyfile(kept, target)
            city[Key.TRANSFER_FILE], city[Key.TRANSFER_FOLDER], city[Key.TRANSFER_PROBLEM] = (
                "//" + name,
                str(Path(path).absolute().parent),
                "",
            )
        except (InputError, OSError) as error:
            # The .blend itself is saved; the panel shows what is missing.
            city[Key.TRANSFER_PROBLEM] = f"The traced light could not be kept: {error}"


def find_kept(city):
    """File with the traced light of a city: Path, or None if none was kept. It may be missing by
    now.

    It is beside this .blend, or beside the one that the city was appended from.
    """
    if city is None or not city.get(Key.TRANSFER_FILE):
        return None
    beside, home = (
        Path(bpy.path.abspath(city[Key.TRANSFER_FILE])),
        Path(city.get(Key.TRANSFER_FOLDER, ""), city[Key.TRANSFER_FILE].removeprefix("//")),
    )
    return (
        home
        if not beside.is_file() and city.get(Key.TRANSFER_FOLDER) and home.is_file()
        else beside
    )


def _has_transfer(city):
    """Whether the light of a city is traced: in this session, or in a file that is there."""
    session, kept = Session.of(city), find_kept(city)
    return (session is not None and session.transfer is not None) or (
        kept is not None and kept.is_file()
    )


def describe_missing(city):
    """What the panel says of a city whose traced light was kept and is gone; "" for others."""
    if not city or city.get(Key.TRANSFER_PROBLEM):
        return city.get(Key.TRANSFER_PROBLEM, "") if city else ""
    kept = find_kept(city)
    if _has_transfer(city) or (kept is None and Key.DIFFUSE_RELATIVE not in city.data.attributes):
        return ""
    if kept is None:
        return (
            "A copy keeps its results, but has no traced light of its own: for others select the city itself, or \
import and trace again"
        )
    return (
        f"{kept.name} with the traced light is not beside this file: put it there, or import and "
        "trace again"
    )


class OfTransfer:
    """Base of operators that need a city with traced light."""

    @classmethod
    def poll(cls, context):
        """The city has been traced, in this session or before the file was saved."""
        city, _ = find_city(context.scene)
        cls.poll_message_set(describe_missing(city) or "Trace the light first")
        return city is not None and _has_transfer(city)

    def prepare(self, context):
        """Take the session, a new one if the file was opened since, the file with the transfer, and
        the settings.
        """
        city, _ = find_city(context.scene)
        check_unedited(city)
        if Session.of(city) is None:
            Session().open(city)
        return Session.of(city), find_kept(city), read_settings(context.scene.citypv)


class OfEnergy(OfTransfer):
    """Base of operators that need a city with its energy, of this session or of before the file was
    saved.
    """

    @classmethod
    def poll(cls, context):
        """The energy is known, or can be computed again with the settings that it had."""
        city, settings = find_city(context.scene)[0], context.scene.citypv
        cls.poll_message_set(describe_missing(city) or "Compute the energy first")
        if getattr(Session.of(city), "energy", None) is not None:
            return True
        return (
            city is not None
            and _has_transfer(city)
            and state_of_step(city, "energy", settings) == "done"
        )
