"""The buildings with the most energy: select one, and look at it."""

import bpy
import numpy as np
from mathutils import Vector

from ...core.settings.errors import InputError, show_end
from ..city.attributes import read_corners
from ..city.build_meshes import read_told, read_vertices, suggest_buildings
from ..city.keys import Key
from ..city.panel import ResultPanel
from ..city.run_step import Action, OfCity, list_views
from .keep_report import find_faces
from .select_faces import select_faces


class ShowBuilding(OfCity, Action, bpy.types.Operator):
    """Select a building, and move the 3D view to it"""

    bl_idname, bl_label = "citypv.show_building", "Show building"

    building: bpy.props.StringProperty(
        name="Building",
        description="Its id, address or name; empty: the one with the most energy",
        search=suggest_buildings,
    )

    def act(self, context, city, ground):
        """Select, and look."""
        best = read_best(city)
        name = self.building or (best[0][0] if best else "")
        if name not in city[Key.BUILDINGS]:
            # Words of an address or a name stand for the first building that has them.
            name = next((one for one, _ in suggest_buildings(self, context, name)), name)
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
        where = read_told(city).get(name)
        return f"{name}{f' ({where})' if where else ''}{told}"


def read_best(city):
    """Best buildings of a city, as `summarise_energy` stores them: list of tuple of str; empty
    before the energy.
    """
    return [tuple(row.split("|")) for row in city.get(Key.BEST, ())]


class ResultsPanel(ResultPanel, bpy.types.Panel):
    """Best buildings and exports."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_results", "Results", 1

    def draw(self, context):
        """Show the best buildings, with buttons that select them and look at them, and what can be
        written.
        """
        column, settings, city = self.start(context)
        self.draw_settings(column, settings, "least_hours")
        found = column.row(align=True)
        found.prop(context.scene.citypv_seeing, "find", text="", icon="VIEWZOOM")
        show = found.operator("citypv.show_building", text="", icon="ZOOM_SELECTED")
        show.building = context.scene.citypv_seeing.find
        best = read_best(city)
        told = read_told(city, len(best))
        body = best and self.open_part(column, "citypv_best", "Best buildings, per year")
        table = body.column(align=True) if body else None
        for name, kwp, mwh, *years in [("", "kWp", "MWh"), *best] if body else ():
            line = table.split(factor=0.45)
            if name:
                label = told.get(name) or show_end(name, 18)
                line.operator("citypv.show_building", text=label).building = name
            else:
                line.label(text="Building")
            self.draw_numbers(line.grid_flow(row_major=True, columns=2, align=True), (kwp, mwh))
            if years:
                self.draw_numbers(table.row(align=True), ("P50 {}, P90 {}".format(*years),))
        column.operator_menu_enum("citypv.export", "format", icon="EXPORT")
        self.draw_running("Export")
