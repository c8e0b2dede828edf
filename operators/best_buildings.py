"""The buildings with the most energy, and a button for each that shows it."""

import bpy
import numpy as np
from mathutils import Vector

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .keep_report import BUILDINGS, find_faces
from .run_step import redraw_panels
from .select_faces import select_faces
from .session import find_city
from .show_city import seen_screens

BEST = PREFIX + "best"  # property of the city
MOST = 20


class ShowBuilding(bpy.types.Operator):
    """Select a building, and move the 3D view to it"""

    bl_idname = "citypv.show_building"
    bl_label = "Show building"
    bl_options = {"REGISTER", "UNDO"}

    building: bpy.props.StringProperty(
        name="Building",
        description="Its id; empty: the one with the most energy",
        search=lambda self, context, text: [name for name in list_buildings(context) if text.lower() in name.lower()],
    )

    @classmethod
    def poll(cls, context):
        """There is a city."""
        cls.poll_message_set("Import a city first")
        return find_city(context.scene)[0] is not None

    def execute(self, context):
        """Select, and look."""
        city, _ = find_city(context.scene)
        best = read_best(city)
        name = self.building or (best[0][0] if best else "")
        try:
            if not name:
                raise InputError(
                    city.name, "its buildings have no energy yet", "give an id, or compute the energy first"
                )
            chosen = find_faces(city, f"building/{name}")
            select_faces(context, city, chosen)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        look_at_faces(city, chosen)
        redraw_panels(context, views=True)
        told = next((f": {mwh} MWh per year, {kwp} kWp" for one, kwp, mwh in best if one == name), "")
        self.report({"INFO"}, f"{name}{told}")
        return {"FINISHED"}


def list_buildings(context):
    """Ids of the buildings of the scene's city: list of str."""
    city, _ = find_city(context.scene)
    return list(city.get(BUILDINGS, ())) if city is not None else []


def rank_buildings(surfaces, energy, request):
    """Buildings with the most energy per year, in their order: list of (id, kWp, MWh per year).

    Parameters
    ----------
    surfaces : core.scene.scene.Surfaces
    energy : core.energy.energy.Energy
    request : core.request.Request
    """
    from ..core.energy.potential import sum_potential
    from ..core.energy.pv_system import build_system

    system, names = build_system(request), np.array(surfaces.building_id, dtype=object).astype(str)
    rows = np.flatnonzero(energy.eligible & np.isfinite(energy.full_load_hours))
    own, place = np.unique(names[rows], return_inverse=True)
    # Energy is in proportion to module area times hours.
    share = energy.module_area[rows] * energy.full_load_hours[rows] * surfaces.area[rows]
    likely = np.argsort(-np.bincount(place, share / energy.counted_area[rows]), kind="stable")[:MOST]
    found = []
    for number in likely.tolist():
        total = sum_potential(rows[place == number], np.asarray(surfaces.area, float), energy, system)
        found.append((str(own[number]), total["kwp"], total["mwh_per_year"]))
    return found


def keep_best(city, ranked):
    """Store the best buildings on a city."""
    city[BEST] = [f"{name.replace('|', '/')}|{kwp:,.1f}|{mwh:,.1f}" for name, kwp, mwh in ranked]


def read_best(city):
    """Best buildings of a city: list of (id, kWp, MWh per year) as text; empty before the energy."""
    return [tuple(row.split("|")) for row in city.get(BEST, ())] if city is not None else []


def look_at_faces(city, chosen):
    """Move all 3D views that are to be seen to some faces of a city.

    Parameters
    ----------
    city : bpy.types.Object
    chosen : (f,) bool
    """
    faces = [city.data.polygons[k].vertices for k in np.flatnonzero(chosen).tolist()]
    corners = sorted({vertex for face in faces for vertex in face})
    points = np.array([city.matrix_world @ city.data.vertices[k].co for k in corners])
    low, high = points.min(axis=0), points.max(axis=0)
    for screen in seen_screens():
        for area in (area for area in screen.areas if area.type == "VIEW_3D"):
            region = area.spaces.active.region_3d
            region.view_location = Vector(((low + high) / 2).tolist())
            region.view_distance = 2.0 * float(np.linalg.norm(high - low))
