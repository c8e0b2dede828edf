"""Session data of a city: objects of core that are not saved in a .blend file."""

import uuid
from dataclasses import dataclass, replace
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...core.settings.errors import InputError
from ...core.settings.progress import silent
from .keys import Key
from .preferences import folder_of_answers
from .source_objects import is_seen

_sessions = {}  # key -> (session, session_uid of the object)


@dataclass
class Session:
    """Results of the steps; None for steps that were not run."""

    city: Any = None  # core.city.city.City
    # City of the files, with what was edited in its own mesh; None for a city of meshes
    imported: Any = None
    scene: Any = None  # core.city.scene.Scene
    weather: Any = None  # core.weather.weather.Weather
    transfer: Any = None  # core.light.transfer.Transfer
    energy: Any = None  # core.energy.energy.Energy
    request: Any = None  # core.settings.request.Request that the energy was computed with
    base: Any = None  # core.light.editable_city.EditableCity, for edits of the city
    # City that `base` was traced of, where it is another one: while an estimate is shown
    base_city: Any = None
    cached: Any = None  # of an edit: what was found, to be shown again without tracing
    # of an edit: design of the city and settings of the energy that it was found for
    design_key: Any = None
    change: Any = None  # of an edit: (EditableCity before, errors of the change [h] by surface_id)
    timeline: Any = None  # (Energy, core.energy.timeline.Timeline made of it)
    ground_material: str = ""  # name of the material that the user assigned to the generated ground

    def open(self, item):
        """Associate a session with an object, by a key that survives renaming and undo; copies of
        the object have none.
        """
        item[Key.SESSION] = uuid.uuid4().hex
        _sessions[item[Key.SESSION]] = self, item.session_uid
        there = {one.session_uid for one in bpy.data.objects}
        gone = [key for key, (_, owner) in _sessions.items() if owner not in there]
        # Twelve sessions of cities that are gone are kept, for undo.
        for key in gone[:-12]:
            del _sessions[key]

    def find_city(self, scene):
        """Find the city and its ground that a session belongs to.

        Raises
        ------
        InputError
            They are gone: the user deleted or replaced them while a step ran.
        """
        for city in list_cities(scene):
            if Session.of(city) is self:
                return city, city.get(Key.GROUND)
        raise InputError(
            "City",
            "it was deleted or replaced while the step ran",
            "select the city and run the step again",
        )

    @staticmethod
    def find_cached(design_key):
        """Session of an edit that was traced before, which undo or redo comes back to, or None."""
        return next(
            (
                one
                for one, _ in reversed(_sessions.values())
                if one.cached is not None and one.design_key == design_key
            ),
            None,
        )

    @staticmethod
    def of(item):
        """Return the session of an object, or None if there is none (as after opening a file)."""
        session, owner = (
            _sessions.get(item.get(Key.SESSION), (None, None)) if item is not None else (None, None)
        )
        return session if owner is not None and owner == item.session_uid else None

    @staticmethod
    def can_update(item):
        """Whether a city has light that can be edited, so that only the edit has to be traced."""
        return getattr(Session.of(item), "base", None) is not None

    @staticmethod
    def is_from_file(item):
        """Whether the .blend was opened since the city was read: its buildings are known from its
        files again.
        """
        return getattr(Session.of(item), "city", None) is None

    def take_energy(self, weighed):
        """Keep in a session, in Blender's thread, what a copy of it has of `with_energy`."""
        if weighed is not self:
            for name in ("transfer", "weather", "energy", "request"):
                setattr(self, name, getattr(weighed, name))

    def weigh(self, path, request, progress=silent, *, weather=None):
        """Light of a session, read from its file where that was opened since, and its weather and
        energy.

        The weather is read unless it is given.

        Returns
        -------
        transfer : core.light.transfer.Transfer
        weather : core.weather.weather.Weather
        energy : core.energy.energy.Energy

        Raises
        ------
        InputError
            The file with the light is missing or damaged, or the weather cannot be read.
        """
        from ...core.city.grid_cells import Outlines
        from ...core.city.racks import drawn_city
        from ...core.results.transfer_file import read_transfer
        from ...core.run import study

        study.check_settings(request)
        transfer = read_transfer(path) if self.transfer is None else self.transfer
        # Modules lie on the shapes of the surfaces, cells and racks among them.
        if transfer.outlines is None and self.city is not None and self.scene is not None:
            scene = self.scene
            city = drawn_city(self.city, scene, request.grid_size)
            outlines = Outlines.of(city, scene.surfaces, scene.site)
            transfer = replace(transfer, outlines=outlines)
        progress("reading weather", 0, 1, "years")
        if weather is None:
            weather = study.read_year(transfer.site, request, transfer.suns, (folder_of_answers(),))
        return transfer, weather, study.compute_energy(transfer, weather, request, progress)

    def with_energy(self, path, request, progress=silent):
        """A session as it is if it has its energy, else a copy that has it, as of `weigh`;
        `take_energy` keeps it.
        """
        if self.energy is not None:
            return self
        transfer, weather, energy = self.weigh(path, request, progress)
        return replace(self, transfer=transfer, weather=weather, energy=energy, request=request)


@persistent
def close_sessions(*_):
    """Discard all sessions: when the add-on is disabled, or another file opened, which may have the
    same keys.
    """
    _sessions.clear()


def find_city(scene):
    """Find the city that the panel works on, and its ground.

    Parameters
    ----------
    scene : bpy.types.Scene

    Returns
    -------
    city, ground : bpy.types.Object or None
        The selected city first, else the first that is to be seen, else the scene's first; its own
        ground beside it.
    """
    cities = list_cities(scene)
    chosen = (
        [item for item in cities if item.select_get()]
        or [item for item in cities if is_seen(item)]
        or cities
    )
    return (chosen[0], chosen[0].get(Key.GROUND)) if chosen else (None, None)


def list_cities(scene):
    """All cities of a Blender scene: list of bpy.types.Object."""
    return [item for item in scene.objects if item.get(Key.PART) == "city"]
