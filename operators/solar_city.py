"""Solar city: from a file to full load hours, legend and totals with one button."""

from dataclasses import replace
from queue import SimpleQueue

import bpy

from ..core.settings.errors import InputError
from ..core.settings.progress import silent
from .city_files import CityFiles
from .classify_city import ClassifyCity, check_place, show_kinds
from .compute_energy import WeighEnergy
from .first_look import STAGE, settings_of_look, take_look, tell_look
from .import_city import ImportCity, show_import
from .refine_trace import read_goal, show_round
from .run_step import Step
from .session import Session, find_city, find_own_city, find_session
from .trace_city import TraceCity, keep_light


class SolarCity(CityFiles, Step, bpy.types.Operator):
    """Import the city, classify its surfaces, trace the light and compute full load hours, as set below.

    Each result is shown as soon as it is there: the buildings, their kinds, a first look at full load hours by few
    rays, then those of all rays"""

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
        self._found, self._shown = SimpleQueue(), []
        return paths, request, settings_of_look(request) if self.watched else None, self._found

    def expect(self, task):
        """Stages of all steps; light takes most of the time."""
        _, request, look, _ = task
        light = TraceCity.expect(None, (None, request, None))
        if light is None:
            return None
        whole = sum(light.values())
        before = {name: 0.02 * share * whole for name, share in (ImportCity.stages | ClassifyCity.stages).items()}
        first = {STAGE: 0.2 * whole} if look else {}
        return before | first | light | {"electricity": 0.05 * whole}

    @staticmethod
    def work(task, progress):
        """Run the steps of core, one after the other; leave what each of them finds in a queue."""
        paths, request, look, found = task
        imported = ImportCity.work((paths, request), progress)
        found.put(("buildings", imported))
        session = Session(city=imported[0])
        check_place(session.city, request)
        _, session.scene, findings = ClassifyCity.work((session, request), progress)
        found.put(("kinds", (session, findings)))
        if look:
            found.put(("first look", take_look(session, look, progress)))
        traced = TraceCity.work((session, request, []), progress)
        # After a cancellation the suns that were traced are still weighed.
        telling = silent if traced[2].record.interrupted else progress
        return traced, WeighEnergy.work((replace(session, transfer=traced[2]), None, request), telling)

    def refine(self, context):
        """Show the next result, or the last round of the trace."""
        if not self._found.empty():
            self._show_next(context)
        elif len(self._shown) > 1:
            show_round(context, find_session(find_city(context.scene)[0]))

    def finish(self, context, result):
        """Show what the steps show, in their order."""
        while not self._found.empty():
            self._show_next(context)
        return self._show_light(context, *result)

    def name_kept(self):
        """What is shown so far."""
        return ", ".join(self._shown)

    def _show_next(self, context):
        name, result = self._found.get()
        show = {"buildings": self._show_buildings, "kinds": self._show_kinds, "first look": self._show_look}[name]
        show(context, *result)
        self._shown.append(name)

    def _show_buildings(self, context, *imported):
        show_import(context, *imported)
        self._session = find_session(find_city(context.scene)[0])

    def _show_kinds(self, context, session, findings):
        show_kinds(context, self._session, session, findings)

    def _show_look(self, context, traced, weighed):
        self._show_light(context, traced, weighed)
        tell_look(find_own_city(context.scene, traced[0])[0])

    def _show_light(self, context, traced, weighed):
        keep_light(context, *traced)
        return WeighEnergy.finish(self, context, (traced[0], *weighed[1:]))


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
