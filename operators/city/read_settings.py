"""Read the settings of panel and preferences into a Request, and remember with which of them a step
was run.

A step is done, stale because a setting was changed since, or still to do.
"""

from ast import literal_eval

import bpy

from ...core.settings.errors import InputError
from ...core.settings.request import Request
from ...core.weather.sources import ASKED_BY_KEY
from .declare_settings import ELECTRIC, OF_LIGHT, name_switch, read_properties, settings_of_panel
from .edit_marks import describe_edit
from .job import threads_beside_window
from .keys import Key
from .preferences import find_preferences, note_folder
from .source_objects import is_in_place

STEPS = {  # step -> settings of the panel that it depends on; files keep their values in this order
    "import": ("city_path", "lod", *settings_of_panel("import")),
    "classify": (
        *("own_place", "latitude", "longitude", "ground", "terrain", "split", "grid_size"),
        *settings_of_panel("classify"),
    ),
    "trace": (
        *("suns", "days", "typical_days", "sky_grid", "albedo_source", "albedo_file", "horizon"),
        *settings_of_panel("trace"),
        *settings_of_panel("sampling"),
        *map(name_switch, OF_LIGHT),
    ),
    "energy": (
        *("weather", "weather_file", "weather_years", "weather_place", "weather_point", "year"),
        *settings_of_panel("weather"),
        *settings_of_panel("energy"),
        *map(name_switch, ELECTRIC),
        "leave_out",
    ),
}


def read_settings(settings):
    """Read the panel's settings, `scene.citypv`: core.settings.request.Request; answers of services
    will be kept beside the .blend file, or in Blender's temporary folder without one.
    """
    # Settings of the panel in the words of a Request: threads, suns, place.
    note_folder()
    preferred = getattr(find_preferences(), "threads", 0)
    number = getattr(settings, settings.suns.replace("-", "_"), None)  # of days or directions
    place = (
        {"latitude": settings.latitude, "longitude": settings.longitude}
        if settings.own_place
        else {}
    )
    # 0° N, 0° E means that nobody gave a place: it is refused.
    if settings.own_place and settings.latitude == settings.longitude == 0:
        raise InputError(
            "Own location",
            "0° N, 0° E lies in the sea",
            "give latitude and longitude in step Classify",
        )
    # Files take the place of choices where these ask for one.
    ground, terrain, weather, albedo_file = settings.ground, None, settings.weather, None
    if ground == "terrain":
        ground, terrain = (
            "auto",
            _read_path(settings, "terrain", "Terrain", "a terrain file, or another type of ground"),
        )
    # A weather service is asked for the years that are given.
    if weather in ASKED_BY_KEY and settings.weather_years.strip():
        weather = f"{weather}:{settings.weather_years.strip()}"
    # Services are asked only if Blender may use the network.
    online = {"Weather": settings.weather in ASKED_BY_KEY, "Horizon": settings.horizon == "pvgis"}
    for title in [title for title, asks in online.items() if asks and not bpy.app.online_access]:
        raise InputError(
            title, "Blender may not use the network", "allow online access in Preferences > System"
        )
    if weather == "file":
        weather = _read_path(settings, "weather_file", "Weather", "a weather file, or the climate")
    if settings.albedo_source == "file":
        albedo_file = _read_path(
            settings, "albedo_file", "Albedo", "an albedo file, or another source of albedo"
        )
    # The other settings are taken over by their names; the number of threads is the scene's, else
    # the preferences', else what leaves the window responsive.
    return Request(
        **read_properties(settings),
        lod=None if settings.lod == "BEST" else settings.lod,
        **place,
        grid_size=settings.grid_size if settings.split else None,
        ground=ground,
        terrain=terrain,
        weather=weather,
        suns=settings.suns if number is None else f"{settings.suns}:{number}",
        horizon=bpy.path.abspath(settings.horizon) or None,
        weather_place=_read_weather_place(settings) if settings.weather == "file" else None,
        albedo_file=albedo_file,
        leave_out=bpy.path.abspath(settings.leave_out) or None,
        threads=settings.threads or preferred or threads_beside_window(not bpy.app.background),
    )


def _read_path(settings, name, title, cure):
    """Path of a file that the user chose; relative ones (//) start at the .blend file.

    Parameters
    ----------
    settings : bpy.types.PropertyGroup
    name : str
        Of the setting.
    title, cure : str
        What the file is of, and what to choose; for the error where none is chosen.

    Raises
    ------
    InputError
    """
    if not getattr(settings, name):
        raise InputError(title, "no file is chosen", f"choose {cure}")
    return bpy.path.abspath(getattr(settings, name))


def _read_weather_place(settings):
    """Latitude and longitude [°] where the weather was measured: (2,) tuple, or None if its file
    says it.
    """
    words = settings.weather_place.replace(",", " ").split()
    try:
        latitude, longitude = map(float, words) if words else (None, None)
    except ValueError:
        raise InputError(
            "Measured at",
            f"{settings.weather_place!r} is not a latitude and a longitude",
            "give two numbers in degrees, such as 52.38 13.06",
        ) from None
    return (latitude, longitude) if words else None


def remember_step(city, step, settings):
    """Store on a city which settings a step was run with; those after it are to be done.

    Parameters
    ----------
    city : bpy.types.Object
    step : str
        Of `STEPS`.
    settings : bpy.types.PropertyGroup
    """
    order = list(STEPS)
    for later in order[order.index(step) + 1 :]:
        city.pop(Key.ASKED + later, None)
    city[Key.ASKED + step] = _describe_settings(step, settings)


def remember_choice(city, settings, name):
    """Store a setting of the energy that acts at once, so that the step is done if it was
    before.
    """
    if Key.ASKED + "energy" in city:
        kept = literal_eval(city[Key.ASKED + "energy"])
        kept[STEPS["energy"].index(name)] = getattr(settings, name)
        city[Key.ASKED + "energy"] = repr(kept)


def state_of_step(city, step, settings):
    """ "done", "stale" or "next" for the first step that has to be run; "" for those after it.

    A step is stale too if one before it is.
    """
    city = city or {}
    for name in STEPS:
        kept = city.get(Key.ASKED + name)
        state = "stale" if kept else "next"
        # A city of the user's own meshes depends on them, not on the settings of a file.
        same = kept == _describe_settings(name, settings) or (
            name == "import" and kept and is_in_place(city)
        )
        if same and not (name == "import" and describe_edit(city)[0]):
            state = "done"
        if name == step:
            return state
        if state != "done":
            return "stale" if city.get(Key.ASKED + step) else ""
    raise InputError(step, "is no step", f"give {', '.join(STEPS)}")


def _describe_settings(step, settings):
    """Settings of a step as text."""
    return repr([getattr(settings, name) for name in STEPS[step]])
