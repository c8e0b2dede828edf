"""Solar city: from a file to full load hours, legend and totals with one button, with a first look
by few rays.
"""

from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue

import bpy

from ...core.read.formats import DROPPED
from ...core.settings.errors import InputError
from ...core.settings.progress import CancelledError, silent
from ...core.weather.formats import suffixes_of_weather
from ..city.keys import Key
from ..city.read_settings import remember_step
from ..city.run_step import Step
from ..city.session import Session, find_city
from .ask_place import ask_place
from .classify_city import ClassifyCity
from .compute_energy import WeighEnergy
from .import_city import CityFiles, ImportCity, show_import
from .trace_city import TraceCity, keep_light, read_goal, show_round, stages_of_trace, work_of_trace

STAGE = "first look"
FOLDER = Path(__file__).parents[2] / "examples" / "berlin"
CITY = "berlin_3910_5817.gml"


class SolarCity(CityFiles, Step, bpy.types.Operator):
    """Import the city, classify its surfaces, trace the light and compute full load hours, as set
    below.

    Each result is shown as soon as it is there: the buildings, their kinds, a first look at full
    load hours by few rays, then the hours by all rays"""

    bl_idname, bl_label = "citypv.solar_city", "Solar city"

    whole = True

    def invoke(self, context, event):
        """Start in the background; OBJ files have no place, so it is asked for."""
        path = self.filepath or context.scene.citypv.city_path
        plain = path.lower().removesuffix(".gz").endswith(".obj")
        if (
            plain
            and Step.current is None
            and ask_place(context, "solar_city", filepath=self.filepath, upward=True)
        ):
            return {"CANCELLED"}
        return super().invoke(context, event)

    def prepare(self, context):
        """Read paths and settings."""
        if context.scene.citypv.albedo_source == "materials":
            raise InputError(
                "Albedo",
                "the faces have no materials before the city is imported",
                "choose another source of albedo in step Trace, or run the steps one by one",
            )
        paths, request = CityFiles.prepare(self, context)
        read_goal(context.scene.citypv_seeing, request)
        look = settings_of_look(request) if self.watched else None
        self._found, self.kept = SimpleQueue(), []
        light = stages_of_trace(request)
        if light is not None:  # it takes most of the time
            shares = {
                name: 0.03 * share
                for name, share in (ImportCity.stages | ClassifyCity.stages).items()
            }
            first = (
                {f"{STAGE}: {name}": share for name, share in stages_of_trace(look).items()}
                if look
                else {}
            )
            shares |= {name: share / sum(light.values()) for name, share in (first | light).items()}
            self.stages = shares | {"electricity": 0.05}
        return paths, request, look, self._found

    @staticmethod
    def work(task, progress):
        """Run the steps of core, one after the other; leave what each of them finds in a queue."""
        paths, request, look, found = task
        imported = ImportCity.work((paths, request), progress)
        found.put(("buildings", imported))
        session = Session(city=imported[0], imported=imported[0])
        _, *classified = ClassifyCity.work((session, None, request), progress)
        found.put(("kinds", classified))
        session, *_ = classified
        if look:
            seen = _trace_and_weigh(
                session, look, lambda stage, *told: progress(f"{STAGE}: {stage}", *told), found
            )
            if seen[0][1].transfer.record.interrupted:
                raise CancelledError  # nothing of it is kept
            found.put((STAGE, seen))
        return _trace_and_weigh(session, request, progress, found)

    def refine(self, context):
        """Show the next result, or the next round of the trace."""
        if self._found.empty():
            return
        name, result = self._found.get()
        if name == "buildings":
            show_import(context, *result)
            self._session = Session.of(find_city(context.scene)[0])
        elif name == "kinds":
            ClassifyCity.finish(self, context, (self._session, *result))
        elif name == "rounds":
            show_round(context, *result)
        else:  # the light of a first look is still to be traced
            self._show_light(context, *result)
            city, _ = result[0][0].find_city(context.scene)
            city[Key.INTERRUPTED] = (
                "First look, by 16 rays, 4 shadow points and 4 days. Trace light computes it as "
                "set in its step"
            )
            for step in ("trace", "energy"):
                city.pop(Key.ASKED + step, None)
        self.kept.append(name)

    def finish(self, context, result):
        """Show what the steps show, in their order."""
        while not self._found.empty():
            self.refine(context)
        return self._show_light(context, *result)

    def _show_light(self, context, traced, weighed):
        keep_light(context, *traced)
        remember_step(traced[0].find_city(context.scene)[0], "trace", context.scene.citypv)
        return WeighEnergy.finish(self, context, (traced[0], *weighed[1:]))


def settings_of_look(request):
    """Request of a look at a city, or None where tracing as asked for takes hardly longer."""
    look = replace(
        request,
        samples=16,
        shadow_samples=4,
        suns="days:4",
        estimator="gather",
        target_error=None,
        time_budget=None,
    )
    # A trace must have twice its work for a look before it.
    worth = request.estimator == "forward" or sum(work_of_trace(request)) > 2 * sum(
        work_of_trace(look)
    )
    return look if worth else None


def _trace_and_weigh(session, request, progress, found):
    """What `TraceCity.work` and `WeighEnergy.work` find of a session's scene; if cancelled, of the
    suns kept.
    """
    traced = TraceCity.work((session, request, [], found), progress)
    transfer = traced[1].transfer
    telling = silent if transfer.record.interrupted else progress
    return traced, WeighEnergy.work((replace(session, transfer=transfer), None, request), telling)


class BerlinExample(bpy.types.Operator):
    """Run Solar city on the bundled square kilometre of Berlin with its weather of 2017 (ERA5)"""

    bl_idname, bl_label = "citypv.berlin_example", "Berlin example"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The example is there."""
        cls.poll_message_set(
            "The example is not part of this installation: it is the folder examples/berlin"
        )
        return (FOLDER / CITY).is_file()

    def execute(self, context):
        """Choose its files, and run *Solar city*."""
        settings = context.scene.citypv
        settings.city_path, settings.own_place = str(FOLDER / CITY), False
        settings.weather, settings.weather_file = "file", str(FOLDER / "era5_berlin_2017.nc")
        return bpy.ops.citypv.solar_city("INVOKE_DEFAULT")


class DropWeather(bpy.types.Operator):
    """Use a weather file, and compute the energy anew if the city is traced"""

    bl_idname, bl_label = "citypv.drop_weather", "Use weather"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"})

    def execute(self, context):
        """Choose the file, then run the step Energy."""
        settings = context.scene.citypv
        settings.weather, settings.weather_file = "file", self.filepath
        if bpy.ops.citypv.energy.poll():
            bpy.ops.citypv.energy("INVOKE_DEFAULT")
        return {"FINISHED"}


class _DropSetting:
    """Base of operators that use a dropped file as a setting; the step that it belongs to shows
    that it is stale.
    """

    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"})
    settings = ("", {})  # setting that takes the file, and what others have to be

    def execute(self, context):
        """Choose the file."""
        name, others = self.settings
        for key, value in {name: self.filepath, **others}.items():
            setattr(context.scene.citypv, key, value)
        self.report({"INFO"}, f"{self.bl_label}: {Path(self.filepath).name}")
        return {"FINISHED"}


class DropTerrain(_DropSetting, bpy.types.Operator):
    """Use a file of heights as the ground of the city; Classify lays it"""

    bl_idname, bl_label = "citypv.drop_terrain", "Use terrain"
    settings = ("terrain", {"ground": "terrain"})


class DropHorizon(_DropSetting, bpy.types.Operator):
    """Use a file of heights or angles as the distant horizon of the next trace"""

    bl_idname, bl_label = "citypv.drop_horizon", "Use horizon"
    settings = ("horizon", {})


class DropAlbedo(_DropSetting, bpy.types.Operator):
    """Use a table of albedos in the next trace"""

    bl_idname, bl_label = "citypv.drop_albedo", "Use albedo"
    settings = ("albedo_file", {"albedo_source": "file"})


class _OverView:
    """Base of what a file may be dropped on: a 3D view."""

    @classmethod
    def poll_drop(cls, context):
        """Over a 3D view."""
        return context.area is not None and context.area.type == "VIEW_3D"


class CityHandler(_OverView, bpy.types.FileHandler):
    """Dropping a city on a 3D view runs *Solar city*."""

    bl_idname, bl_label = "CITYPV_FH_city", "Solar city (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.solar_city", ";".join(DROPPED)


class WeatherHandler(_OverView, bpy.types.FileHandler):
    """Dropping a weather file on a 3D view uses it."""

    bl_idname, bl_label = "CITYPV_FH_weather", "Weather (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.drop_weather", ";".join(suffixes_of_weather())


class TerrainHandler(_OverView, bpy.types.FileHandler):
    """Dropping heights on a 3D view uses them as the ground of the city."""

    bl_idname, bl_label = "CITYPV_FH_terrain", "Terrain (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.drop_terrain", ".tif;.tiff;.asc"


class HorizonHandler(_OverView, bpy.types.FileHandler):
    """Dropping heights or angles on a 3D view uses them as the distant horizon."""

    bl_idname, bl_label = "CITYPV_FH_horizon", "Horizon (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.drop_horizon", ".tif;.tiff;.asc;.csv"


class AlbedoHandler(_OverView, bpy.types.FileHandler):
    """Dropping a table on a 3D view uses it as the albedo of surfaces."""

    bl_idname, bl_label = "CITYPV_FH_albedo", "Albedo (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.drop_albedo", ".csv"
