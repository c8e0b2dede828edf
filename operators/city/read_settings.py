"""Read the panel's settings into a Request."""

import os
import sys
from ast import literal_eval

import bpy

from ...core.errors import InputError
from ..attributes import PREFIX
from ..edits.watch_edits import is_edited
from ..in_place import is_in_place
from ..job import threads_beside_window
from .declare_settings import ELECTRIC, OF_LIGHT, name_switch, read_properties, read_switches, settings_of_panel


def read_settings(settings):
    """Read the panel's settings.

    Parameters
    ----------
    settings : bpy.types.PropertyGroup
        `scene.citypv`.

    Returns
    -------
    core.request.Request
    """
    from ...core.request import Request

    return Request(
        **read_properties(settings),
        lod=None if settings.lod == "BEST" else settings.lod,
        **read_own_place(settings),
        grid_size=settings.grid_size if settings.split else None,
        ground="auto" if settings.ground == "terrain" else settings.ground,
        terrain=read_terrain_path(settings) if settings.ground == "terrain" else None,
        weather=read_weather_source(settings),
        suns=read_suns(settings),
        horizon=bpy.path.abspath(settings.horizon) or None,
        weather_place=read_weather_place(settings) if settings.weather == "file" else None,
        albedo_file=read_albedo_path(settings) if settings.albedo_source == "file" else None,
        threads=read_threads(settings, find_preferences()) or threads_beside_window(not bpy.app.background),
        effects=read_switches(settings),
    )


def read_own_place(settings):
    """Latitude and longitude that the user gave, as settings of a Request; none where the files are to say it."""
    if not settings.own_place:
        return {}
    if settings.latitude == settings.longitude == 0:
        raise InputError("Own location", "0° N, 0° E lies in the sea", "give latitude and longitude in step Classify")
    return {"latitude": settings.latitude, "longitude": settings.longitude}


def read_city_path(settings):
    """Path of the city's file or folder; relative ones (//) start at the .blend file."""
    if not settings.city_path:
        raise InputError("City", "no file is chosen", "choose a file or folder with buildings")
    return bpy.path.abspath(settings.city_path)


def read_terrain_path(settings):
    """Path of the terrain's file; relative ones (//) start at the .blend file."""
    if not settings.terrain:
        raise InputError("Terrain", "no file is chosen", "choose a terrain file, or another type of ground")
    return bpy.path.abspath(settings.terrain)


def read_albedo_path(settings):
    """Path of the albedo's file; relative ones (//) start at the .blend file."""
    if not settings.albedo_file:
        raise InputError("Albedo", "no file is chosen", "choose an albedo file, or another source of albedo")
    return bpy.path.abspath(settings.albedo_file)


def read_weather_source(settings):
    """`climate`, `pvgis`, `clear-sky`, or the path of the weather file."""
    if settings.weather == "pvgis" and not bpy.app.online_access:
        raise InputError("Weather", "Blender may not use the network", "allow online access in Preferences > System")
    if settings.weather != "file":
        return settings.weather
    if not settings.weather_file:
        raise InputError("Weather", "no file is chosen", "choose a weather file, or the climate")
    return bpy.path.abspath(settings.weather_file)


def read_weather_place(settings):
    """Latitude and longitude [°] where the weather was measured: (2,) tuple, or None if its file says it."""
    words = settings.weather_place.replace(",", " ").split()
    if not words:
        return None
    try:
        latitude, longitude = map(float, words)
    except ValueError:
        problem = f"{settings.weather_place!r} is not a latitude and a longitude"
        raise InputError("Measured at", problem, "give two numbers in degrees, such as 52.38 13.06") from None
    return latitude, longitude


def read_suns(settings):
    """Choice of suns in the notation of the command line: `days:24`."""
    if settings.suns == "hourly":
        return "hourly"
    count = {"days": settings.days, "typical-days": settings.typical_days, "sky-grid": settings.sky_grid}
    return f"{settings.suns}:{count[settings.suns]}"


ADDON = __package__.rpartition(".operators")[0]  # its name in Blender
WEATHER = ("weather", "weather_file")


def find_preferences():
    """Preferences of the add-on: bpy.types.AddonPreferences, or None where it was not enabled as an add-on."""
    addon = bpy.context.preferences.addons.get(ADDON)
    return addon.preferences if addon is not None else None


def read_threads(settings, preferences):
    """Number of threads of the scene, else of the preferences: int, or None for all processors."""
    return settings.threads or (preferences.threads if preferences is not None else 0) or None


def choose_weather(settings, preferences):
    """Let a scene in which no weather was chosen yet begin with the preferred one."""
    if preferences is None or settings.is_property_set("weather"):
        return
    for name in WEATHER:
        setattr(settings, name, getattr(preferences, name))


def use_cache_folder(preferences):
    """Keep the compiled loops in the preferred folder. Has an effect before the first of them is called."""
    folder = bpy.path.abspath(preferences.cache_folder) if preferences is not None else ""
    if folder and "numba" not in sys.modules:
        os.environ["NUMBA_CACHE_DIR"] = folder


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
