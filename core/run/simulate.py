"""The commands that write results: trace a city and compute its energy, or recompute energy from a
Transfer.
"""

from dataclasses import replace
from pathlib import Path

from ..accuracy.check_goal import check_goal
from ..accuracy.error_budget import suggest_more
from ..accuracy.rounds_to_target import CELLS
from ..energy import left_out
from ..energy.counted_area import classify_again, note_other_settings
from ..energy.pv_system import ELECTRIC
from ..light.rays_file import write_rays
from ..light.trace_run import trace_run, weigh_kept_suns
from ..modules.read_facades import check_facades
from ..rays.hemisphere_rays import is_compiled
from ..read.read_districts import read_districts
from ..results.compare_runs import CHANGE
from ..results.exports import RunResults, write_exports
from ..results.output_folder import ASKED, whole_folder
from ..results.transfer_file import read_transfer
from ..settings.errors import InputError
from ..settings.presets import METHODS
from ..settings.progress import CancelledError
from . import run_tasks, study
from .interruption import Interruption
from .rounds import refine_run
from .run_log import (
    RunLog,
    describe_extent,
    describe_interruption,
    describe_overrun,
    describe_scene,
    describe_weather,
    report_outcome,
    tell_next,
)
from .trace_tiles import check_cluster_settings, plan_tiles, trace_tiles
from .write_run import Output, write_energy, write_results, write_run

DRAWS = "draws report.html: the city in 3D, tables, errors"


def simulate(paths, folder, request, *, output=None, log=None, cluster=None):
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
    # What cannot be done is refused before anything is read.
    log, output = log or RunLog(None), output or Output()
    log.clock.lap("start")
    study.check_tracing(request)
    check_cluster_settings(cluster, request)
    # A run that can be edited has neither tiles nor several rounds.
    if cluster and "editable" in output.exports:
        raise InputError(
            "--editable", "is for runs without tiles", "leave it out, or leave out --cluster"
        )
    if request.wants_rounds and "editable" in output.exports:
        raise InputError(
            "--editable",
            "an editable run has one round",
            "leave out --target-error and --time-budget",
        )
    # City and weather are read and checked; what takes long comes after.
    with whole_folder(folder, output.overwrite) as work:
        log.write(f"Reading {', '.join(str(path) for path in paths)}")
        city = study.read_buildings(paths, request, log.progress)
        for line in describe_extent(city):
            log.write(f"  {line}")
        scene = study.make_located_scene(city, request)
        log.clock.lap("read city")
        _check_files(city, scene, request)
        log.write("\n".join(f"  {line}" for line in describe_scene(scene)))
        weather = study.read_year(scene.site, request, keep=(work / ASKED, Path(folder) / ASKED))
        log.write(describe_weather(weather, scene.site))
        log.clock.lap("read weather")
        # What will be simulated and left out, decided for this scene.
        if request.wants_rounds:
            check_goal(scene, weather, request, log)
        if cluster:
            prepared = plan_tiles(scene, weather, request, cluster, log.write)
        else:
            prepared = study.prepare_study(scene, weather, request)
        log.write(prepared.plan.names())
        log.detail("\n".join(f"  {line}" for line in prepared.plan.describe()))
        # Where no compiled code of an earlier run is kept, this run compiles; then its seconds tell
        # nothing about how long more samples would take.
        log.write(
            "Tracing"
            if (timed := is_compiled())
            else "Tracing; compiling first, which this machine needs once"
        )
        # Light: in tiles on a cluster, or all at once, where its rays are kept for edits if asked
        # for.
        tiles = None
        if cluster:
            with run_tasks.keeping(kept := run_tasks.kept_beside(folder), log.write):
                told = {"progress": log.progress, "tell": lambda line: log.write(f"  {line}")}
                transfer, tiles = trace_tiles(prepared, weather, request, cluster, kept, **told)
        else:
            transfer, base = trace_city(
                scene,
                weather,
                request,
                log,
                work.parent.parent,
                prepared=prepared,
                editable="editable" in output.exports,
            )
            if base is not None:
                write_rays(work, base, city)
        # Energy from light and weather, and the files of the run.
        log.clock.lap("trace")
        results = write_results(
            work, RunResults(city, scene, transfer, None, weather), request, output, log
        )
        totals = write_run(work, results, request, log, tiles)
        write_exports(work, results, output.exports, log.progress)
    # After the folder is complete: sums, remarks, and what would make it more accurate.
    transfer, energy = results.transfer, results.energy
    run_tasks.drop_kept(folder, cluster)
    report_outcome(log, folder, energy, totals, scene.report)
    more = suggest_more(transfer, weather, energy, timed=timed)
    log.write("\n".join([more, *describe_overrun(request, log)]))
    tell_next(log, (f"plot {folder}", DRAWS))
    return describe_interruption(transfer.record)


def _check_files(city, scene, request):
    """Refuse files of the user that do not fit the city, before anything takes long."""
    study.find_surfaces(scene.surfaces.surface_id, request.series)
    left_out.check_left_out(scene.surfaces, request.leave_out)
    check_facades(scene.surfaces, request.facades)
    if request.districts:
        read_districts(request.districts, scene.site, scene.site.from_files(city.points))


def trace_city(scene, weather, request, log, folder=None, *, prepared, editable=False):
    """Trace a city in one round, or in as many as target and time ask for, and measure the error of
    its choice of suns.

    After Ctrl-C, or once the log's progress raises CancelledError, the suns that were traced until
    then stand for the whole year.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
    log : RunLog
    folder : path-like, optional
        As in `study.trace_scene`.
    prepared : PreparedScene
    editable : bool
        Whether to keep what its rays met: of gather, in one round.

    Returns
    -------
    transfer : Transfer
    base : EditableCity or None
        None, too, if it was interrupted.

    Raises
    ------
    KeyboardInterrupt, CancelledError
        Before any usable set of suns was traced, or after a second Ctrl-C.
    InputError
        A city that cannot be edited shall be.
    """
    # For rounds too few shadow points are raised, which the log says; and they keep what their rays
    # meet.
    with Interruption(log.progress, log.stream) as interruption:
        if request.wants_rounds:
            if request.shadow_samples < CELLS:
                log.write(
                    f"Rounds have {CELLS} shadow points, so that light on patches is resolved "
                    "finely enough"
                )
                request = replace(request, shadow_samples=CELLS)
            prepared = replace(prepared.build_tree(request), rounds=True)
        # A base that can be edited, or a plain run.
        base = run = None
        if editable:
            base = study.trace_base(scene, weather, request, interruption, prepared=prepared)
            transfer = base.transfer
            # An interrupted base cannot be edited: only its light is kept, for the suns that it
            # has.
            if transfer.record.interrupted:
                base, transfer = None, weigh_kept_suns(transfer, weather.axis)
                log.write("What its rays met is not kept, since it was interrupted")
        else:
            run = trace_run(scene, weather, request, interruption, folder, prepared=prepared)
            transfer = run.transfer
        # After an interruption this is the only estimate of the error from missing suns, and takes
        # seconds.
        progress = log.progress if interruption.asked else interruption
        # Who stops during this measurement gets the results without this error.
        try:
            sampling = study.measure_sun_sampling(
                scene, weather, transfer, request, progress, prepared=prepared
            )
            transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
        except CancelledError:
            log.write("The error of sun sampling was not measured")
        # The error of the choice of suns goes into all records.
        if base is not None:
            base.city.states[0].transfer = replace(
                base.city.states[0].transfer, record=transfer.record
            )
        # Further rounds follow, unless the user stopped.
        if request.wants_rounds and not interruption.asked:
            transfer = refine_run(replace(run, transfer=transfer), log, interruption, folder)
    # What was interrupted says so.
    if interruption.asked:
        count = len(transfer.suns)
        noted = transfer.record.interrupted or {"suns_traced": count, "of": count}
        transfer = replace(transfer, record=replace(transfer.record, interrupted=noted))
    return transfer, base


def recompute(transfer_path, folder, request, *, overwrite=False, log=None):
    """Compute the energy of an earlier Transfer with another weather or module.

    `transfer_path` is the file, or the result folder that holds it; further parameters and errors
    as in `simulate`.
    """
    # The light to be weighed: a file or a run's folder; what is decided by tracing cannot be
    # changed.
    if Path(transfer_path).is_dir():
        transfer_path = Path(transfer_path) / "transfer.nc"
        if not transfer_path.is_file():
            raise InputError(
                transfer_path, "the run wrote no light to weigh again", "simulate with --transfer"
            )
    log = log or RunLog(None)
    study.check_settings(request)
    # Effects that tracing decided are refused; those that only a method implies are passed over, as
    # are its other settings of light.
    implied = METHODS.get(request.method, {}).get("effects", {})
    for key in request.effects:
        if key not in (*ELECTRIC, *implied):
            raise InputError(
                "--effects",
                f"{key} was decided when the city was traced",
                f"use {', '.join(ELECTRIC)}",
            )
    with whole_folder(folder, overwrite) as work:
        # Names of buildings go if the run is private. Surfaces may count otherwise now, by other
        # sectors, which the log says; notes tell what the file does not know.
        stored = read_transfer(transfer_path)
        check_facades(stored.surfaces, request.facades)
        if request.private and stored.facts:
            stored = replace(stored, facts=stored.facts.without_names())
        transfer = classify_again(stored, request.sectors)
        if transfer is not stored:
            log.write(
                f"Surfaces are classified again for --sectors {request.sectors}. Those that did "
                "not count when"
            )
            log.write("  they were traced may have a quarter of the rays, and larger errors")
        for note in (*transfer.notes, *note_other_settings(transfer, request)):
            log.write(f"{transfer_path}: {note}")
        # An edit may have removed what the list of its base names; other names must be there.
        if (Path(transfer_path).parent / CHANGE).is_file():
            if gone := left_out.describe_gone(transfer.surfaces, request.leave_out):
                log.write(gone)
        else:
            left_out.check_left_out(transfer.surfaces, request.leave_out)
        if transfer.record and transfer.record.interrupted:
            log.write(
                f"{transfer_path} is from an interrupted run. "
                f"{describe_interruption(transfer.record)}"
            )
        # Then as after tracing: weather, energy, files, sums.
        kept = work / ASKED, Path(folder) / ASKED, Path(transfer_path).parent / ASKED
        weather = study.read_year(transfer.site, request, transfer.suns, kept)
        log.write(describe_weather(weather, transfer.site))
        log.clock.lap("read")
        energy = write_energy(work, transfer, weather, request, log)
        totals = write_run(work, RunResults(None, None, transfer, energy, weather), request, log)
    report_outcome(log, folder, energy, totals)
    tell_next(log, (f"plot {folder}", DRAWS))
