"""The part of `simulate` that traces a city in tiles, and says what this leaves out."""

import numpy as np

from ..cluster.run_tasks import drop_kept, keeping, kept_beside
from ..cluster.trace_part import bound_hours
from ..cluster.trace_tiles import check_cluster_settings, plan_tiles, trace_tiles
from ..study import prepare_study

__all__ = ["add_bound", "check_cluster_settings", "drop_kept", "kept_beside", "prepare_run", "trace_in_tiles"]


def prepare_run(scene, weather, request, cluster, log):
    """What tracing a city calls for, in tiles if `cluster` is given: PreparedScene."""
    if cluster is None:
        return prepare_study(scene, weather, request)
    return plan_tiles(scene, weather, request, cluster, log.write)


def trace_in_tiles(prepared, weather, request, settings, log, *, folder):
    """Transfer of a city, and the figures of its tiles.

    Parameters as of `cluster.trace_tiles.trace_tiles`; finished tiles are kept in `folder` when it ends with an error.
    """
    with keeping(folder, log.write):
        return trace_tiles(
            prepared,
            weather,
            request,
            settings,
            folder,
            progress=log.progress,
            tell=lambda line: log.write(f"  {line}"),
        )


def add_bound(summary, tiles, transfer, energy, weather):
    """Add the figures of the tiles to the summary, and tell what they leave out: str."""
    summary["tiles"] = state_bound(tiles, transfer, energy, weather)
    return describe_bound(summary["tiles"])


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
