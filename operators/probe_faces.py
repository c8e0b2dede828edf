"""Probe: what the face under the cursor yields, or the selected faces together."""

import bpy
import numpy as np
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d
from mathutils.bvhtree import BVHTree

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .in_place import STAND_IN, is_in_place, list_taken
from .probe_charts import CHARTS, chart_surfaces
from .run_step import redraw_panels
from .select_faces import gather_selection, leave_edit_mode, read_selection, select_faces
from .session import find_city, find_session
from .write_attributes import read_face_attribute

PROBE = PREFIX + "probe"
NEAR = 0.1  # [m] from where an object of the user is hit to the city's own face
MONTHS = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"]


class ProbeFaces(bpy.types.Operator):
    """Click on a face to see what its surface yields; with Shift, its whole building. Esc ends"""

    bl_idname = "citypv.probe"
    bl_label = "Probe"
    bl_options = {"REGISTER", "UNDO"}

    face: bpy.props.IntProperty(
        name="Face", description="Number of the face; -1: all selected faces together", default=-1, min=-1
    )
    whole: bpy.props.BoolProperty(name="Whole building", description="All surfaces of the face's building")

    @classmethod
    def poll(cls, context):
        """The energy was computed in this session."""
        cls.poll_message_set("Compute the energy first")
        session = find_session(find_city(context.scene)[0])
        return session is not None and session.energy is not None

    def invoke(self, context, event):
        """Wait for a click."""
        leave_edit_mode(context)
        context.workspace.status_text_set("CityPV   Click on a face (Shift: its whole building); Esc ends")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Probe where the user clicks, until Esc."""
        if event.type in ("ESC", "RIGHTMOUSE"):
            context.workspace.status_text_set(None)
            return {"FINISHED"}
        area, region = find_region(context, event)
        if event.type != "LEFTMOUSE" or event.value != "PRESS" or region is None:
            return {"PASS_THROUGH"}
        place = event.mouse_x - region.x, event.mouse_y - region.y
        view = region, area.spaces.active.region_3d
        ray = region_2d_to_origin_3d(*view, place), region_2d_to_vector_3d(*view, place)
        self.face, self.whole = hit_face(context, *ray), event.shift
        if self.face >= 0:
            self.execute(context)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Select the surfaces, and store what they yield on the city."""
        city, _ = find_city(context.scene)
        selected = gather_selection(context, city)
        try:
            rows = find_surfaces(city, self.face, whole=self.whole, selected=selected)
            city[PROBE] = describe_surfaces(find_session(city), rows)
            city[CHARTS] = chart_surfaces(find_session(city), rows).tolist()
            select_faces(context, city, np.isin(read_face_attribute(city.data, "surface"), rows))
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        redraw_panels(context, views=True)
        self.report({"INFO"}, ", ".join(line.replace("|", " ") for line in city[PROBE][:8]))
        return {"FINISHED"}


def find_region(context, event):
    """3D view and its region under the cursor, or None and None."""
    for area in context.screen.areas:
        for region in area.regions if area.type == "VIEW_3D" else ():
            inside = 0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height
            if inside and region.type == "UI":
                break
            if inside and region.type == "WINDOW":
                return area, region
    return None, None


def hit_face(context, origin, direction):
    """Face of the city that a ray hits first, -1 if it hits something else or nothing."""
    city, _ = find_city(context.scene)
    graph = context.evaluated_depsgraph_get()
    hit, place, _, face, item, _ = context.scene.ray_cast(graph, origin, direction)
    if not hit or not is_in_place(city):
        return face if hit and item.original == city else -1
    # The city itself is hidden: what is hit is an object that it was taken from, or the one that stands in.
    if item.original not in {city.get(STAND_IN), *(own for _, own, _ in list_taken(city))}:
        return -1
    tree = BVHTree.FromPolygons([v.co for v in city.data.vertices], [p.vertices for p in city.data.polygons])
    inward = city.matrix_world.inverted()
    _, _, nearest, distance = tree.find_nearest(inward @ place)
    return nearest if nearest is not None and distance < NEAR else -1


def find_surfaces(city, face, *, whole=False, selected=None):
    """Surfaces to probe: (k,) int.

    Parameters
    ----------
    city : bpy.types.Object
    face : int
        -1: those of the selected faces.
    whole : bool
        All surfaces of their buildings.
    selected : (f,) bool, optional
        By default the faces selected on the city itself.

    Raises
    ------
    InputError
        No face is selected, or there is no such face.
    """
    surface, building = read_face_attribute(city.data, "surface"), read_face_attribute(city.data, "building")
    if face >= len(surface):
        raise InputError(city.name, f"it has no face {face}", f"give 0 to {len(surface) - 1}")
    selected = read_selection(city.data) if selected is None else selected
    chosen = selected if face < 0 else np.arange(len(surface)) == face
    if not chosen.any():
        raise InputError(city.name, "no faces are selected", "select faces, or click on one")
    if whole:
        chosen = np.isin(building, building[chosen])
    return np.unique(surface[chosen])


def describe_surfaces(session, rows):
    """What surfaces are and yield, as lines "name|value".

    Parameters
    ----------
    session : Session
        With transfer, energy and request.
    rows : (k,) int

    Returns
    -------
    list of str
    """
    from ..core.energy.pick_module import area_of_kwp
    from ..core.energy.potential import sum_potential
    from ..core.energy.pv_system import build_system

    surfaces, energy, system = session.transfer.surfaces, session.energy, build_system(session.request)
    total = sum_potential(rows, surfaces.area, energy, system)
    names = list(dict.fromkeys(surfaces.building_id[k] for k in rows))
    kinds = list(dict.fromkeys(f"{surfaces.kind[k]} {surfaces.orientation[k]}" for k in rows))
    area = surfaces.area[rows]
    lines = [
        f"Building|{names[0]}" + (f" and {len(names) - 1} more" if len(names) > 1 else ""),
        f"Kind|{kinds[0]}" if len(kinds) == 1 else f"Surfaces|{len(rows)}",
        f"Area|{area.sum():,.1f} m²",
    ]
    if len(rows) == 1:
        lines += [f"Tilt|{surfaces.surface_tilt[rows[0]]:.1f}°", f"Azimuth|{surfaces.surface_azimuth[rows[0]]:.1f}°"]
    error = f" ± {energy.full_load_hours_standard_error[rows[0]]:.1f}" if len(rows) == 1 else ""
    hours = total["full_load_hours"]
    lines += [
        "Full load hours|–" if hours is None else f"Full load hours|{hours:,.0f}{error} h per year",
        f"Irradiation|{np.average(energy.poa_global_annual[rows], weights=area):,.0f} kWh/m² per year",
        f"Power|{total['kwp']:,.1f} kWp",
        f"Energy|{total['mwh_per_year']:,.2f} MWh per year",
    ]
    counted = rows[np.isfinite(energy.full_load_hours[rows]) & (energy.counted_area[rows] > 0)]
    kwp = energy.module_area[counted] / area_of_kwp(system.module)
    spread = surfaces.area[counted] / energy.counted_area[counted]  # as in sum_potential
    months = (kwp * spread) @ energy.full_load_hours_by_month[counted] / 1000
    return lines + [f"{name}|{value:,.2f} MWh" for name, value in zip(MONTHS, months, strict=True)]
