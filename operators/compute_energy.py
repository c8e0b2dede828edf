"""Energy: combine Transfer and weather to irradiation and full load hours on every face."""

import bpy
import numpy as np

from .attributes import CHANGE
from .best_buildings import keep_best, rank_buildings
from .compare_results import compare_with_before
from .keep_transfer import read_kept
from .run_step import Step
from .session import find_own_city
from .show_result import show_result
from .step_state import remember_step
from .summarise import sum_totals, summarise_energy, summarise_totals
from .traced_step import OfTransfer
from .write_attributes import write_results, write_surface_values


class WeighEnergy(OfTransfer, Step, bpy.types.Operator):
    """Compute irradiation and full load hours of every surface from the traced light and a year of weather"""

    bl_idname = "citypv.energy"
    bl_label = "Compute energy"
    bl_options = {"REGISTER", "UNDO"}

    stages = {"reading weather": 1, "electricity": 4}

    @staticmethod
    def work(task, progress):
        """Read the weather and compute the energy."""
        from ..core.accuracy.yield_errors import seconds_to_halve
        from ..core.study import check_settings, compute_energy, read_year
        from ..core.sun.check_distance import describe_distance

        session, kept, request = task
        check_settings(request)
        read_kept(session, kept)
        progress("reading weather", 0, 1, "years")
        weather = read_year(session.transfer.site, request, session.transfer.suns)
        energy = compute_energy(session.transfer, weather, request, progress)
        surfaces = session.transfer.surfaces
        totals = sum_totals(surfaces, energy, request), rank_buildings(surfaces, energy, request)
        seconds = seconds_to_halve(session.transfer, weather, energy)
        return session, weather, energy, request, (describe_distance(weather, session.transfer.site), totals, seconds)

    def finish(self, context, result):
        """Write the results onto the faces and colour them by full load hours."""
        session, weather, energy, request, (place, (totals, best), seconds) = result
        city, ground = find_own_city(context.scene, session)
        write_results(city, ground, session.transfer, energy)
        session.weather, session.energy, session.request = weather, energy, request
        write_surface_values(city, ground, "seconds_to_halve", np.where(np.isfinite(seconds), seconds, np.nan))
        text = summarise_energy(city, weather, energy, place)
        summarise_totals(city, totals)
        keep_best(city, best)
        remember_step(city, "energy", context.scene.citypv)
        changed = compare_with_before(context.scene, city, ground)
        show_result(context, city, ground, CHANGE + "full_load_hours" if changed else "full_load_hours")
        return text
