"""Read the panel's settings into a Request."""

import bpy

from ..core.settings.errors import InputError
from .build_properties import read_properties
from .effect_switches import read_switches
from .give_way import threads_beside_window
from .read_preferences import find_preferences, read_threads


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
    from ..core.settings.request import Request

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
