"""Probe: what the face under the cursor yields, or the selected faces together."""

from dataclasses import replace

import bmesh
import bpy
import numpy as np
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d
from mathutils.bvhtree import BVHTree

from ...core.settings.errors import InputError, show_end
from ..city.attributes import read_face_attribute
from ..city.keep_transfer import OfEnergy
from ..city.keys import Key
from ..city.panel import ResultPanel
from ..city.run_step import Action, leave_edit_mode, list_views
from ..city.session import find_city
from ..city.source_objects import list_taken
from .select_faces import gather_selection, select_faces
from .show_modules import MODULES, find_modules

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
CURVES = {"year": range(1, 13), "June": (6,), "December": (12,)}


class ProbeFaces(OfEnergy, Action, bpy.types.Operator):
    """Click on a face to see what its surface yields; with Shift, its whole building. Esc ends"""

    bl_idname, bl_label = "citypv.probe", "Probe"
    face: bpy.props.IntProperty(
        name="Face",
        description="Number of the face; -1: all selected faces together",
        default=-1,
        min=-1,
    )
    whole: bpy.props.BoolProperty(
        name="Whole building", description="All surfaces of the face's building"
    )

    def invoke(self, context, event):
        """Wait for a click."""
        leave_edit_mode(context)
        context.workspace.status_text_set(
            "CityPV   Click on a face (Shift: its whole building); Esc ends"
        )
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Probe where the user clicks, until Esc."""
        if event.type in ("ESC", "RIGHTMOUSE"):
            context.workspace.status_text_set(None)
            return {"FINISHED"}
        area, region = _find_region(context, event)
        if event.type != "LEFTMOUSE" or event.value != "PRESS" or region is None:
            return {"PASS_THROUGH"}
        place = event.mouse_x - region.x, event.mouse_y - region.y
        view = region, area.spaces.active.region_3d
        ray = region_2d_to_origin_3d(*view, place), region_2d_to_vector_3d(*view, place)
        self.face, self.whole = hit_face(context, *ray), event.shift
        if self.face >= 0:
            self.execute(context)
        return {"RUNNING_MODAL"}

    def act(self, context, city, ground):
        """Select the surfaces, and store what they yield on the city."""
        session, *kept = self.prepare(context)
        selected = gather_selection(context, city)
        session.take_energy(session.with_energy(*kept))
        surface, building = (
            read_face_attribute(city.data, "surface"),
            read_face_attribute(city.data, "building"),
        )
        if self.face >= len(surface):
            raise InputError(
                city.name, f"it has no face {self.face}", f"give 0 to {len(surface) - 1}"
            )
        chosen = selected if self.face < 0 else np.arange(len(surface)) == self.face
        if not chosen.any():
            raise InputError(city.name, "no faces are selected", "select faces, or click on one")
        rows = np.unique(surface[np.isin(building, building[chosen]) if self.whole else chosen])
        city[Key.PROBE], city[Key.CHARTS] = (
            describe_surfaces(session, rows),
            _chart_surfaces(session, rows).tolist(),
        )
        select_faces(context, city, np.isin(surface, rows))
        return ", ".join(line.replace("|", " ") for line in city[Key.PROBE])


def _find_region(context, event):
    """3D view and its region under the cursor, or None and None."""
    for area in list_views(context):
        for region in area.regions:
            inside = (
                0 <= event.mouse_x - region.x < region.width
                and 0 <= event.mouse_y - region.y < region.height
            )
            if inside and region.type == "UI":
                break
            if inside and region.type == "WINDOW":
                return area, region
    return None, None


def hit_face(context, origin, direction):
    """Face of the city that a ray hits first, -1 if it hits something else or nothing."""
    city, _ = find_city(context.scene)
    hit, place, _, _, item, _ = context.scene.ray_cast(
        context.evaluated_depsgraph_get(), origin, direction
    )
    # Modules lie before the faces of the city.
    seen = {city, *(own for _, own, _ in list_taken(city)), *find_modules(context.scene)}
    if not hit or not (item.original in seen or item.original.get(Key.PART) == MODULES):
        return -1
    # Objects show some of its faces in its place, so that those seen have other numbers.
    shape = bmesh.new()
    shape.from_mesh(city.data)
    # The city's own face lies within 0.1 m of what is hit.
    _, _, nearest, _ = BVHTree.FromBMesh(shape).find_nearest(
        city.matrix_world.inverted() @ place, 0.1
    )
    shape.free()
    return -1 if nearest is None else nearest


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
    from ...core.energy.counted_area import REASONS
    from ...core.energy.energy import exceeded_energy

    # What the surfaces are: buildings, kinds, area, and the direction of a single one.
    surfaces, energy = session.transfer.surfaces, session.energy
    total = energy.sum_potential(rows, surfaces.area)
    names = list(dict.fromkeys(surfaces.building_id[k] for k in rows))
    kinds = list(dict.fromkeys(f"{surfaces.kind[k]} {surfaces.orientation[k]}" for k in rows))
    area = surfaces.area[rows]
    lines = [
        f"Building|{names[0]}" + (f" and {len(names) - 1} more" if len(names) > 1 else ""),
        f"Kind|{kinds[0]}" if len(kinds) == 1 else f"Surfaces|{len(rows)}",
        f"Area|{area.sum():,.1f} m²",
    ]
    if len(rows) == 1:
        lines += [
            f"Tilt|{surfaces.surface_tilt[rows[0]]:.1f}°",
            f"Azimuth|{surfaces.surface_azimuth[rows[0]]:.1f}°",
        ]
    # The error of the hours is known of a single surface only.
    error = f" ± {energy.full_load_hours_standard_error[rows[0]]:.1f}" if len(rows) == 1 else ""
    # What the ones with modules yield, year by year.
    hours, counted = total["full_load_hours"], rows[energy.counted_area[rows] > 0]
    kwp = energy.kwp_of_hours(surfaces.area)[counted]
    years = kwp @ energy.full_load_hours_by_year[counted] / 1000
    # Why the others carry none, each reason once.
    reasons = energy.reason[rows].tolist()
    told = [
        (f"{reasons.count(key):,}: {words}" if len(rows) > 1 else words)
        for key, words in REASONS.items()
        if key in reasons
    ]
    # Then hours, irradiation, modules, power, why others carry none, energy, and what 50 and 90 %
    # of the years exceed, where these are known.
    return [
        *lines,
        "Full load hours|–" if hours is None else f"Full load hours|{hours:,.0f}{error} h per year",
        f"Irradiation|{np.average(energy.poa_global_annual[rows], weights=area):,.0f} kWh/m² per "
        "year",
        f"Modules|{energy.module_count[rows].sum():,.0f}",
        f"Power|{total['kwp']:,.1f} kWp",
        *(f"Without modules|{words}" for words in told),
        f"Energy|{total['mwh_per_year']:,.2f} MWh per year",
        *(
            f"{name.upper()}|{value:,.2f} MWh per year"
            for name, value in exceeded_energy(years).items()
        ),
    ]


def _chart_surfaces(session, rows):
    """Energy of each month [MWh] and mean power at each hour of local mean solar time [kW]: (12 + 3
    · 24,) float64.

    Parameters
    ----------
    session : Session
        With transfer, weather, energy and request.
    rows : (k,) int
        Surfaces. Of more than `MOST` there is no day curve (zeros).
    """
    from ...core.run.study import compute_energy
    from ...core.sun.solar_position import local_middle

    energy, curves = session.energy, np.zeros((len(CURVES), 24))
    counted = rows[np.isfinite(energy.full_load_hours[rows]) & (energy.counted_area[rows] > 0)]
    kwp = energy.kwp_of_hours(session.transfer.surfaces.area)[counted]
    months = kwp @ energy.full_load_hours_by_month[counted] / 1000
    # The day curve shows at most 1,000 surfaces.
    if 0 < len(counted) <= 1000:
        transfer = session.transfer.take(counted)
        request = replace(session.request, series=tuple(transfer.surfaces.surface_id))
        energy = compute_energy(transfer, session.weather, request)
        power = energy.series.capacity_factor @ kwp
        middle = local_middle(energy.times, energy.interval, energy.longitude)
        hour, month = middle.hour.to_numpy(), middle.month.to_numpy()
        for row, chosen in enumerate(CURVES.values()):
            inside = np.isin(month, chosen)
            count = np.bincount(hour[inside], minlength=24)
            curves[row] = np.bincount(hour[inside], power[inside], 24) / np.maximum(count, 1)
    return np.concatenate([months, curves.ravel()])


def read_charts(city):
    """Months (12,) [MWh] and curves (3, 24) [kW] of what was probed last, or None."""
    if city is None or Key.CHARTS not in city:
        return None
    values = np.array(city[Key.CHARTS])
    return values[:12], values[12:].reshape(len(CURVES), 24)


class ProbePanel(ResultPanel, bpy.types.Panel):
    """Probe."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_probe", "Probe", 2

    def draw(self, context):
        """Show what the probed surfaces yield, the months as bars."""
        column, settings, city = self.start(context)
        column.operator("citypv.probe", icon="EYEDROPPER")
        column.prop(settings, "show_charts")
        charts = read_charts(city)
        if charts is None:
            return
        box = self.layout.box().column(align=True)
        for name, value in (row.split("|") for row in city[Key.PROBE]):
            line = box.split(factor=0.42)
            line.label(text=name)
            self.draw_numbers(
                line.row(align=True), (show_end(value) if name == "Building" else value,)
            )
        largest, bars = max(charts[0].max(), 1e-9), self.layout.box().column(align=True)
        for month, value in zip(MONTHS, charts[0].tolist(), strict=True):
            line = bars.split(factor=0.16)
            line.label(text=month)
            line.progress(factor=min(max(value / largest, 0.0), 1.0), text=f"{value:,.2f} MWh")
