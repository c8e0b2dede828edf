"""All tables of a run."""

from functools import partial

from ..energy.pv_system import build_system
from .write_buildings import write_buildings
from .write_faces import write_faces
from .write_groups import write_groups
from .write_series import write_series
from .write_timeseries import write_timeseries


def write_tables(folder, transfer, energy, weather, request, *, progress):
    """Write faces.csv, groups.csv, buildings.csv, timeseries.nc and, if requested, series.csv.

    Parameters
    ----------
    folder : pathlib.Path
    transfer : Transfer
    energy : Energy
    weather : Weather
    request : Request
    progress : callable
        See `core.progress`; counts files.
    """

    def report_faces(share):
        progress("writing tables", share, len(tables), "files")

    system, monthly = build_system(request), request.monthly
    tables = {
        "faces.csv": partial(write_faces, transfer=transfer, energy=energy, report_share=report_faces, monthly=monthly),
        "groups.csv": partial(write_groups, energy=energy),
        "buildings.csv": partial(write_buildings, transfer=transfer, energy=energy, system=system, monthly=monthly),
        "timeseries.nc": partial(write_timeseries, energy=energy, weather=weather),
    }
    if energy.series is not None:
        tables["series.csv"] = partial(write_series, transfer=transfer, energy=energy)
    report_faces(0)
    for number, (name, write) in enumerate(tables.items()):
        write(folder / name)
        progress("writing tables", number + 1, len(tables), "files")
