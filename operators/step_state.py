"""State of the steps: done, stale because a setting was changed since, or still to do."""

from ast import literal_eval

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .build_properties import settings_of_panel
from .effect_switches import ELECTRIC, OF_LIGHT, name_switch
from .in_place import is_in_place
from .watch_edits import is_edited

STEPS = {  # step -> settings of the panel that are not declared by core
    "import": ("city_path", "lod"),
    "classify": ("own_place", "latitude", "longitude", "ground", "terrain", "split", "grid_size"),
    "trace": ("suns", "days", "typical_days", "sky_grid", "albedo_source", "albedo_file", "horizon"),
    "energy": ("weather", "weather_file", "weather_place", "weather_point", "year"),
}
PANELS = {
    "import": ("import",),
    "classify": ("classify",),
    "trace": ("trace", "sampling"),
    "energy": ("weather", "energy"),
}


def remember_step(city, step, settings, *earlier):
    """Store on a city which settings a step was run with.

    Parameters
    ----------
    city : bpy.types.Object
    step : str
        Of `STEPS`.
    settings : bpy.types.PropertyGroup
    *earlier : bpy.types.Object
        A city that this one replaces: the steps before stay as they were.
    """
    for before in earlier:
        for name in list(STEPS)[: list(STEPS).index(step)]:
            if before.get(_key(name)):
                city[_key(name)] = before[_key(name)]
    for name in list(STEPS)[list(STEPS).index(step) + 1 :]:
        city.pop(_key(name), None)
    city[_key(step)] = describe_settings(step, settings)


def asked_path(city):
    """What the panel had under *City* when a city was imported: a path, or "" if that is not known."""
    kept = city.get(_key("import"))
    return literal_eval(kept)[STEPS["import"].index("city_path")] if kept else ""


def forget_step(city, step):
    """Take a step for not done, as with other settings than those of the panel."""
    city.pop(_key(step), None)


def state_of_step(city, step, settings):
    """ "done", "stale" or "next" for the first step that has to be run; "" for those after it.

    A step is stale too if one before it is.
    """
    for name in STEPS:
        kept = city.get(_key(name)) if city is not None else None
        state = "stale" if kept else "next"
        # A city of the user's own meshes depends on them, not on the settings of a file.
        same = kept == describe_settings(name, settings) or (name == "import" and kept and is_in_place(city))
        if same and not (name == "import" and is_edited(city)):
            state = "done"
        if name == step:
            return state
        if state != "done":
            return "stale" if city is not None and city.get(_key(step)) else ""
    raise InputError(step, "is no step", f"give {', '.join(STEPS)}")


def describe_settings(step, settings):
    """Settings of a step as text."""
    names = [*STEPS[step], *(name for panel in PANELS[step] for name in settings_of_panel(panel))]
    if step in ("trace", "energy"):
        names += [name_switch(key) for key in (OF_LIGHT if step == "trace" else ELECTRIC)]
    return repr([getattr(settings, name) for name in names])


def _key(step):
    return f"{PREFIX}asked_{step}"
