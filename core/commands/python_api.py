"""CityPV in Python: the functions of the package `citypv`, with the settings, checks and files of
the command line.

result = citypv.simulate("berlin.gml", weather="era5.nc", preset="draft")
result.faces, result.groups, result.buildings, result.timeseries, result.summary
"""

import html
import importlib.util
import shutil
import tempfile
import weakref
from contextlib import contextmanager
from dataclasses import fields
from functools import cached_property
from pathlib import Path

from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import declared_settings
from .choose_settings import cluster_settings, request_of_settings, take_paths
from .describe_settings import list_settings


class Result:
    """Results of a run: the files of its folder, each read when it is asked for.

    Parameters
    ----------
    folder : path-like
        Of `simulate`, or of the command line.
    temporary : bool
        Whether the folder above it is deleted with this object.
    """

    def __init__(self, folder, *, temporary=False):
        self.folder = Path(folder)
        if temporary:
            weakref.finalize(self, shutil.rmtree, self.folder.parent, ignore_errors=True)

    @cached_property
    def faces(self):
        """Surfaces, a row each: pandas.DataFrame of faces.csv; `eligible` is bool."""
        table = self._read("faces.csv")
        return table.assign(eligible=table["eligible"] == "true")

    @cached_property
    def groups(self):
        """Groups of surfaces by kind and orientation, a row for each period: pandas.DataFrame of
        groups.csv.
        """
        return self._read("groups.csv")

    @cached_property
    def buildings(self):
        """Buildings, a row each: pandas.DataFrame of buildings.csv."""
        return self._read("buildings.csv")

    @cached_property
    def districts(self):
        """Sums by district, of a run that was given `districts`, the last row of what lies in none:
        pandas.DataFrame of districts.csv.
        """
        return self._read("districts.csv")

    @cached_property
    def timeseries(self):
        """Capacity factors of the groups at each time: xarray.Dataset of timeseries.nc."""
        import xarray

        from ..read.netcdf_file import rename_groups

        return rename_groups(xarray.load_dataset(self.folder / "timeseries.nc", engine="h5netcdf"))

    @cached_property
    def summary(self):
        """Settings, totals, errors and versions of the run: dict of summary.json."""
        from ..results.read_results import read_summary

        return read_summary(self.folder / "summary.json")

    def save(self, folder, *, overwrite=False):
        """Copy the results to a folder: Result of it.

        Raises
        ------
        InputError
            The folder is not empty and `overwrite` is False, or cannot be written.
        """
        from ..results.output_folder import copy_results

        copy_results(self.folder, folder, overwrite)
        return Result(folder)

    @list_settings("surfaces", "weather", "electricity", "sky", "effects", "run")
    def with_weather(self, weather, *, out=None, overwrite=False, progress=silent, **settings):
        """Compute the electricity of this light in another weather: Result. Module, system and sky
        stay as they were unless given.

        Parameters
        ----------
        weather : str, path-like or list
        out, overwrite, progress, **settings
            As in `simulate`.

        Raises
        ------
        InputError
            There is no transfer.nc, or a setting cannot be used.
        """
        from ..energy.pv_system import ELECTRIC
        from ..run.run_log import RunLog
        from ..run.simulate import recompute

        path, before = self.folder / "transfer.nc", self.summary["settings"]
        if not path.exists():
            raise InputError(
                path, "the run wrote no light to weigh again", 'simulate with exports=("transfer",)'
            )
        # Another weather leaves these groups of settings as they are.
        known = {name for name, *_ in declared_settings("surfaces", "electricity", "sky")}
        kept = {name: value for name, value in before.items() if name in known}
        effects = {key: on for key, on in before.get("effects", {}).items() if key in ELECTRIC}
        request = request_of_settings({**kept, "effects": effects, **settings, "weather": weather})
        with _folder_for(out) as folder:
            log = RunLog(None, progress)
            recompute(path, folder, request, overwrite=overwrite, log=log)
            return Result(folder, temporary=out is None)

    def variant(self, *, out=None, overwrite=False, exports=(), progress=silent, **change):
        """Edit the city and trace what the edit changes, from what its rays met: Result.

        Parameters
        ----------
        out, overwrite, exports, progress
            As in `simulate`; with "editable" among the exports it can be edited again.
        **change
            Fields of `variant.Change`: add (files), remove (ids), move {id: (east, north)} [m],
            raised {id: metres}, albedo_of {id: albedo}, local, private.

        Raises
        ------
        InputError
            The run was not made with exports=("editable",), or the change cannot be used.
        """
        from ..run.run_log import RunLog
        from ..run.variant import Change, make_variant
        from ..run.write_run import Output

        unknown = set(change) - {field.name for field in fields(Change)}
        if unknown:
            words = ", ".join(field.name for field in fields(Change))
            raise InputError(sorted(unknown)[0], "is no change of a city", f"give some of {words}")
        with _folder_for(out) as folder:
            output = Output(overwrite=overwrite, exports=exports)
            make_variant(
                self.folder, folder, Change(**change), output=output, log=RunLog(None, progress)
            )
            return Result(folder, temporary=out is None)

    def plot(self, *, title="", attribution="", language="en", districts=None, private=False):
        """Write report.html into the folder: its path.

        Parameters
        ----------
        title : str
            Heading of the page; by default with the name of the folder.
        attribution : str
            Source and licence of the city model; by default as its files say.
        language : str
            Of texts and numbers: "en" or "de".
        districts : str
            FILE or FILE:COLUMN of districts; by default those that the run was given.
        private : bool
            Leave out names and addresses of buildings.
        """
        from .show import plot_results

        words = {"title": title, "attribution": attribution, "language": language}
        return plot_results(self.folder, **words, districts=districts, private=private)[0]

    def _read(self, name):
        from ..results.read_results import read_run_table

        return read_run_table(self.folder / name)

    def __repr__(self):
        from ..results.read_results import kind_title

        totals = self.summary["totals"]
        kinds = (
            f"{kind_title(kind).lower()} {total['full_load_hours']:.0f} h"
            for kind, total in totals["kinds"].items()
            if total["kwp"] > 0
        )
        return (
            f"<citypv.Result {self.folder}: {totals['kwp']:,.0f} kWp, "
            f"{totals['mwh_per_year']:,.0f} MWh a year\n"
            f"  {', '.join(kinds) or 'no surface carries modules'}\n"
            f"  weather: {self.summary['weather']['label']}\n"
            "  .faces, .groups, .buildings, .timeseries, .summary; .plot(), .with_weather(), "
            ".variant(), .save()>"
        )

    def _repr_html_(self):
        """The roofs from above, where matplotlib and outlines are there, and groups, for
        notebooks.
        """
        from ..results.read_results import read_results as read_folder

        annual, found, image = (
            self.groups[self.groups["period"] == "annual"],
            read_folder(self.folder),
            "",
        )
        if importlib.util.find_spec("matplotlib") is not None and found.outlines is not None:
            from ..results.draw_plan import embed_plan

            picture = embed_plan(found)
            image = f'<img alt="Full load hours from above" style="max-width:30em" src="{picture}">'
        return (
            f"<div><pre>{html.escape(repr(self))}</pre>{image}{annual.to_html(index=False)}</div>"
        )


@contextmanager
def _folder_for(out):
    """A folder for results: the one that is given, or one that a Result deletes; deleted here after
    an error.
    """
    if out is not None:
        yield Path(out)
        return
    place = tempfile.mkdtemp(prefix="citypv-")
    try:
        yield Path(place, "results")
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        raise


@list_settings()
def simulate(
    city,
    *,
    out=None,
    overwrite=False,
    exports=(),
    cluster=None,
    tile=None,
    progress=silent,
    **settings,
):
    """Trace a city and compute its full load hours.

    Parameters
    ----------
    city : path-like or list of path-like
        CityGML, CityJSON or OBJ files, or folders of them.
    out : path-like, optional
        Folder to write; by default one that is deleted with the Result.
    overwrite : bool
        Replace results in a folder that is not empty.
    exports : str or collection of str
        Of transfer (even where it is large), cityjson, gltf and geopackage: files to write as well.
    cluster : str, optional
        Trace in tiles: "serial", "local:N" or the address of a Dask scheduler.
    tile : float, optional
        Side of the tiles [m].
    progress : callable, optional
        Called with stage, done, total and unit.
    **settings
        As the options of ``citypv simulate``, with underscores: weather, preset, target_error …

    Returns
    -------
    Result

    Raises
    ------
    InputError
        A setting does not exist or cannot be used, or a file is invalid.
    KeyboardInterrupt, CancelledError
        Interrupted before there was anything to keep.
    """
    from ..run.run_log import RunLog
    from ..run.simulate import simulate as run
    from ..run.write_run import Output

    paths = take_paths(city)
    others = "out", "overwrite", "exports", "cluster", "tile", "progress"
    request = request_of_settings(settings, others=others)
    with _folder_for(out) as folder:
        output = Output(overwrite=overwrite, exports=exports)
        log, tiles = RunLog(None, progress), cluster_settings(cluster, tile)
        run(paths, folder, request, output=output, log=log, cluster=tiles)
        return Result(folder, temporary=out is None)


def read_results(folder):
    """Results of an earlier run: Result.

    Raises
    ------
    InputError
        A file is missing, cannot be read, or belongs to another run than the others.
    """
    from ..results.read_results import read_results as read_folder

    read_folder(folder)
    return Result(folder)


def compare(before, after, *, out=None, overwrite=False):
    """Who gains and who loses between two states of a city: Comparison, with surfaces, buildings
    and summary.

    Parameters
    ----------
    before, after : Result or path-like
    out : path-like, optional
        Folder for tables and a page with maps.
    overwrite : bool
    """
    from ..results.compare import compare as write_comparison
    from ..results.compare_runs import compare_folders

    folders = [
        folder.folder if isinstance(folder, Result) else folder for folder in (before, after)
    ]
    if out is not None:
        return write_comparison(*folders, out, overwrite=overwrite)
    return compare_folders(*folders)


@list_settings("city", "surfaces")
def inspect(city, **settings):
    """What is read of a city, repaired and left out, and where it is: dict, as ``citypv inspect
    --json``.
    """
    from .inspect_city import inspect_city

    return inspect_city(take_paths(city), request_of_settings(settings, "city", "surfaces"))


@list_settings("weather", "electricity", "sky", "run")
def world(environments, *, out=None, overwrite=False, cluster=None, progress=silent, **settings):
    """Full load hours of traced districts at every place of a weather grid.

    Parameters
    ----------
    environments : list of str
        As of ``citypv world``: results of ``suns="sky-grid:N"``, NAME=PATH, or unshaded.
    out : path-like, optional
        Folder to write, with pictures; by default none is kept.
    overwrite, cluster, progress
        As in `simulate`.
    **settings
        As the options of ``citypv world``, with underscores.

    Returns
    -------
    xarray.Dataset
        Of world.nc.
    """
    import xarray

    from ..run.make_world import WorldSettings, make_world
    from ..run.run_log import RunLog

    own = {field.name for field in fields(WorldSettings)}
    chosen = {name: value for name, value in settings.items() if name in own} | (
        {} if out else {"pictures": False}
    )
    others = {name: value for name, value in settings.items() if name not in own}
    request = request_of_settings(others, "weather", "electricity", "sky", "run", others=own)
    texts = (
        [environments]
        if isinstance(environments, str)
        else [str(environment) for environment in environments]
    )
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place, "world") if out is None else Path(out)
        told = {"log": RunLog(None, progress), "cluster": cluster_settings(cluster)}
        make_world(texts, folder, request, WorldSettings(**chosen), overwrite=overwrite, **told)
        return xarray.load_dataset(folder / "world.nc", engine="h5netcdf")
