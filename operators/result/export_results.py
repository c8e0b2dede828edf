"""Export the results of a city: tables, a city model, a scene, a GeoPackage, or the report as a page."""

import tempfile
from dataclasses import replace
from pathlib import Path

import bpy

from ...core.errors import InputError
from ...core.progress import silent
from ..run_step import OfCity, Step
from ..session import find_city, find_session

FILES = {  # identifier: the file's name, as on the command line; name and description in the menu
    "faces": ("faces.csv", "Surfaces (CSV)", "A row for each surface, as faces.csv"),
    "groups": ("groups.csv", "Groups (CSV)", "Full load hours by kind, orientation, month and hour, as groups.csv"),
    "buildings": ("buildings.csv", "Buildings (CSV)", "A row for each building, as buildings.csv"),
    "cityjson": ("city.city.json", "CityJSON", "The city as read with its results, as city.city.json"),
    "gltf": ("city.glb", "glTF", "The city in colours for any viewer, as city.glb"),
    "geopackage": ("city.gpkg", "GeoPackage", "Surfaces and buildings for GIS, as city.gpkg"),
    "report": ("report.html", "Report", "Tables and pictures on one page, as report.html; opens in the browser"),
}
FORMATS = [(name, title, words) for name, (_, title, words) in FILES.items()]
SHAPES = ("cityjson", "gltf", "geopackage")  # need the geometry of this session


class ExportResults(OfCity, Step, bpy.types.Operator):
    """Write the results of the city to a file"""

    bl_idname = "citypv.export"
    bl_label = "Export"
    bl_options = {"REGISTER"}
    needs, lacking = "energy", "Compute the energy first"

    format: bpy.props.EnumProperty(name="Format", description="What is written", items=FORMATS)
    filepath: bpy.props.StringProperty(
        name="File", description="File; empty: beside the .blend file", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def description(cls, context, properties):
        """Tooltip: what is written."""
        return FILES[properties.format][2]

    def invoke(self, context, event):
        """Ask where to write; start once it is known."""
        if self.filepath or bpy.app.background:
            return super().invoke(context, event)
        self.filepath, self.filter_glob = str(suggest_path(self.format)), f"*{Path(FILES[self.format][0]).suffix}"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def prepare(self, context):
        """Take the results and the path."""
        session = find_session(find_city(context.scene)[0])
        if self.format in SHAPES and (session.city is None or session.scene is None):
            problem = "needs the geometry, which is not in this file"
            raise InputError(FILES[self.format][0], problem, "import and trace again")
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
    return folder / FILES[name][0]


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
    from ...core.commands.simulate import draw_city, write_exports
    from ...core.energy.pv_system import build_system
    from ...core.results.write_buildings import write_buildings
    from ...core.results.write_faces import write_faces
    from ...core.results.write_groups import write_groups

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
            path.write_bytes(Path(folder, FILES[name][0]).read_bytes())


def write_page(session, path, progress):
    """Write the report of `citypv plot` as one page; without pictures where matplotlib is missing."""
    from ...core.commands.simulate import draw_city
    from ...core.plots.read_results import read_results
    from ...core.plots.write_report import write_report
    from ...core.results.write_summary import summarise, write_summary
    from ...core.results.write_tables import write_tables
    from ...core.results.write_transfer import write_transfer
    from ...core.scene.outline_surfaces import outline_surfaces

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
