"""The commands that write results: trace a city and compute its energy, or recompute energy from a Transfer."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..accuracy.check_reachable import check_reachable
from ..accuracy.effect_shares import shares_of_effects, state_outcome, state_sky
from ..accuracy.error_budget import suggest_more
from ..accuracy.pilot import CityYear
from ..city.grid_cells import outline_surfaces, split_into_cells
from ..city.racks import city_with_racks
from ..cluster.run_tasks import drop_kept, keeping, kept_beside
from ..cluster.trace_part import bound_hours
from ..cluster.trace_tiles import check_cluster_settings, plan_tiles, trace_tiles
from ..effects.plan_effects import describe_plan
from ..energy.counted_area import classify_again
from ..energy.pv_system import ELECTRIC, build_system
from ..light.kept_matrix import is_on_disk
from ..light.prepare_scene import build_tree
from ..light.transfer import Round
from ..rays.hemisphere_rays import is_compiled
from ..results.output_folder import whole_folder
from ..results.rays_file import NAME as RAYS
from ..results.rays_file import write_rays
from ..results.transfer_file import read_transfer, write_transfer
from ..results.write_cityjson import write_cityjson
from ..results.write_geopackage import write_geopackage
from ..results.write_gltf import write_gltf
from ..results.write_summary import summarise, write_summary
from ..results.write_tables import write_tables
from ..settings.errors import InputError
from ..settings.presets import METHODS
from ..settings.progress import CancelledError, Interruption, silent
from ..study import (
    check_settings,
    check_tracing,
    compute_energy,
    find_surfaces,
    measure_sun_sampling,
    place_city,
    prepare_study,
    read_buildings,
    read_year,
    trace_base,
    trace_scene,
)
from .refine_run import refine_run, wants_rounds
from .run_log import RunLog, describe_interruption, describe_overrun, describe_scene, describe_weather, report_outcome
from .spend_budget import spend_budget

EXPORTS = ("transfer", "editable", "cityjson", "gltf", "geopackage")


@dataclass
class Output:
    """What a run writes beside its tables."""

    overwrite: bool = False  # replace the results in a folder that is not empty
    exports: tuple = ()  # of EXPORTS: "transfer" even where it is large, "editable" what rays met, files for others
    draw: Callable | None = None  # `draw(folder, scene, transfer, energy, note)` writes pictures of the results


class Results(NamedTuple):
    """What a run has found."""

    city: Any  # City of `draw_city`, and
    scene: Any  # Scene; None of a Transfer that was read from a file
    transfer: Any  # Transfer
    energy: Any  # Energy
    weather: Any  # Weather


def simulate(paths, folder, request, *, output=None, log=None, cluster=None, free=()):
    """Trace a city and write its full load hours.

    Parameters
    ----------
    paths : list of path-like
        Files or folders with buildings.
    folder : path-like
        Folder for the results, written completely or not at all.
    request : Request
    output : Output, optional
    log : RunLog, optional
        Receives progress and messages.
    cluster : ClusterSettings, optional
        Trace in tiles.
    free : collection of str
        Of `choose_settings.KNOBS`: settings that a time budget may choose.

    Returns
    -------
    str
        After Ctrl-C while suns were traced: the suns on which the results are based. Else "".

    Raises
    ------
    InputError
        Before anything is written.
    KeyboardInterrupt, CancelledError
        Ctrl-C at any other time: nothing is written.
    """
    log, output = log or RunLog(None), output or Output()
    log.clock.lap("start")
    check_tracing(request)
    check_cluster_settings(cluster, request)
    if cluster and "editable" in output.exports:
        raise InputError("--editable", "is for runs without tiles", "leave it out, or leave out --cluster")
    with whole_folder(folder, output.overwrite) as work:
        log.write(f"Reading {', '.join(str(path) for path in paths)}")
        city = read_buildings(paths, request, log.progress)
        scene = place_city(city, request)
        log.clock.lap("read city")
        find_surfaces(scene.surfaces.surface_id, request.series)  # refuses unknown names before anything takes long
        for line in describe_scene(scene):
            log.write(f"  {line}")
        weather = read_year(scene.site, request)
        log.write(describe_weather(weather, scene.site))
        log.clock.lap("read weather")
        if request.time_budget and free and not cluster:
            request = spend_budget(scene, weather, request, free, log)
        log.write("Effects included for this scene:")
        if cluster:
            prepared = plan_tiles(scene, weather, request, cluster, log.write)
        else:
            prepared = prepare_study(scene, weather, request)
        for line in describe_plan(prepared.plan):
            log.write(f"  {line}")
        log.write("Tracing" if is_compiled() else "Tracing; compiling first, which this machine needs once")
        tiles = None
        if cluster:
            with keeping(kept := kept_beside(folder), log.write):
                told = {"progress": log.progress, "tell": lambda line: log.write(f"  {line}")}
                transfer, tiles = trace_tiles(prepared, weather, request, cluster, kept, **told)
        elif "editable" in output.exports:
            base = trace_to_edit(scene, weather, request, log, prepared=prepared)
            transfer = base.transfer
            write_rays(work / RAYS, base, city)
        else:
            transfer = trace_until_interrupted(scene, weather, request, log, work.parent, prepared=prepared)
        log.clock.lap("trace")
        results = write_results(work, Results(city, scene, transfer, None, weather), request, output, log)
        totals = write_run(work, results, request, log, tiles)
        write_exports(work, results, request, output.exports, log.progress)
    transfer, energy = results.transfer, results.energy
    drop_kept(folder, cluster)
    report_outcome(log, folder, energy, totals)
    log.write("\n".join([suggest_more(transfer, weather, energy), *describe_overrun(request, log, transfer.record)]))
    return describe_interruption(transfer.record)


def write_results(work, found, request, output, log):
    """Compute the Energy of a run, and write its tables and pictures: Results, with the city as its surfaces are cut.

    Parameters
    ----------
    work : Path
    found : Results
        Without energy, with the City as it was read.
    request : Request
    output : Output
    log : RunLog
    """
    city, scene, transfer, _, weather = found
    city = draw_city(city, scene, request)
    transfer = replace(transfer, outlines=outline_surfaces(city, scene.surfaces, scene.site))
    keep = not is_on_disk(transfer.visible_share) or bool({"transfer", "editable"} & set(output.exports))
    energy = write_energy(work, transfer, weather, request, log, keep=keep)
    if output.draw:
        log.write("Blender")
        output.draw(work, scene, transfer, energy, weather.label)
        log.clock.lap("Blender")
    return Results(city, scene, transfer, energy, weather)


def trace_to_edit(scene, weather, request, log, *, prepared):
    """Trace a city so that `citypv variant` can edit it: EditableCity, with its error of sun sampling.

    Raises
    ------
    InputError
        Further rounds are asked for.
    """
    if wants_rounds(request):
        raise InputError("--editable", "an editable run has one round", "leave out --target-error and --time-budget")
    base = trace_base(scene, weather, request, log.progress, prepared=prepared)
    transfer = base.transfer
    sampling = measure_sun_sampling(scene, weather, transfer, request, log.progress, prepared=prepared)
    base.leaf.transfer = replace(base.leaf.transfer, record=replace(transfer.record, sun_sampling=sampling))
    return base


def trace_until_interrupted(scene, weather, request, log, folder, *, prepared):
    """Transfer of a scene with its error of sun sampling; after Ctrl-C, of the suns that were traced until then.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
    log : RunLog
    folder : path-like
        As in `trace_scene`.
    prepared : PreparedScene

    Returns
    -------
    Transfer

    Raises
    ------
    KeyboardInterrupt, CancelledError
        Before any usable set of suns was traced, or after a second Ctrl-C.
    """
    told = ""
    with Interruption(log.progress, log.stream) as heard:
        if wants_rounds(request):
            prepared = build_tree(prepared, request)
            inputs = CityYear(scene, prepared, weather, request)
            told = check_reachable(inputs, heard) if request.target_error else ""
            if told:
                log.write(told)
            prepared = replace(prepared, round=Round())
        transfer = trace_scene(scene, weather, request, heard, folder, prepared=prepared)
        # This takes seconds: after an interruption it is the only estimate of the error from missing suns.
        progress = log.progress if heard.asked else heard
        try:
            sampling = measure_sun_sampling(scene, weather, transfer, request, progress, prepared=prepared)
            transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
        except CancelledError:
            log.write("The error of sun sampling was not measured")
        if wants_rounds(request) and not heard.asked:
            inputs = CityYear(scene, prepared, weather, request)
            transfer = refine_run(transfer, inputs, log, heard, folder=folder, told=told)
    if heard.asked:
        count = len(transfer.suns)
        noted = transfer.record.interrupted or {"suns_traced": count, "of": count}
        transfer = replace(transfer, record=replace(transfer.record, interrupted=noted))
    return transfer


def recompute(transfer_path, folder, request, *, overwrite=False, log=None):
    """Compute the energy of an earlier Transfer with another weather or module.

    Parameters and errors as in `simulate`.
    """
    log = log or RunLog(None)
    check_settings(request)
    implied = METHODS.get(request.method, {}).get("effects", {})  # as other settings of light, without effect here
    for key in request.effects:
        if key not in (*ELECTRIC, *implied):
            raise InputError("--effects", f"{key} was decided when the city was traced", f"use {', '.join(ELECTRIC)}")
    with whole_folder(folder, overwrite) as work:
        stored = read_transfer(transfer_path)
        transfer = classify_again(stored, request.sectors)
        if transfer is not stored:
            log.write(
                f"Surfaces are classified again for --sectors {request.sectors}. Those that did not count when they"
            )
            log.write("  were traced may have a quarter of the rays, and larger errors")
        for note in transfer.notes:
            log.write(f"{transfer_path}: {note}")
        if transfer.record and transfer.record.interrupted:
            log.write(f"{transfer_path} is from an interrupted run. {describe_interruption(transfer.record)}")
        weather = read_year(transfer.site, request, transfer.suns)
        log.write(describe_weather(weather, transfer.site))
        log.clock.lap("read")
        energy = write_energy(work, transfer, weather, request, log)
        totals = write_run(work, Results(None, None, transfer, energy, weather), request, log)
    report_outcome(log, folder, energy, totals)


def write_energy(work, transfer, weather, request, log, *, keep=True):
    """Compute the Energy of a Transfer and write its tables, and transfer.nc if `keep`: Energy."""
    log.write("Electricity")
    energy = compute_energy(transfer, weather, request, log.progress)
    log.clock.lap("electricity")
    write_tables(work, transfer, energy, weather, request, progress=log.progress)
    if keep:
        write_transfer(work / "transfer.nc", transfer, log.progress)
    else:
        log.write(f"transfer.nc would have {transfer.visible_share.shape[1]:,} suns for each surface: not written")
        log.write("  (--transfer writes it)")
    log.clock.lap("write tables")
    return energy


def write_run(work, results, request, log, tiles=None, *, beside=None):
    """Measure what effects of the modules and the sky's model change, and write summary.json: its totals.

    `beside` are further sections of it.
    """
    _, scene, transfer, energy, weather = results
    system = build_system(request)
    shares = shares_of_effects(transfer, weather, system, request.threads, sky=energy.sky)
    if shares:
        log.write(f"  in full load hours: {', '.join(f'{key} {100 * share:+.1f} %' for key, share in shares.items())}")
    log.clock.lap("shares of effects")
    summary = summarise(transfer, energy, weather, request, scene=scene, seconds=log.clock.seconds)
    state_outcome(summary, shares, request)
    state_sky(summary, transfer, weather, system, sky=energy.sky, threads=request.threads)
    if tiles:
        summary["tiles"] = state_bound(tiles, transfer, energy, weather)
        log.write(f"  {describe_bound(summary['tiles'])}")
    write_summary(work / "summary.json", summary | (beside or {}))
    return summary["totals"]


def write_exports(work, results, request, exports, progress=silent):
    """Write files for other programs: `city.city.json`, `city.glb`, `city.gpkg`.

    Parameters
    ----------
    work : Path
    results : Results
    request : Request
    exports : collection of str
    progress : callable, optional
        See `core.progress`.
    """
    city, scene, transfer, energy, weather = results
    tables = {"cityjson": ("city.city.json", write_cityjson), "geopackage": ("city.gpkg", write_geopackage)}
    for name, write in (tables[key] for key in tables if key in exports):
        system = build_system(request)
        write(work / name, city, transfer, energy, system=system, label=weather.label, progress=progress)
    if "gltf" in exports:
        write_gltf(work / "city.glb", scene, energy, label=weather.label, progress=progress)


def draw_city(city, scene, request):
    """City whose polygons are the surfaces of its scene: cells of the grid, and racks."""
    cells = city if request.grid_size is None else split_into_cells(city, request.grid_size)[0]
    return city_with_racks(cells, scene)


def state_bound(tiles, transfer, energy, weather):
    """Figures of the tiles with what they leave out at most, in percent of the eligible surfaces' irradiation: dict."""
    chosen = energy.eligible & np.isfinite(energy.poa_global_annual)
    area = transfer.surfaces.area[chosen]
    hours = len(weather.data) / energy.years
    mean = 1000 * float(np.average(energy.poa_global_annual[chosen], weights=area)) / hours if area.any() else 0.0
    mean /= weather.interval.total_seconds() / 3600
    bound = bound_hours(tiles["left_out"], transfer.record.brightest_albedo, weather, energy.sky, mean)
    return tiles | {"bound": bound, "unit": f"{tiles['unit']}; bound in percent of the eligible surfaces' irradiation"}


def describe_bound(tiles):
    """What the tiles leave out, as a line of text."""
    if tiles["bound"] is None:
        beyond = "no bound is known for what lies beyond"
    else:
        beyond = f"what lies beyond changes at most {tiles['bound']:.2f} % of the irradiation"
    reach = f"up to {tiles['near']:,.0f} m in full, and what rises above 2° up to {tiles['farthest']:,.0f} m"
    return f"surroundings of the tiles: {reach}; {beyond}"
