"""Read the panel's settings into a Request."""

import bpy

from ..core.errors import InputError
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
    from ..core.request import Request

    return Request(
        **read_properties(settings),
        lod=None if settings.lod == "BEST" else settings.lod,
        latitude=settings.latitude if settings.own_place else None,
        longitude=settings.longitude if settings.own_place else None,
        grid_size=settings.grid_size if settings.split else None,
        ground="auto" if settings.ground == "terrain" else settings.ground,
        terrain=read_terrain_path(settings) if settings.ground == "terrain" else None,
        weather=read_weather_source(settings),
        suns=read_suns(settings),
        albedo_file=read_albedo_path(settings) if settings.albedo_source == "file" else None,
        threads=read_threads(settings, find_preferences()) or threads_beside_window(not bpy.app.background),
        effects=read_switches(settings),
    )


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


def read_suns(settings):
    """Choice of suns in the notation of the command line: `days:24`."""
    if settings.suns == "hourly":
        return "hourly"
    count = {"days": settings.days, "typical-days": settings.typical_days, "sky-grid": settings.sky_grid}
    return f"{settings.suns}:{count[settings.suns]}"
