"""Solar city: from a file to full load hours, legend and totals with one button."""

import bpy

from ..core.errors import InputError
from ..core.progress import silent
from .city_files import CityFiles
from .classify_city import ClassifyCity, check_place
from .compute_energy import WeighEnergy
from .import_city import ImportCity, show_import
from .refine_trace import read_goal
from .run_step import Step
from .session import Session, find_city, find_session
from .trace_city import TraceCity


class SolarCity(CityFiles, Step, bpy.types.Operator):
    """Import the city, classify its surfaces, trace the light and compute full load hours, as set below"""

    bl_idname = "citypv.solar_city"
    bl_label = "Solar city"
    bl_options = {"REGISTER", "UNDO"}

    whole = True

    def prepare(self, context):
        """Read paths and settings."""
        if context.scene.citypv.albedo_source == "materials":
            cure = "choose another source of albedo in step Trace, or run the steps one by one"
            raise InputError("Albedo", "the faces have no materials before the city is imported", cure)
        paths, request = ImportCity.prepare(self, context)
        read_goal(context.scene.citypv_seeing, request)
        return paths, request

    def expect(self, task):
        """Stages of all steps; light takes most of the time."""
        light = TraceCity.expect(None, (None, task[1], None))
        if light is None:
            return None
        whole = sum(light.values())
        before = {name: 0.02 * share * whole for name, share in (ImportCity.stages | ClassifyCity.stages).items()}
        return before | light | {"electricity": 0.05 * whole}

    @staticmethod
    def work(task, progress):
        """Run the steps of core, one after the other."""
        paths, request = task
        imported = ImportCity.work((paths, request), progress)
        session = Session(city=imported[0])
        check_place(session.city, request)
        _, session.scene, findings = ClassifyCity.work((session, request), progress)
        traced = TraceCity.work((session, request, []), progress)
        session.transfer = traced[2]
        # After a cancellation the suns that were traced are still weighed.
        weighed = WeighEnergy.work((session, None, request), silent if traced[2].record.interrupted else progress)
        return imported, (session.scene, findings), traced, weighed

    def finish(self, context, result):
        """Show what the steps show, in their order."""
        imported, classified, traced, weighed = result
        show_import(context, *imported)
        ClassifyCity.finish(self, context, (find_session(find_city(context.scene)[0]), *classified))
        session = find_session(find_city(context.scene)[0])
        TraceCity.finish(self, context, (session, *traced[1:]))
        return WeighEnergy.finish(self, context, (session, *weighed[1:]))


class DropWeather(bpy.types.Operator):
    """Use a weather file, and compute the energy anew if the city is traced"""

    bl_idname = "citypv.drop_weather"
    bl_label = "Use weather"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"})

    def execute(self, context):
        """Choose the file, then run the step Energy."""
        settings = context.scene.citypv
        settings.weather, settings.weather_file = "file", self.filepath
        if bpy.ops.citypv.energy.poll():
            bpy.ops.citypv.energy("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT")
        return {"FINISHED"}


class CityHandler(bpy.types.FileHandler):
    """Dropping a city on a 3D view runs *Solar city*."""

    bl_idname, bl_label = "CITYPV_FH_city", "Solar city (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.solar_city", ".gml;.citygml;.json;.jsonl;.obj"

    @classmethod
    def poll_drop(cls, context):
        """Over a 3D view."""
        return context.area is not None and context.area.type == "VIEW_3D"


class WeatherHandler(bpy.types.FileHandler):
    """Dropping a weather file on a 3D view uses it."""

    bl_idname, bl_label = "CITYPV_FH_weather", "Weather (CityPV)"
    bl_import_operator, bl_file_extensions = "citypv.drop_weather", ".epw;.nc"

    @classmethod
    def poll_drop(cls, context):
        """Over a 3D view."""
        return context.area is not None and context.area.type == "VIEW_3D"
