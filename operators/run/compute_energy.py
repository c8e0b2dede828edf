"""Energy: combine Transfer and weather to full load hours on every face, and rank the buildings by
their energy.
"""

import bpy
import numpy as np
from mathutils import Vector

from ...core.settings.errors import InputError
from ..city.attributes import CHANGE, read_corners, write_results
from ..city.build_meshes import read_vertices, suggest_buildings
from ..city.keep_transfer import OfTransfer, weigh
from ..city.keys import Key
from ..city.read_settings import remember_step
from ..city.run_step import Action, OfCity, Step, list_views
from ..show.compare_results import compare_with_before
from ..show.keep_report import find_faces
from ..show.select_faces import select_faces
from ..show.show_result import show_result
from ..show.summarise import sum_energy, summarise_energy


class WeighEnergy(OfTransfer, Step, bpy.types.Operator):
    """Compute irradiation and full load hours of every surface from light and weather"""

    bl_idname, bl_label = "citypv.energy", "Compute energy"

    stages = {"reading weather": 1, "electricity": 4}

    @staticmethod
    def work(task, progress, weather=None):
        """Read the weather, where it is not given, and compute the energy."""
        from ...core.energy.left_out import describe_gone

        session, kept, request = task
        transfer, weather, energy = weigh(session, kept, request, progress, weather=weather)
        told = sum_energy(transfer, weather, energy, request)
        gone = describe_gone(transfer.surfaces, request.leave_out)
        return session, transfer, weather, energy, request, (told, gone)

    def finish(self, context, result):
        """Write the results onto the faces and colour them by full load hours."""
        session, transfer, weather, energy, request, (told, gone) = result
        city, ground = session.find_city(context.scene)
        write_results(city, ground, transfer, energy)
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


class ShowBuilding(OfCity, Action, bpy.types.Operator):
    """Select a building, and move the 3D view to it"""

    bl_idname, bl_label = "citypv.show_building", "Show building"

    building: bpy.props.StringProperty(
        name="Building",
        description="Its id; empty: the one with the most energy",
        search=suggest_buildings,
    )

    def act(self, context, city, ground):
        """Select, and look."""
        best = read_best(city)
        name = self.building or (best[0][0] if best else "")
        if not name:
            raise InputError(
                city.name,
                "its buildings have no energy yet",
                "give an id, or compute the energy first",
            )
        chosen = find_faces(city, f"building/{name}")
        select_faces(context, city, chosen)
        triangles = np.flatnonzero(chosen)
        points = read_vertices(city)[np.unique(read_corners(city.data).reshape(-1, 3)[triangles])]
        low, high = points.min(axis=0), points.max(axis=0)
        for region in (area.spaces.active.region_3d for area in list_views(context)):
            region.view_location = Vector(((low + high) / 2).tolist())
            region.view_distance = 2.0 * float(np.linalg.norm(high - low))
        told = next(
            (f": {mwh} MWh per year, {kwp} kWp" for one, kwp, mwh, *_ in best if one == name), ""
        )
        return f"{name}{told}"


def read_best(city):
    """Best buildings of a city, as `summarise_energy` stores them: list of tuple of str; empty
    before the energy.
    """
    return [tuple(row.split("|")) for row in city.get(Key.BEST, ())]
