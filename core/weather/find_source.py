"""The source of weather of a world, by its settings."""

from pathlib import Path

from ..settings.errors import InputError
from . import grid_sources
from .formats import recognise_weather
from .read_era5 import open_era5_grid
from .read_weather import read_weather
from .sources import parse_asked

MODELS = ("climate", "clear-sky")
# settings that mean nothing for grids
STATIONS_ONLY = (
    "time_shift",
    "weather_place",
    "weather_without",
)


def find_source(request, settings, stack):
    """Source of weather that the settings ask for; open files are closed with the stack."""
    # Models know every place: a regular grid of them.
    if request.weather in MODELS:
        # The clear sky is known on the sea too: the setting of what to take off land is refused.
        if request.weather != "climate":
            refuse_settings(settings, ("off_land",), request.weather)
        # The models' grid has steps of 3°.
        axes = grid_sources.regular_axes(
            settings.step or 3.0, settings.latitudes, settings.longitudes
        )
        return grid_sources.model_source(
            grid_sources.grid_places(*axes), request.weather, request, settings.off_land
        )
    # Files: a grid of ERA5 has its own points; some of them may be picked.
    paths = [
        Path(file)
        for file in (request.weather if isinstance(request.weather, list) else [request.weather])
    ]
    kinds = {recognise_weather(path).key for path in paths}
    # Settings for stations are refused with a grid, and a range without any of its points.
    if kinds == {"era5"}:
        refuse_settings(request, STATIONS_ONLY, "gridded weather")
        refuse_settings(settings, ("off_land",), "gridded weather")
        grid_sources.check_region(settings.latitudes, settings.longitudes)
        grid = open_era5_grid(paths, stack)
        picked = (
            grid_sources.thin_axis(grid.latitude, settings.step, settings.latitudes),
            grid_sources.thin_axis(grid.longitude, settings.step, settings.longitudes),
        )
        places = grid_sources.grid_places(grid.latitude[picked[0]], grid.longitude[picked[1]])
        if not len(places):
            raise InputError(
                grid.source, "has no point in these latitudes and longitudes", "give a wider range"
            )
        return grid_sources.grid_source(grid, places, picked, request, settings.years)
    # Stations are places by themselves; with a grid among them, or with settings of grids, they are
    # refused.
    if "era5" in kinds:
        raise InputError("--weather", "grids and stations are mixed", "give one or the other")
    refuse_settings(settings, ("step", "latitudes", "longitudes", "years", "off_land"), "stations")
    return _read_stations(paths, request)


def check_source(request, settings):
    """Refuse what means nothing for the weather of a world before anything is read.

    Raises
    ------
    InputError
    """
    if request.weather in MODELS:
        refuse_settings(request, STATIONS_ONLY, "this world")
        if settings.years:
            raise InputError(
                "--years", f"--weather {request.weather} has one typical year", "give --year Y"
            )
    if isinstance(request.weather, str) and parse_asked(request.weather):
        raise InputError(
            "--weather",
            f"{request.weather} is for single places",
            "give climate, clear-sky or files",
        )


def refuse_settings(settings, names, weather):
    """Refuse settings, of a Request or WorldSettings, that mean nothing for the weather."""
    for name in names:
        if getattr(settings, name) != getattr(type(settings)(), name):
            raise InputError(
                "--" + name.replace("_", "-"), f"means nothing for {weather}", "leave it out"
            )


def _read_stations(paths, request):
    """Stations from files; several files of one place are its years."""
    settings = {
        "time_shift": request.time_shift,
        "place": request.weather_place,
        "without": request.weather_without,
        "horizon_cut": request.horizon_cut,
    }
    place = request.weather_place or (0.0, 0.0)
    single = {path: read_weather(path, *place, **settings) for path in paths}
    stations = {}
    for path, weather in single.items():
        stations.setdefault((round(weather.latitude, 2), round(weather.longitude, 2)), []).append(
            path
        )
    weathers = [
        single[own[0]] if len(own) == 1 else read_weather(own, *place, **settings)
        for own in stations.values()
    ]
    names = [own[0].name.split(".gz")[0].rsplit(".", 1)[0] for own in stations.values()]
    return grid_sources.station_source(weathers, names)
