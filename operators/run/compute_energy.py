"""Energy: combine Transfer and weather to full load hours on every face, and rank the buildings by
their energy.
"""

import bpy

from ...core.weather.sources import ASKED_BY_KEY
from ..city.attributes import CHANGE, Faces
from ..city.keep_transfer import OfTransfer
from ..city.panel import StepPanel
from ..city.read_settings import remember_step
from ..city.run_step import Step
from ..show.show_result import show_result
from .compare_results import compare_with_before
from .summarise import sum_energy, summarise_energy


class WeighEnergy(OfTransfer, Step, bpy.types.Operator):
    """Compute irradiation and full load hours of every surface from light and weather"""

    bl_idname, bl_label = "citypv.energy", "Compute energy"

    stages = {"reading weather": 1, "electricity": 4}

    @staticmethod
    def work(task, progress, weather=None):
        """Read the weather, where it is not given, and compute the energy."""
        from ...core.energy.left_out import describe_gone

        session, kept, request = task
        transfer, weather, energy = session.weigh(kept, request, progress, weather=weather)
        told = sum_energy(transfer, weather, energy, request)
        gone = describe_gone(transfer.surfaces, request.leave_out)
        return session, transfer, weather, energy, request, (told, gone)

    def finish(self, context, result):
        """Write the results onto the faces and colour them by full load hours."""
        session, transfer, weather, energy, request, (told, gone) = result
        city, ground = session.find_city(context.scene)
        Faces(city, ground).write_results(transfer, energy)
        session.transfer, session.weather, session.energy, session.request = (
            transfer,
            weather,
            energy,
            request,
        )
        text = summarise_energy(city, weather, energy, **told)
        remember_step(city, "energy", context.scene.citypv)
        changed = compare_with_before(context.scene, city, ground)
        show_result(
            context, city, ground, CHANGE + "full_load_hours" if changed else "full_load_hours"
        )
        return "; ".join(filter(None, (text, gone)))


class EnergyPanel(StepPanel, bpy.types.Panel):
    """Energy."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_energy", "4  Energy", 7

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        year = ("weather_years",) if settings.weather in ASKED_BY_KEY else ("year",)
        if settings.weather == "file":
            year = "weather_file", "weather_point", "weather_place"
        names = "weather", *year, *self.list_settings("weather"), *self.list_settings("energy")
        names += ("leave_out",)
        self.draw_settings(column, settings, *names)
        column.operator("citypv.find_module", icon="VIEWZOOM")
        effects = self.open_part(column, "citypv_electric_effects", "Effects of the modules")
        if effects:
            self.draw_effects(effects, city, settings, electric=True)
        self.draw_step(column, "citypv.energy", "OUTLINER_OB_LIGHTPROBE")
        self.draw_table(city, "citypv_groups", ("Group", "Count", "Hours"))
        self.draw_told(self.layout, city.get("citypv_weather"))
        self.draw_told(self.layout, city.get("citypv_weather_place"), "ERROR")
