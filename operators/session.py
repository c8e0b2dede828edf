"""Session data of a city: objects of core that are not saved in a .blend file."""

import uuid
from dataclasses import dataclass
from typing import Any

from ..core.errors import InputError
from .attributes import PREFIX

KEY = PREFIX + "session"
_sessions = {}


@dataclass
class Session:
    """Results of the steps; None for steps that were not run."""

    city: Any = None  # core.city.city.City
    scene: Any = None  # core.scene.scene.Scene
    weather: Any = None  # core.weather.weather.Weather
    transfer: Any = None  # core.transfer.transfer.Transfer
    energy: Any = None  # core.energy.energy.Energy
    ground_material: str = ""  # name of the material that the user assigned to the generated ground


def open_session(item, session):
    """Associate a session with an object, by a key that survives renaming and undo."""
    item[KEY] = uuid.uuid4().hex
    _sessions[item[KEY]] = session


def find_session(item):
    """Return the session of an object, or None if there is none (as after opening a file)."""
    return _sessions.get(item.get(KEY)) if item is not None else None


def close_sessions():
    """Discard all sessions (when the add-on is disabled)."""
    _sessions.clear()


def find_city(scene):
    """Find the city and its ground in a Blender scene.

    Parameters
    ----------
    scene : bpy.types.Scene

    Returns
    -------
    city, ground : bpy.types.Object or None
        The active view layer's selected city first, else the scene's first; its own ground beside it.
    """
    cities = [item for item in scene.objects if item.get(PREFIX + "part") == "city"]
    if not cities:
        return None, None
    chosen = [item for item in cities if item.select_get()]
    city = (chosen or cities)[0]
    return city, city.get(PREFIX + "ground")


def find_own_city(scene, session):
    """Find the city and its ground that a session belongs to.

    Raises
    ------
    InputError
        They are gone: the user deleted or replaced them while a step ran.
    """
    city, ground = find_city(scene)
    if session is None or find_session(city) is not session:
        raise InputError(
            "City", "it was deleted or replaced while the step ran", "select the city and run the step again"
        )
    return city, ground
