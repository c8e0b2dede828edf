"""`citypv variant`: an edited city from what is known of the city before, in seconds."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from ..city.axis_order import PlaceHints
from ..city.building_facts import without_names
from ..city.edge_distance import measure_edge_distance
from ..city.edit_city import CityChange, edit_city, place_local
from ..city.terrain import ground_of_feet
from ..city.written_scene import written_scene
from ..energy.left_out import describe_gone
from ..energy.pv_system import build_system
from ..energy.standard_errors import errors_of_energy
from ..light.change_light import trace_change
from ..light.errors_of_change import errors_of_difference
from ..light.rays_file import read_rays, write_rays
from ..read.footprint_heights import HeightHints
from ..read.read_city import read_city
from ..results.columns import write_table
from ..results.compare_runs import CHANGE, describe_light, mark_of
from ..results.exports import RunResults, write_exports
from ..results.output_folder import ASKED, whole_folder
from ..results.transfer_file import read_transfer
from ..settings.errors import InputError, id_of_cell
from ..settings.progress import silent
from ..weather.climate_grid import is_land
from . import study
from .run_log import RunLog, describe_weather, report_outcome, tell_next
from .study import ELSEWHERE
from .write_run import Output, write_results, write_run


@dataclass
class Change:
    """What is to change, as `citypv variant` is told."""

    add: list = field(default_factory=list)  # files of buildings or trees
    remove: list = field(default_factory=list)  # ids of buildings, names of trees
    move: dict = field(default_factory=dict)  # id -> [m] to true east and north
    raised: dict = field(default_factory=dict)  # id -> [m] by which all above its foot goes up
    albedo_of: dict = field(default_factory=dict)  # id -> albedo of the building
    local: bool = False  # whether files are in metres from the base's local origin
    # whether names and addresses are left out; they are where the base has none
    private: bool = False


def make_variant(base_folder, folder, change, *, output=None, log=None):
    """Trace an edited city from a result folder that keeps its rays, and write results like any
    other.

    Parameters
    ----------
    base_folder : path-like
        Of `citypv simulate --editable`, or of an editable variant.
    folder : path-like
        Written completely or not at all.
    change : Change
    output : Output, optional
    log : RunLog, optional

    Raises
    ------
    InputError
        The base cannot be edited, an id is unknown, or a file cannot be used.
    """
    log, output = log or RunLog(), output or Output()
    with whole_folder(folder, output.overwrite) as work, TemporaryDirectory() as place:
        # The base as it was traced, from its files, and the weather of its year.
        kept = read_rays(base_folder)
        transfer = read_transfer(Path(base_folder) / "transfer.nc")
        base = kept.restore(transfer, build_system(kept.request).layout)
        weather = study.read_year(
            kept.scene.site, kept.request, keep=(work / ASKED, Path(base_folder) / ASKED)
        )
        log.write(describe_weather(weather, kept.scene.site))
        log.clock.lap("read base")
        # The edited city, with new albedos where they were given: only what the edit changes is
        # traced.
        city = edit_city(kept.city, _read_change(change, kept), kept.scene.site.convergence)
        request = replace(kept.request, private=kept.request.private or change.private)
        # Addresses and names from the files are left out where the base or the change asks for
        # that.
        city = without_names(city) if request.private else city
        if change.albedo_of:
            path = _write_albedos(Path(place), request.albedo_file, city, change.albedo_of)
            request = replace(request, albedo_file=path)
        scene, edited = trace_edit(base, kept.city, city, request=request, progress=log.progress)
        log.clock.lap("trace")
        gone = describe_gone(scene.surfaces, request.leave_out)
        if gone:
            log.write(gone)
        # Files are named as they were given, and the choice of suns is the base's.
        named = replace(request, **kept.names)
        changes = {"request": named.as_dict(), "sun_sampling": base.transfer.record.sun_sampling}
        transfer = replace(edited.transfer, record=replace(edited.transfer.record, **changes))
        told = {"base_crc32": mark_of(base_folder)} | ({"note": gone} if gone else {})
        if edited.before is not None:
            # The base was solved again, with as much light as the edited city asks for: what the
            # edit changes is told against this, and the log says so.
            light, kept_record = edited.before.transfer, base.transfer.record
            record = replace(
                light.record, request=kept_record.request, sun_sampling=kept_record.sun_sampling
            )
            transfer = replace(transfer, base=replace(light, record=record))
            told["base_light"] = _tell_light(edited.before)
            log.write(
                "The edited city asks for more than its base has: "
                f"{describe_light(told['base_light'])}"
            )
            log.write(
                "  The light of the base is solved with these too; compare takes it as before"
            )
        # Results as of any run, and the rays for a further edit.
        if "editable" in output.exports:
            write_rays(work, edited, city, kept.names)
        # Of these files only what is left out is read once more: from the rays, not by its name.
        asked = replace(named, leave_out=request.leave_out)
        summary = write_results(
            work, RunResults(city, scene, transfer, None, weather), asked, output, log
        )
        # The standard errors of the changes that surfaces of both cities see.
        ids, errors = errors_of_change(
            edited.before or base, edited, weather, asked, summary.energy
        )
        table = {"surface_id": ids, "full_load_hours_change_standard_error": errors}
        write_table(work / CHANGE, pd.DataFrame(table))
        beside = {"settings": named.as_dict(), "variant": told}
        totals = write_run(work, summary, asked, log, beside=beside)
        write_exports(work, summary, output.exports, log.progress)
    report_outcome(log, folder, summary.energy, totals)
    who = f"compare {base_folder} {folder} --out {folder}_change"
    tell_next(log, (who, "who gains and who loses"))


def trace_edit(base, before, after, *, request=None, progress=silent, preview=None):
    """Trace an edited city from a traced one.

    Parameters
    ----------
    base : EditableCity
        Of the city before.
    before, after : City
    request : Request, optional
        With other materials than the base's.
    progress, preview : callable, optional
        As in `light.change_light.trace_change`; `preview` gets the edited Scene before its light.

    Returns
    -------
    scene : Scene
        Of the edited city, in its order.
    edited : EditableCity
    """
    request = request or base.request
    change = study.change_scene(base, before, after, request, progress)
    scene = written_scene(change.scene, change.rows)
    left = [] if scene.surfaces.edge_distance is None else [change.scene.surfaces.edge_distance]

    def look(*light):
        """Show the estimate first, and then measure the edge: a new building may be at the rim."""
        if preview is not None:
            preview(scene, *light)
        while left:
            left.pop()[change.rows] = measure_edge_distance(scene)

    return scene, trace_change(base, change, request, progress, look)


def errors_of_change(before, after, weather, request, energy):
    """Standard errors of the change of full load hours, whose noise before and after cancels.

    Parameters
    ----------
    before, after : EditableCity
        The latter of an edit of the former.
    weather : Weather
    request : Request
    energy : Energy
        Of the city after.

    Returns
    -------
    surface_id : (n,) str
        Of surfaces that both have.
    error : (n,) float64 [h]
    """
    both, rows = errors_of_difference(before, after)
    place = np.argsort(after.rows)[np.searchsorted(np.sort(after.rows), rows[1])]
    hours = np.array([energy.full_load_hours[place], energy.poa_global_annual[place]])
    # Light is worth the same hours before and after, but where an edit took more than a tenth of
    # it: these are computed of the light before, without laying modules.
    light = [
        sum(state.of_surfaces[own].sum(axis=1) for state in one.city.states) / len(one.city.states)
        for one, own in zip((before, after), rows, strict=True)
    ]
    dimmed = np.flatnonzero(light[1] < 0.9 * light[0])
    if len(dimmed):
        plain = replace(request, series=(), layout="area")
        part = study.compute_energy(both.take(dimmed), weather, plain)
        hours[:, dimmed] = part.full_load_hours, part.poa_global_annual
    known = replace(energy, full_load_hours=hours[0], poa_global_annual=hours[1])
    return both.surfaces.surface_id, errors_of_energy(both, weather, known).of_surfaces


def _tell_light(base):
    """What light of a base was solved with, for the summary of its variant: dict."""
    return {"max_bounces": base.decisions.bounces, "sky": base.decisions.plan["sky"]}


def _read_change(change, kept):
    """The change, with the cities of the files that are added: CityChange."""
    added = []
    for path in change.add:
        request, conventions = kept.request, study.conventions_of(kept.city, kept.request)
        like = None if change.local or kept.city.crs is None else kept.city
        # Outlines stand where the base's buildings do.
        hints = PlaceHints(
            *(request.axes, request.latitude, request.longitude, is_land, like),
            find_ground=None if like is None else lambda _: ground_of_feet(kept.city),
            heights=HeightHints(request.height, request.default_height),
        )
        city = read_city(
            [path], unit=conventions[0], up=conventions[1], orient=request.orient, hints=hints
        )
        if change.local:
            city = place_local(city, kept.scene.site, kept.city.grid)
        _check_distance(path, city, kept.city)
        added.append(city)
    return CityChange(change.remove, change.move, change.raised, tuple(added))


def _check_distance(path, city, base):
    """Raise an error if a city to be added stands far from the other one."""
    low, high = (
        base.points[:, :2].min(axis=0) - ELSEWHERE,
        base.points[:, :2].max(axis=0) + ELSEWHERE,
    )
    places = [
        city.points[:, :2],
        *(tree.place[None, :2] for tree in city.trees if tree.place is not None),
    ]
    middle = np.median(np.concatenate(places), axis=0)
    if not ((middle >= low) & (middle <= high)).all():
        away = np.hypot(*(middle - 0.5 * (low + high))) / 1000
        raise InputError(
            path,
            f"stands {away:,.0f} km from the base, or names no coordinate reference system",
            "add --local if it is in metres from the local origin of the base",
        )


def _write_albedos(place, source, city, albedo_of):
    """Write an albedo file with the lines of another one, and the albedos of some buildings: its
    path.

    Raises
    ------
    InputError
        A building is unknown.
    """
    unknown = [name for name in albedo_of if name not in set(city.building_id)]
    if unknown:
        raise InputError(
            unknown[0],
            "no building of the city has this id",
            "take ids from the column building_id",
        )
    own = pd.DataFrame(
        {"surface": city.surface_id, "albedo": pd.Series(city.building_id).map(albedo_of)}
    ).dropna()
    tables = [own]
    if source is not None:
        given = pd.read_csv(source, dtype=str, encoding="utf-8-sig")
        tables = [given.assign(surface=given["surface"].map(id_of_cell, na_action="ignore")), own]
    path = place / "albedo.csv"
    pd.concat(tables).drop_duplicates("surface", keep="last").to_csv(
        path, index=False, encoding="utf-8"
    )
    return str(path)
