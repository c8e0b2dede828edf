"""Export the results of a city: tables, a city model, a scene, a GeoPackage, or the report as a
page.
"""

import csv
import tempfile
from math import isfinite
from pathlib import Path

import bpy

from ...core.results.exports import MODELS, RunResults, write_exports
from ...core.settings.errors import InputError
from ...core.settings.progress import silent
from ..city.attributes import CHANGE_ERROR
from ..city.keep_transfer import OfEnergy
from ..city.keys import Key
from ..city.run_step import Step, refuse
from ..city.session import Session, find_city
from ..show.show_result import find_before

FILES = {  # identifier: the file's name, as on the command line; name and description in the menu
    "faces": ("faces.csv", "Surfaces (CSV)", "A row for each surface, as faces.csv"),
    "groups": (
        "groups.csv",
        "Groups (CSV)",
        "Full load hours by kind, orientation, month and hour, as groups.csv",
    ),
    "buildings": ("buildings.csv", "Buildings (CSV)", "A row for each building, as buildings.csv"),
    **{
        name: (file, title, f"{words[0].upper()}{words[1:]}, as {file}")
        for name, (file, words, title) in MODELS.items()
    },
    "changes": (
        "changes.csv",
        "Who gains and loses (CSV)",
        "A row for each building, before and after",
    ),
    "comparison": (
        "comparison.html",
        "Comparison",
        "Who gains and who loses on one page; opens in the browser",
    ),
    "report": (
        "report.html",
        "Report",
        "Tables and pictures on one page, as report.html; opens in the browser",
    ),
}
FORMATS = [(name, title, words) for name, (_, title, words) in FILES.items()]
# as `citypv compare` calls them
COMPARED = {
    "changes": "buildings.csv",
    "comparison": "report.html",
}


class ExportResults(OfEnergy, Step, bpy.types.Operator):
    """Write the results of the city to a file"""

    bl_idname, bl_label = "citypv.export", "Export"
    bl_options = {"REGISTER"}

    format: bpy.props.EnumProperty(name="Format", description="What is written", items=FORMATS)
    filepath: bpy.props.StringProperty(
        name="File",
        description="File to write; empty: beside the .blend file",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def description(cls, context, properties):
        """Tooltip: what is written."""
        return FILES[properties.format][2]

    def invoke(self, context, event):
        """Ask where to write, if there is something to write; start once it is known."""
        if self.filepath or bpy.app.background:
            return super().invoke(context, event)
        try:
            *_, path, _ = self.prepare(context)
        except InputError as error:
            return refuse(self, error)
        self.filepath, self.filter_glob = str(path), f"*{path.suffix}"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def prepare(self, context):
        """Take the results and the path: session, what it prepares besides, format, path, and the
        earlier state with the names of both.
        """
        (session, *kept), (city, _) = super().prepare(context), find_city(context.scene)
        # Models of the city need the geometry of this session.
        if self.format in MODELS and (session.city is None or session.scene is None):
            raise InputError(
                FILES[self.format][0],
                "needs the geometry, which is not in this file",
                "import and trace again",
            )
        # Comparisons need an earlier state with results.
        before = find_before(context.scene, city)
        earlier = Session.of(before)
        if self.format in COMPARED and (
            session.scene is None or earlier is None or earlier.energy is None
        ):
            raise InputError(
                city.name, "it is compared with nothing", "edit it, or keep a result as before"
            )
        # The path that was given, else a file beside the .blend file, or in the temporary folder
        # where that was never saved.
        folder = (
            Path(bpy.data.filepath).parent
            if bpy.data.filepath
            else bpy.app.tempdir or tempfile.gettempdir()
        )
        path = Path(bpy.path.abspath(self.filepath or str(Path(folder, FILES[self.format][0]))))
        # A folder that is not there is refused.
        if not path.parent.is_dir():
            raise InputError(path.parent, "there is no such folder", "choose another")
        # Names of both states, for the comparison's title.
        names = [
            str(item.get(Key.VARIANT, item.name)) for item in (before, city) if item is not None
        ]
        return session, kept, self.format, path, (earlier, names)

    @staticmethod
    def work(task, progress):
        """Write it."""
        session, kept, name, path, compared = task
        weighed = session.with_energy(*kept, progress)
        try:
            if name in COMPARED:
                _write_comparison(weighed, *compared, COMPARED[name], path)
            else:
                _write_results(weighed, name, path, progress)
        except OSError as error:
            raise InputError(
                path, f"cannot be written ({error.strerror})", "choose another place"
            ) from error
        return session, weighed, name, path

    def finish(self, context, result):
        """Keep the energy, and say where the file is; open the page."""
        session, weighed, name, path = result
        session.take_energy(weighed)
        if name in ("report", "comparison") and not bpy.app.background:
            bpy.ops.wm.url_open(url=path.as_uri())
        return f"Written: {path}"


def _write_results(session, name, path, progress=silent):
    """Write the results of a session in one format; the report is the one that `citypv plot`
    writes.

    Parameters
    ----------
    session : Session
        With transfer, energy, weather and request.
    name : str
        Of `FORMATS`.
    path : Path
    progress : callable, optional
        See `core.settings.progress`.

    Raises
    ------
    InputError
    """
    from ...core.city.racks import drawn_city

    scene, request = session.scene, session.request
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder, path.stem)
        work.mkdir()
        if name in MODELS:
            city = drawn_city(session.city, scene, request.grid_size)
            run = RunResults(city, scene, session.transfer, session.energy, session.weather)
            write_exports(work, run, [name], progress)
        else:
            _write_state(work, session, progress)
        if name == "report":  # without pictures where matplotlib is missing
            from ...core.results.read_results import read_results
            from ...core.results.write_report import write_report

            write_report(work, read_results(work))
        path.write_bytes((work / FILES[name][0]).read_bytes())


def _write_state(work, session, progress=silent, **beside):
    """Write tables and summary of a session to a folder, with shapes where they are known;
    `beside`: to the summary.
    """
    from ...core.results.write_summary import summarise, write_summary
    from ...core.results.write_tables import write_tables

    scene, transfer, energy, request = (
        session.scene,
        session.transfer,
        session.energy,
        session.request,
    )
    write_tables(work, transfer, energy, session.weather, request, progress=progress)
    summary = summarise(transfer, energy, session.weather, request, scene=scene)
    write_summary(work / "summary.json", summary | beside)


def _write_comparison(session, earlier, names, file, path):
    """Write a file of `citypv compare`, with the errors of the rays that both states share.

    Parameters
    ----------
    session, earlier : Session
        After and before.
    names : list of two str
        Of the states, before and after.
    file : str
        As `citypv compare` calls it.
    path : Path
    """
    from ...core.results.compare import compare
    from ...core.results.compare_runs import CHANGE, mark_of

    with tempfile.TemporaryDirectory() as folder:
        before, after = (Path(folder, f"{number}", name) for number, name in enumerate(names))
        for work in (before, after):
            work.mkdir(parents=True)
        _write_state(before, earlier)
        shared = session.change is not None and session.change[0] is earlier.base
        _write_state(
            after, session, **({"variant": {"base_crc32": mark_of(before)}} if shared else {})
        )
        if shared:
            known = [(name, error) for name, error in session.change[1].items() if isfinite(error)]
            with (after / CHANGE).open("w", encoding="utf-8", newline="") as table:
                csv.writer(table).writerows([("surface_id", CHANGE_ERROR), *known])
        compare(before, after, Path(folder, "compared"))
        path.write_bytes(Path(folder, "compared", file).read_bytes())
