"""What a run writes: tables, pictures, summary, and files for other programs."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..accuracy.measure_effects import state_effects
from ..city.building_facts import tell_facts
from ..city.grid_cells import Outlines
from ..city.racks import drawn_city
from ..effects.table import TABLE
from ..energy.pv_system import build_system
from ..results.compare_runs import write_before
from ..results.describe_run import describe_edge
from ..results.exports import EXPORTS, RunResults
from ..results.transfer_file import write_transfer
from ..results.write_summary import summarise, write_summary
from ..results.write_tables import write_tables
from ..settings.errors import InputError, show_number
from .study import compute_energy
from .trace_part import bound_hours


@dataclass
class Output:
    """What a run writes beside its tables."""

    overwrite: bool = False  # replace the results in a folder that is not empty
    exports: tuple = ()  # of `core.results.exports.EXPORTS`, one or several
    # `draw(folder, scene, transfer, energy, note)` writes pictures of the results
    draw: Callable | None = None

    def __post_init__(self):
        """Take one export, or several.

        Raises
        ------
        InputError
            One is not listed.
        """
        self.exports = (self.exports,) if isinstance(self.exports, str) else tuple(self.exports)
        for name in self.exports:
            if name not in EXPORTS:
                raise InputError(
                    "exports", f"{name!r} is not known", f"give some of {', '.join(EXPORTS)}"
                )


def write_results(work, run, request, output, log):
    """Compute the Energy of a run, and write its tables and pictures: RunResults, with the city as
    its surfaces are cut.

    Parameters
    ----------
    work : Path
    run : RunResults
        Without energy, with the City as it was read.
    request : Request
    output : Output
    log : RunLog
    """
    city, scene, transfer, _, weather = run
    city = drawn_city(city, scene, request.grid_size)
    outlines, facts = Outlines.of(city, scene.surfaces, scene.site), tell_facts(city)
    transfer = replace(transfer, outlines=outlines, facts=facts)
    keep = not transfer.on_disk or bool({"transfer", "editable"} & set(output.exports))
    energy = write_energy(work, transfer, weather, request, log, keep=keep)
    if output.draw:
        log.write("Blender")
        output.draw(work, scene, transfer, energy, weather.label)
        log.clock.lap("Blender")
    return RunResults(city, scene, transfer, energy, weather)


def write_energy(work, transfer, weather, request, log, *, keep=True):
    """Compute the Energy of a Transfer and write its tables, and transfer.nc if `keep`: Energy."""
    log.write("Electricity")
    if note := note_windows(request):
        log.write(f"  {note}")
    energy = compute_energy(transfer, weather, request, log.progress)
    log.clock.lap("electricity")
    write_tables(work, transfer, energy, weather, request, progress=log.progress)
    if transfer.base is not None:
        # Hours of the city before its edit, by light that was solved again.
        before = compute_energy(transfer.base, weather, replace(request, series=()))
        write_before(work, transfer.base.surfaces.surface_id, before)
    if keep:
        write_transfer(work / "transfer.nc", transfer, log.progress)
    else:
        log.write(
            f"transfer.nc would have {transfer.visible_share.shape[1]:,} suns for each surface: "
            "not written"
        )
        log.write("  (--transfer writes it)")
    log.clock.lap("write tables")
    return energy


def write_run(work, results, request, log, tiles=None, *, beside=None):
    """Measure what effects of the modules and the sky's model change, and write summary.json: its
    totals.

    `beside` are further sections of it.
    """
    _, scene, transfer, energy, weather = results
    summary = summarise(transfer, energy, weather, request, scene=scene, seconds=log.clock.seconds)
    shares = state_effects(
        summary, transfer, weather, build_system(request), sky=energy.sky, threads=request.threads
    )
    if shares:
        told = (
            f"{TABLE[key].title.lower()} {show_number(100 * share, 1, plus=True)} %"
            for key, share in shares.items()
        )
        log.write(f"  in full load hours: {', '.join(told)}")
    if words := describe_edge(summary):
        log.write(f"  {words}")
    log.clock.lap("shares of effects")
    if tiles:
        summary["tiles"] = _state_bound(tiles, transfer, energy, weather)
        log.write(f"  {describe_bound(summary['tiles'])}")
    write_summary(work / "summary.json", summary | (beside or {}))
    return summary["totals"]


def _state_bound(tiles, transfer, energy, weather):
    """Figures of the tiles with what they leave out at most, in percent of the eligible surfaces'
    irradiation: dict.
    """
    chosen = energy.eligible & np.isfinite(energy.poa_global_annual)
    area = transfer.surfaces.area[chosen]
    hours = len(weather.data) / energy.years
    mean = (
        1000 * float(np.average(energy.poa_global_annual[chosen], weights=area)) / hours
        if area.any()
        else 0.0
    )
    mean /= weather.interval.total_seconds() / 3600
    bound = bound_hours(
        tiles["left_out"], transfer.record.brightest_albedo, weather, energy.sky, mean
    )
    return tiles | {
        "bound": bound,
        "unit": f"{tiles['unit']}; bound in percent of the irradiation on surfaces with modules",
    }


def describe_bound(tiles):
    """What the tiles leave out, as a line of text."""
    if tiles["bound"] is None:
        beyond = "no bound is known for what lies beyond"
    else:
        beyond = f"what lies beyond changes at most {tiles['bound']:.2f} % of the irradiation"
    reach = (
        f"up to {tiles['near']:,.0f} m in full, and what rises above 2° up to "
        f"{tiles['farthest']:,.0f} m"
    )
    return f"surroundings of the tiles: {reach}; {beyond}"


def note_windows(request):
    """What a share of facades does to bands of windows, where modules lie in rows: str; "" if
    nothing.
    """
    if request.layout == "area" or "facade" not in request.usable:
        return ""
    if request.window_band is None:
        return (
            "--usable gives a share of facades, which stood for windows: no bands of windows are "
            "kept free beside it (--window-band 1.4 keeps them, and both multiply)"
        )
    return "--usable and --window-band are both given: the share is taken of what windows leave"
