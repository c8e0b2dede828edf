"""The whole chain, from files of buildings to full load hours. Read this first.

    city files ─► Scene ─┐
                         ├─► Transfer ─┐
    weather ─► Suns ─────┘             ├─► Energy ─► tables, time series, summary
    weather ───────────────────────────┘

Geometry is traced once, free of weather. The Transfer can be weighed with any other year or module
in seconds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..accuracy.sun_sampling import CityYear, measure_ways
from ..city.axis_order import PlaceHints
from ..city.build_scene import SceneOptions, build_scene
from ..city.building_facts import without_names
from ..city.edge_distance import measure_edge_distance
from ..city.edited_scene import edit_scene
from ..city.racks import lay_racks, parse_racks
from ..effects.foliage import parse_months
from ..effects.table import check_effects
from ..energy.check_inputs import check_string_settings
from ..energy.compute_energy import compute_energy as compute_surface_energy
from ..energy.pv_system import build_system
from ..energy.time_axis import read_zone
from ..light.editable_city import trace_editable
from ..light.prepare_scene import prepare_scene
from ..light.trace_run import choose_year, trace_run
from ..patches.read_albedo import check_materials
from ..read.footprint_heights import HeightHints
from ..read.read_city import read_city
from ..read.read_terrain import read_terrain
from ..results.list_findings import rows_of_names
from ..results.read_results import place_of_results
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.system_settings import BUILDINGS
from ..sky.read_horizon import check_horizon
from ..sky.sky_models import choose_sky
from ..sun.sun_sampling import parse_sampling
from ..weather.climate_grid import is_land
from ..weather.read_weather import check_sources, read_weather

# [m] from the middle of an earlier city, beyond which a city stands in another system
ELSEWHERE = 50e3
SCENE_STAGE = "building the scene"


def check_settings(request):
    """Refuse settings that mean nothing before anything long begins.

    Raises
    ------
    InputError
    """
    request.check()
    check_effects(request)
    check_string_settings(request)
    parse_sampling(request.suns)
    parse_racks(request.racks)
    parse_months(request.leaf_months)
    build_system(request)
    check_sources(request.weather)


def check_tracing(request):
    """Check the request, and read what tracing needs beside a city: materials, horizon.

    Raises
    ------
    InputError
    """
    check_settings(request)
    check_materials(request)
    if request.horizon is not None:
        if request.horizon == request.weather == "pvgis":
            raise InputError(
                "--horizon",
                "the typical year of PVGIS contains its horizon",
                "leave --horizon out, or give years, which are without it: --weather "
                "pvgis:2005-2023",
            )
        check_horizon(request.horizon)


def read_scene(paths, request, progress=silent):
    """Scene of the buildings in some files, standing on its ground.

    Raises
    ------
    InputError
        If a file cannot be used, or nothing tells where the scene stands on Earth.
    """
    return make_located_scene(read_buildings(paths, request, progress), request)


def read_buildings(paths, request, progress=silent):
    """City of some files, as the settings want it.

    Raises
    ------
    InputError
        A file cannot be used.
    """
    like = place_of_results(request.site_of)[0] if request.site_of else None
    find_ground = None
    if request.terrain:
        # Outlines are extruded on the terrain.
        def find_ground(city):
            terrain = read_terrain(request.terrain, city, *conventions_of(city, request))
            return terrain.ground_heights()

    place = request.axes, request.latitude, request.longitude, is_land, like
    heights = HeightHints(
        request.height, request.default_height, request.unit, find_ground is not None
    )
    hints = PlaceHints(*place, find_ground=find_ground, heights=heights)
    how = {"unit": request.unit, "up": request.up, "orient": request.orient, "hints": hints}
    city = read_city(paths, lod=request.lod, progress=progress, **how)
    return without_names(city) if request.private else city


def make_located_scene(city, request):
    """Scene of a city on its ground, at a place on Earth that is known.

    Raises
    ------
    InputError
        Nothing tells where it stands.
    """
    scene = make_scene(city, request)
    if scene.site.latitude is None or scene.site.longitude is None:
        raise InputError(
            city.report.files[0],
            "names no coordinate reference system",
            "give its location with --latitude D --longitude D",
        )
    return scene


def make_scene(city, request, report_share=silent):
    """Scene of a city on its ground: generated, or terrain from a file; with racks where they are
    asked for.

    `report_share` is told the share that is done, 0 to 1.
    """
    # Racks, terrain and place, each if asked for; the place of other results only for the same
    # city.
    racks = parse_racks(request.racks)
    terrain = (
        read_terrain(request.terrain, city, *conventions_of(city, request))
        if request.terrain
        else None
    )
    site = lattice = None
    if request.site_of:
        site, lattice = place_of_results(request.site_of)
        away = np.linalg.norm(np.median(city.points, axis=0)[:2] - site.origin[:2])
        # Refused if their city is in another system, or more than 50 km away.
        if site.grid != city.grid or away > ELSEWHERE:
            raise InputError(
                Path(request.site_of) / "summary.json",
                "its city is in another reference system",
                "leave out --site-of",
            )
    # Refused, too, if a latitude is given beside other results.
    if request.site_of and request.latitude is not None:
        raise InputError("--site-of", "names a place, as does --latitude", "give one of them")
    # The scene, with racks on its roofs, and the distance of facades from the edge of the city.
    scene = build_scene(
        city,
        latitude=request.latitude,
        longitude=request.longitude,
        ground=request.ground,
        patch_size=request.patch_size,
        options=SceneOptions(
            terrain, request.grid_size, request.ground_albedo, request.sectors, site, lattice
        ),
        report_share=report_share,
    )
    scene = lay_racks(scene, city, racks, request.patch_size, request.sectors) if racks else scene
    return replace(
        scene, surfaces=replace(scene.surfaces, edge_distance=measure_edge_distance(scene))
    )


def conventions_of(city, request):
    """Unit and upward axis of files that state neither: as given, else as found in the files of the
    city.
    """
    report = city.report
    return (
        report.unit if request.unit == "auto" else request.unit,
        report.up if request.up == "auto" else request.up,
    )


def read_year(site, request, suns=None, keep=()):
    """Weather of one or more years for a site.

    Parameters
    ----------
    site : Site
    request : Request
    suns : Suns, optional
        Suns of a Transfer, which may be set up elsewhere along its latitude, or anywhere where they
        fill the sky.
    keep : sequence of path-like
        Folders of answers of services, as in `weather.ask_services.ask_weather`.

    Returns
    -------
    Weather

    Raises
    ------
    InputError
        The weather cannot be used, or comes from too far away.
    """
    zone = read_zone(request.time_axis)  # refuses what is none before anything takes long
    weather = read_weather(
        request.weather,
        site.latitude,
        site.longitude,
        site.altitude,
        point=request.weather_point,
        year=request.year,
        seed=request.weather_seed,
        time_shift=request.time_shift,
        place=request.weather_place,
        without=request.weather_without,
        horizon_cut=request.horizon_cut,
        keep=tuple(keep),
    )
    weather.check_distance(site, request.allow_distance, suns)
    return replace(weather, zone=zone)


def prepare_study(scene, weather, request, *, materials=None, progress=silent):
    """What tracing a scene for a year calls for: PreparedScene.

    `materials` are taken into `PreparedScene`, where they are known already.
    """
    known = {"weather": weather, "suns": choose_year(weather, request), "materials": materials}
    prepared = prepare_scene(scene, request, **known, progress=progress)
    return replace(prepared, rules=build_system(request).layout)


def trace_scene(scene, weather, request, progress=silent, folder=None, *, prepared=None):
    """Transfer of a scene for the suns of a year. Of the weather only the place and the time axis
    count.

    `prepared` is the scene's PreparedScene, where it is known already.
    What does not fit into the memory lies in `folder`, or in the system's place for temporary
    files. Whoever cancels after some suns (see `core.settings.progress`) gets a Transfer of those,
    which stand for the whole year then; before, the CancelledError.
    """
    return trace_run(scene, weather, request, progress, folder, prepared=prepared).transfer


def trace_base(scene, weather, request, progress=silent, *, prepared=None):
    """Trace a scene so that the city can be edited: EditableCity, with the Transfer.

    Raises
    ------
    InputError
        It asks for another estimator than gather.
    """
    prepared = prepared or prepare_study(scene, weather, request, progress=progress)
    suns = choose_year(weather, request) if prepared.suns is None else prepared.suns
    return trace_editable(prepared, suns, request, progress)


def measure_sun_sampling(scene, weather, transfer, request, progress=silent, *, prepared=None):
    """What the choice of suns does to the full load hours: the dict of
    `accuracy.sun_sampling.measure_ways`.
    """
    return measure_ways(
        CityYear(scene, prepared, weather, request), transfer, [transfer.suns], progress
    )[0]


def change_scene(base, before, after, request, progress=silent):
    """What an edit changes of the scene of a traced city: SceneChange.

    Parameters
    ----------
    base : EditableCity
    before, after : City
    request : Request
    progress : callable, optional
        Is told of it, and can stop it.
    """
    progress(SCENE_STAGE, 0, 1, "scenes")
    change = edit_scene(base.city.prepared.scene, base.rows, before, after, request)
    progress(SCENE_STAGE, 1, 1, "scenes")
    return change


def compute_energy(transfer, weather, request, progress=silent):
    """Irradiance and full load hours that a weather makes of a Transfer.

    Raises
    ------
    InputError
        `--series` names a surface that the Transfer does not have, `--sky` needs light that was not
        traced, or `--strings` what strings lose in shade.
    """
    series = find_surfaces(transfer.surfaces.surface_id, request.series)
    system, sky = build_system(request), choose_sky(request, transfer)
    return compute_surface_energy(
        transfer, weather, system, request.threads, progress, series=series, sky=sky
    )


def find_surfaces(surface_id, wanted):
    """Rows of surfaces by their ids, in the order they are asked for; an id that was cut stands for
    its cells.

    The word for all buildings is passed over.

    Raises
    ------
    InputError
        An id is unknown.
    """
    rows = rows_of_names(surface_id)
    wanted = [name for name in wanted if name != BUILDINGS]
    unknown = [name for name in wanted if name not in rows]
    if unknown:
        raise InputError(
            "--series",
            f"no surface has the id {', '.join(map(repr, unknown[:5]))}",
            "take ids from the column surface_id of faces.csv",
        )
    return list(dict.fromkeys(row for name in wanted for row in rows[name]))
