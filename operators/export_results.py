"""Export the results of a city: tables, a city model, a scene, a GeoPackage, or the report as a page."""

import tempfile
from dataclasses import replace
from pathlib import Path

import bpy

from ..core.settings.errors import InputError
from ..core.settings.progress import silent
from .run_step import Step
from .session import find_city, find_session

FORMATS = [  # identifier, name, description; the names of the files are those of the command line
    ("faces", "Surfaces (CSV)", "A row for each surface, as faces.csv"),
    ("groups", "Groups (CSV)", "Full load hours by kind, orientation, month and hour, as groups.csv"),
    ("buildings", "Buildings (CSV)", "A row for each building, as buildings.csv"),
    ("cityjson", "CityJSON", "The city as read with its results, as city.city.json"),
    ("gltf", "glTF", "The city in colours for any viewer, as city.glb"),
    ("geopackage", "GeoPackage", "Surfaces and buildings for GIS, as city.gpkg"),
    ("report", "Report", "Tables and pictures on one page, as report.html; opens in the browser"),
]
NAMES = {
    "faces": "faces.csv",
    "groups": "groups.csv",
    "buildings": "buildings.csv",
    "cityjson": "city.city.json",
    "gltf": "city.glb",
    "geopackage": "city.gpkg",
    "report": "report.html",
}
SHAPES = ("cityjson", "gltf", "geopackage")  # need the geometry of this session


class ExportResults(Step, bpy.types.Operator):
    """Write the results of the city to a file"""

    bl_idname = "citypv.export"
    bl_label = "Export"
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
    def poll(cls, context):
        """The energy was computed in this session."""
        cls.poll_message_set("Compute the energy first")
        session = find_session(find_city(context.scene)[0])
        return session is not None and session.energy is not None

    @classmethod
    def description(cls, context, properties):
        """Tooltip: what is written."""
        return next(words for name, _, words in FORMATS if name == properties.format)

    def invoke(self, context, event):
        """Ask where to write; start once it is known."""
        if self.filepath or bpy.app.background:
            return super().invoke(context, event)
        self.filepath, self.filter_glob = str(suggest_path(self.format)), f"*{Path(NAMES[self.format]).suffix}"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def prepare(self, context):
        """Take the results and the path."""
        session = find_session(find_city(context.scene)[0])
        if self.format in SHAPES and (session.city is None or session.scene is None):
            raise InputError(
                NAMES[self.format], "needs the geometry, which is not in this file", "import and trace again"
            )
        path = Path(bpy.path.abspath(self.filepath)) if self.filepath else suggest_path(self.format)
        if not path.parent.is_dir():
            raise InputError(path.parent, "there is no such folder", "choose another")
        return session, self.format, path

    @staticmethod
    def work(task, progress):
        """Write it."""
        session, name, path = task
        try:
            write_results(session, name, path, progress)
        except OSError as error:
            raise InputError(path, f"cannot be written ({error.strerror})", "choose another place") from error
        return name, path

    def finish(self, context, result):
        """Say where; open the page."""
        name, path = result
        if name == "report" and not bpy.app.background:
            bpy.ops.wm.url_open(url=path.as_uri())
        return f"Written: {path}"


def suggest_path(name):
    """Path for a format: beside the .blend file, else in the temporary folder."""
    folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path(bpy.app.tempdir or tempfile.gettempdir())
    return folder / NAMES[name]


def write_results(session, name, path, progress=silent):
    """Write the results of a session in one format.

    Parameters
    ----------
    session : Session
        With transfer, energy, weather and request.
    name : str
        Of `FORMATS`.
    path : Path
    progress : callable, optional
        See `core.progress`.

    Raises
    ------
    InputError
    """
    from ..core.commands.simulate import draw_city, write_exports
    from ..core.energy.pv_system import build_system
    from ..core.results.write_buildings import write_buildings
    from ..core.results.write_faces import write_faces
    from ..core.results.write_groups import write_groups

    transfer, energy, request = session.transfer, session.energy, session.request
    if name == "faces":
        write_faces(path, transfer, energy, monthly=request.monthly)
    elif name == "groups":
        write_groups(path, energy)
    elif name == "buildings":
        write_buildings(path, transfer, energy, build_system(request), monthly=request.monthly)
    elif name == "report":
        write_page(session, path, progress)
    else:
        with tempfile.TemporaryDirectory() as folder:
            city = draw_city(session.city, session.scene, request)
            results = city, session.scene, transfer, energy, session.weather
            write_exports(Path(folder), results, request, [name], progress)
            path.write_bytes(Path(folder, NAMES[name]).read_bytes())


def write_page(session, path, progress):
    """Write the report of `citypv plot` as one page; without pictures where matplotlib is missing."""
    from ..core.commands.simulate import draw_city
    from ..core.plots.read_results import read_results
    from ..core.plots.write_report import write_report
    from ..core.results.write_summary import summarise, write_summary
    from ..core.results.write_tables import write_tables
    from ..core.results.write_transfer import write_transfer
    from ..core.scene.outline_surfaces import outline_surfaces

    transfer, energy, weather, request = session.transfer, session.energy, session.weather, session.request
    if session.city is not None and session.scene is not None:
        city = draw_city(session.city, session.scene, request)
        transfer = replace(transfer, outlines=outline_surfaces(city, session.scene.surfaces, session.scene.site))
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder, path.stem)
        work.mkdir()
        write_tables(work, transfer, energy, weather, request, progress=progress)
        write_transfer(work / "transfer.nc", transfer, progress)
        write_summary(work / "summary.json", summarise(transfer, energy, weather, request, scene=session.scene))
        path.write_bytes(write_report(work, read_results(work)).read_bytes())
