"""The commands that write results: trace a city and compute its energy, or recompute energy from a Transfer."""

from dataclasses import replace

from ..accuracy.error_budget import suggest_more
from ..accuracy.foresee_target import foresee_target
from ..effects.plan_effects import describe_plan
from ..energy.pv_system import ELECTRIC, build_system
from ..errors import InputError
from ..interruption import Interruption
from ..light.kept_matrix import is_on_disk
from ..light.prepare_scene import build_tree
from ..light.transfer import Round
from ..methods import METHODS
from ..progress import CancelledError, silent
from ..racks.lay_racks import city_with_racks
from ..results.effect_shares import shares_of_effects, state_outcome
from ..results.output_folder import whole_folder
from ..results.read_transfer import read_transfer
from ..results.share_of_sky import state_sky
from ..results.write_cityjson import write_cityjson
from ..results.write_geopackage import write_geopackage
from ..results.write_gltf import write_gltf
from ..results.write_summary import summarise, write_summary
from ..results.write_tables import write_tables
from ..results.write_transfer import write_transfer
from ..sampling.hemisphere_rays import is_compiled
from ..scene.add_backs import surface_of_triangles
from ..scene.grid_cells import split_into_cells
from ..scene.outline_surfaces import outline_surfaces
from ..study import (
    check_settings,
    check_tracing,
    compute_energy,
    find_surfaces,
    measure_sun_sampling,
    place_city,
    read_buildings,
    read_year,
    trace_scene,
)
from ..sun.check_distance import describe_distance
from .judge_light import judge_light
from .refine_run import RunInputs, refine_run, wants_rounds
from .report_outcome import describe_overrun, report_outcome
from .run_log import RunLog
from .simulate_tiles import add_bound, check_cluster_settings, drop_kept, kept_beside, prepare_run, trace_in_tiles
from .spend_budget import spend_budget

EXPORTS = ("transfer", "cityjson", "gltf", "geopackage")


def simulate(paths, folder, request, *, overwrite=False, stream=None, draw=None, exports=(), cluster=None, free=()):
    """Trace a city and write its full load hours.

    Parameters
    ----------
    paths : list of path-like
        Files or folders with buildings.
    folder : path-like
        Folder for the results, written completely or not at all.
    request : Request
    overwrite : bool
        Replace the results in a folder that is not empty.
    stream : text stream, optional
        Stream for progress messages.
    draw : callable, optional
        `draw(folder, scene, transfer, energy, note)` writes pictures of the results.
    exports : collection of str
        Of `EXPORTS`: additional formats for other programs. "transfer" writes transfer.nc even if its matrices do not
        fit into memory; by default it is skipped then.
    cluster : ClusterSettings, optional
        Trace in tiles.
    free : collection of str
        Of `command_line.KNOBS`: settings that a time budget may choose.

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
    log = RunLog(stream)
    check_tracing(request)
    check_cluster_settings(cluster, request)
    with whole_folder(folder, overwrite) as work:
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
            request = spend_budget((scene, weather, request), free, log)
        log.write("Effects included for this scene:")
        prepared = prepare_run(scene, weather, request, cluster, log)
        for line in describe_plan(prepared.plan):
            log.write(f"  {line}")
        log.write("Tracing" if is_compiled() else "Tracing; compiling first, which this machine needs once")
        tiles = None
        if cluster:
            transfer, tiles = trace_in_tiles(prepared, weather, request, cluster, log, folder=kept_beside(folder))
        else:
            transfer = trace_until_interrupted(scene, weather, request, log, work.parent, prepared=prepared)
        log.clock.lap("trace")
        city = draw_city(city, scene, request)
        transfer = judge_light(transfer, prepared.plan, weather, request)
        transfer = replace(transfer, outlines=outline_surfaces(city, scene.surfaces, scene.site))
        keep = not is_on_disk(transfer.visible_share) or "transfer" in exports
        energy = write_results(work, transfer, weather, request, log, scene=scene, draw=draw, keep=keep, tiles=tiles)
        write_exports(work, (city, scene, transfer, energy, weather), request, exports, log.progress)
    drop_kept(folder, cluster)
    report_outcome(log, folder, energy)
    log.write("\n".join([suggest_more(transfer, weather, energy), *describe_overrun(request, log, transfer.record)]))
    return describe_interruption(transfer.record)


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
            told = foresee_target((scene, prepared, weather, request), heard) if request.target_error else ""
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
            transfer = refine_run(
                transfer, RunInputs(scene, prepared, weather, request), log, heard, folder=folder, told=told
            )
    if heard.asked:
        count = len(transfer.suns)
        noted = transfer.record.interrupted or {"suns_traced": count, "of": count}
        transfer = replace(transfer, record=replace(transfer.record, interrupted=noted))
    return transfer


def recompute(transfer_path, folder, request, *, overwrite=False, stream=None):
    """Compute the energy of an earlier Transfer with another weather or module.

    Parameters and errors as in `simulate`.
    """
    log = RunLog(stream)
    check_settings(request)
    implied = METHODS.get(request.method, {}).get("effects", {})  # as other settings of light, without effect here
    for key in request.effects:
        if key not in (*ELECTRIC, *implied):
            raise InputError("--effects", f"{key} was decided when the city was traced", f"use {', '.join(ELECTRIC)}")
    with whole_folder(folder, overwrite) as work:
        transfer = read_transfer(transfer_path)
        if transfer.record and transfer.record.interrupted:
            log.write(f"{transfer_path} is from an interrupted run. {describe_interruption(transfer.record)}")
        weather = read_year(transfer.site, request, transfer.suns)
        log.write(describe_weather(weather, transfer.site))
        log.clock.lap("read")
        energy = write_results(work, transfer, weather, request, log)
    report_outcome(log, folder, energy)


def write_results(work, transfer, weather, request, log, *, scene=None, draw=None, keep=True, tiles=None):
    """Compute the energy of a Transfer and write all files into a folder, transfer.nc only if `keep`.

    Returns
    -------
    Energy
    """
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
    if draw:
        log.write("Blender")
        draw(work, scene, transfer, energy, weather.label)
        log.clock.lap("Blender")
    system = build_system(request)
    shares = shares_of_effects(transfer, weather, system, request.threads, sky=energy.sky)
    if shares:
        log.write(f"  in full load hours: {', '.join(f'{key} {100 * share:+.1f} %' for key, share in shares.items())}")
    log.clock.lap("shares of effects")
    summary = summarise(transfer, energy, weather, request, scene=scene, seconds=log.clock.seconds)
    state_outcome(summary, shares, request)
    state_sky(summary, transfer, weather, system, sky=energy.sky, threads=request.threads)
    if tiles:
        log.write(f"  {add_bound(summary, tiles, transfer, energy, weather)}")
    write_summary(work / "summary.json", summary)
    return energy


def write_exports(work, results, request, exports, progress=silent):
    """Write files for other programs: `city.city.json`, `city.glb`, `city.gpkg`.

    Parameters
    ----------
    work : Path
    results : tuple
        City (of `draw_city`), Scene, Transfer, Energy and Weather of a run.
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


def describe_scene(scene):
    """Counts and place as lines of text."""
    report, site = scene.report, scene.site
    kinds = ", ".join(f"{(scene.surfaces.kind == kind).sum():,} {kind}" for kind in sorted(set(scene.surfaces.kind)))
    lines = [
        f"{report.building_count:,} buildings, {report.part_count:,} parts, {len(scene.surfaces):,} surfaces: {kinds}",
        f"{len(scene.triangles):,} triangles, {(surface_of_triangles(scene) < 0).sum():,} of them ground",
        f"latitude {site.latitude:.4f}°, longitude {site.longitude:.4f}°, grid north at {site.convergence:+.3f}°",
    ]
    lines += [f"skipped {len(ids):,} surfaces: {reason}" for reason, ids in report.skipped.items()]
    lines += [f"repaired {len(ids):,} surfaces: {reason}" for reason, ids in report.repaired.items()]
    return lines + list(report.notes)


def describe_weather(weather, site):
    """The weather as lines of text: its label, its distance from the city, and notes."""
    told = "; ".join(filter(None, (weather.label, describe_distance(weather, site))))
    return "\n".join([f"Weather: {told}", *(f"  {note}" for note in weather.notes)])


def describe_interruption(record):
    """The suns on which an interrupted Transfer is based, and the resulting error; "" for a complete one."""
    if record.interrupted is None:
        return ""
    line = "Interrupted: kept {suns_traced:,} of {of:,} suns".format(**record.interrupted)
    line += f" and {record.rounds:,} times the samples of the first round" if record.rounds > 1 else ""
    if record.sun_sampling:
        line += "; this changes full load hours by {bias:+.2f} %, those of single surfaces by {rms:.2f} % (rms)".format(
            **record.sun_sampling
        )
    return line
