"""Energy: combine Transfer and weather to irradiation and full load hours on every face."""

import bpy

from .read_settings import read_settings
from .run_step import Step
from .session import find_city, find_own_city, find_session
from .show_result import show_result
from .summarise import summarise_energy
from .write_attributes import write_results


class WeighEnergy(Step, bpy.types.Operator):
    """Compute irradiation and full load hours of every surface from the traced light and a year of weather"""

    bl_idname = "citypv.energy"
    bl_label = "Compute energy"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """The city has been traced in this session."""
        cls.poll_message_set("Trace the light first")
        session = find_session(find_city(context.scene)[0])
        return session is not None and session.transfer is not None

    def prepare(self, context):
        """Take the transfer and the settings."""
        session = find_session(find_city(context.scene)[0])
        return session, read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Read the weather and compute the energy."""
        from ..core.study import check_settings, compute_energy, read_year
        from ..core.sun.check_distance import describe_distance

        session, request = task
        check_settings(request)
        progress("reading weather", 0, 1, "years")
        weather = read_year(session.transfer.site, request, session.transfer.suns)
        energy = compute_energy(session.transfer, weather, request, progress)
        return session, weather, energy, describe_distance(weather, session.transfer.site)

    def finish(self, context, result):
        """Write the results onto the faces and colour them by full load hours."""
        session, weather, energy, place = result
        city, ground = find_own_city(context.scene, session)
        write_results(city, ground, session.transfer, energy)
        session.weather, session.energy = weather, energy
        text = summarise_energy(city, weather, energy, place)
        show_result(context, city, ground, "full_load_hours")
        return text
