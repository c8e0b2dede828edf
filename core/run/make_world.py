"""`citypv world`: full load hours of traced environments at every place of a weather grid."""

import importlib.util
from contextlib import ExitStack
from dataclasses import dataclass, replace

from ..energy.pv_system import build_system
from ..results.output_folder import whole_folder
from ..results.write_summary import peak_memory, versions, write_summary
from ..settings.errors import InputError
from ..settings.presets import METHODS, NOT_FOR_WORLDS
from ..settings.progress import describe_duration
from ..weather.find_source import check_source, find_source, refuse_settings
from ..world.compute_world import compute_world
from ..world.environment import read_environments
from ..world.group_errors import add_mix, parse_mix
from ..world.write_world import write_world
from . import run_tasks
from .run_log import RunLog
from .study import check_settings
from .world_tasks import compute_in_tasks


@dataclass
class WorldSettings:
    """Settings of a world, beside the ones in `Request`."""

    way: str | None = None  # exact or paper; None: as the method
    mix: str | None = None
    step: float | None = None  # [°] between places; None: 3° of the models, every point of files
    latitudes: tuple | None = None  # first and last [°]
    longitudes: tuple | None = None
    years: tuple = ()  # of the weather files; empty: all
    surfaces: int | None = None  # at most for each environment, others merged; None: all
    off_land: str = "blank"  # or climate, clear-sky: at sea
    pictures: bool = True


def make_world(texts, folder, request, settings, *, overwrite=False, log=None, cluster=None):
    """Compute a world and write world.nc, summary.json and pictures.

    Parameters
    ----------
    texts : list of str
        Environments, as of `read_environments`.
    folder : path-like
        Written completely or not at all.
    request : Request
    settings : WorldSettings
    overwrite : bool
        Replace results in a folder that is not empty.
    log : RunLog, optional
    cluster : ClusterSettings, optional
        Compute in tasks.

    Raises
    ------
    InputError
        Before anything is written.
    """
    log = log or RunLog(None)
    # Settings are checked and filled in; modules alone count, without losses.
    check_settings(request)
    settings = replace(settings, years=tuple(sorted(set(settings.years))))
    _check_world_settings(request, settings)
    settings = replace(
        settings, way=settings.way or ("paper" if request.method == "paper" else "exact")
    )
    request = modules_alone(request)
    if cluster:
        # A cluster that does not answer is refused before anything is read.
        run_tasks.check_cluster(cluster.cluster)
    system = build_system(request)
    # Environments: traced cities and open planes, merged into fewer surfaces where asked for.
    with whole_folder(folder, overwrite) as work, ExitStack() as stack:
        environments, sky = read_environments(texts, system, request.sky, settings.surfaces)
        names = [environment.name for environment in environments]
        # Shares of environments, where a mix of them is asked for as one more.
        weights = None if settings.mix is None else parse_mix(settings.mix, names)
        log.clock.lap("read environments")
        # Weather of each place on Earth, from a grid, a model or files.
        source = find_source(request, settings, stack)
        log.write(f"Modules: DC without losses, {request.mounting}")
        log.write("\n".join(_describe_world(environments, source, sky)))
        log.clock.lap("open weather")
        # Capacity factors of each environment at each place, here or in tasks of a cluster.
        if cluster:
            asked, told = (
                replace(request, sky=sky),
                {"folder": run_tasks.kept_beside(folder), "log": log},
            )
            world = compute_in_tasks(environments, source, asked, settings, cluster, **told)
        else:
            told = {"sky": sky, "threads": request.threads, "progress": log.progress}
            world = compute_world(environments, source, system, settings.way, **told)
        # Refused where no place has any weather.
        if not world.weather.any():
            raise InputError(
                "--weather", "has no values at any of the places", "give other places or weather"
            )
        world = add_mix(world, weights) if weights else world
        log.clock.lap("world")
        # The world as netCDF, then pictures and a summary.
        write_world(work / "world.nc", world)
        # Without matplotlib no pictures are drawn, and the log says so.
        if settings.pictures and importlib.util.find_spec("matplotlib") is None:
            log.write("No pictures: they need matplotlib (pip install matplotlib)")
        elif settings.pictures:
            from ..world.draw_world import draw_world

            for name in draw_world(work / "world.nc", work):
                log.write(f"  {name}")
        log.clock.lap("write")
        write_summary(
            work / "summary.json",
            _summarise_world(world, environments, request, settings, log.clock.seconds),
        )
    run_tasks.drop_kept(folder, cluster)
    log.write(f"Written to {folder} in {describe_duration(sum(log.clock.seconds.values()))}")


def _check_world_settings(request, settings, *, fewest=50):
    """Refuse settings that mean nothing for a world."""
    implied = METHODS.get(request.method, {})
    own = [
        name
        for name in NOT_FOR_WORLDS
        if name not in implied or getattr(request, name) != implied[name]
    ]
    refuse_settings(request, own, "this world")
    if settings.step is not None and not 0 < settings.step <= 90:
        raise InputError(
            "--step", f"{settings.step:g}° is no step", "give degrees above 0 and up to 90"
        )
    # `fewest`: merged surfaces of an environment.
    if settings.surfaces is not None and settings.surfaces < fewest:
        raise InputError("--surfaces", f"{settings.surfaces} is too few", f"give {fewest} or more")
    check_source(request, settings)


def modules_alone(request):
    """Settings of a world: DC without losses, on open racks unless another mounting is asked for:
    Request.
    """
    mounting = "open-rack" if request.mounting == "auto" else request.mounting
    return replace(request, mounting=mounting, losses=0.0, inverter=None)


def _describe_world(environments, source, sky):
    """Environments, weather and places as lines of text."""
    lines = []
    for environment in environments:
        count, computed = environment.group_count.sum(), len(environment.weight)
        merged = "" if computed == count else f" merged into {computed:,}"
        area = f"{environment.group_area.sum():,.0f} m²"
        lines.append(
            f"{environment.name}: {count:,} surfaces with modules{merged}, {area}, "
            f"{environment.sky.count:,} directions ({environment.source})"
        )
    return [
        *lines,
        f"Sky: {sky}",
        f"Weather: {source.label}",
        *source.notes,
        f"{len(source.places):,} places",
    ]


def _summarise_world(world, environments, request, settings, seconds):
    """What is needed to judge or to repeat a world: dict."""
    return {
        "world": vars(settings) | {"sky": world.sky},
        "weather": {"label": world.label, "years": world.years, "places": len(world.places)},
        "environments": [
            {
                "name": environment.name,
                "source": environment.source,
                "directions": environment.sky.count,
                "surfaces": int(environment.group_count.sum()),
                "computed": len(environment.weight),
                "area": float(environment.group_area.sum()),
            }
            for environment in environments
        ],
        "places_with_weather": int((world.weather > 0).sum()),
        "settings": request.as_dict(),
        "seconds": seconds,
        "peak_memory_bytes": peak_memory(),
        "versions": versions(),
    }
