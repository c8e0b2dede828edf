"""Panels of the sidebar tab CityPV, one per step."""

import bpy

from ..operators.city.check_libraries import FAILURES
from ..operators.city.declare_settings import ELECTRIC, OF_LIGHT, settings_of_panel
from ..operators.city.edit_marks import describe_edit, is_from_file
from ..operators.city.keep_transfer import describe_missing
from ..operators.city.keys import Key
from ..operators.city.read_materials import describe_material
from ..operators.city.read_settings import ASKED_BY_KEY, STEPS, state_of_step
from ..operators.city.run_step import Step
from ..operators.city.session import find_city
from ..operators.run.compare_results import show_end
from ..operators.show.probe_faces import read_charts
from ..operators.show.show_building import read_best
from ..operators.show.show_result import find_before, has_result
from ..operators.show.timeline import FRAMES
from .draw_steps import FOUND as FINDINGS
from .draw_steps import (
    draw_bar,
    draw_cities,
    draw_numbers,
    draw_rows,
    draw_running,
    draw_sentence,
    draw_settings,
    draw_step,
    draw_told,
    draw_variants,
    open_panel,
)
from .draw_tables import draw_comparison, draw_effects, draw_presets, draw_table

MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")


class _Panel:
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "CityPV"

    def start(self, context):
        """Start a column: it, the settings, and the city, which is empty where there is none."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        column = self.layout.column()
        column.enabled = Step.current is None
        return column, context.scene.citypv, find_city(context.scene)[0] or {}


class MainPanel(_Panel, bpy.types.Panel):
    """Header: next step, or the running one."""

    bl_idname, bl_label = "CITYPV_PT_main", "CityPV"

    def draw(self, context):
        """Show the running step, or what to do first."""
        for failure in FAILURES:
            draw_told(self.layout, failure, "ERROR")
        head = self.layout.column()
        column, settings, city = self.start(context)
        if Step.current is not None and Step.current.title != "Solar city":
            # Here too: the place below the step's own button may be out of sight.
            draw_bar(head, f"{Step.current.title} {{}}")
        elif Step.current is None and not city:
            head.label(text="Choose a city, or drop its file here", icon="INFO")
        column.prop(settings, "city_path")
        column.scale_y = 1.2
        draw_step(self.layout, column, "citypv.solar_city", "LIGHT_SUN")
        if not city:
            column.operator("citypv.berlin_example", icon="WORLD")
        edit, cure = describe_edit(city)
        if edit and (Step.current is None or Step.current.title != "Update"):
            draw_told(self.layout, f"Results are of before the last edit: {edit}; {cure}", "ERROR")
        draw_table(self.layout, city, "citypv_totals", ("Per year", "kWp", "MWh", "h"))
        draw_told(self.layout, city.get("citypv_interrupted"), "INFO")
        missing = describe_missing(city)
        draw_told(self.layout, missing, "ERROR")
        if missing or (edit and is_from_file(city)):
            self.layout.operator("citypv.retrace", icon="FILE_REFRESH")
        draw_cities(self.layout, context)


class _Step(_Panel):
    bl_parent_id, bl_options = "CITYPV_PT_main", {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        """Show whether the step is done, stale or next."""
        step = self.bl_idname.rpartition("_")[2]
        state = (
            state_of_step(find_city(context.scene)[0], step, context.scene.citypv)
            if step in STEPS
            else ""
        )
        if state:
            self.layout.label(
                text=state,
                icon={"done": "CHECKMARK", "stale": "FILE_REFRESH", "next": "FORWARD"}[state],
            )


class _Result(_Panel):
    bl_parent_id = "CITYPV_PT_main"

    @classmethod
    def poll(cls, context):
        """There are results, or an edit's are estimated: before, the steps stand first."""
        city, _ = find_city(context.scene)
        return city is not None and (has_result(city, "diffuse_relative") or Key.PREVIEW in city)


class ImportPanel(_Step, bpy.types.Panel):
    """Import."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_import", "1  Import", 4

    def draw(self, context):
        """Show the settings of the step, and the report with its buttons."""
        column, settings, city = self.start(context)
        draw_settings(column, settings, "lod", *settings_of_panel("import"))
        draw_step(self.layout, column, "citypv.import_city", "IMPORT")
        meshes = open_panel(column, "citypv_meshes", "Meshes of this scene")
        if meshes:
            meshes.prop(settings, "collection")
            draw_step(self.layout, meshes, "citypv.take_meshes", "OUTLINER_COLLECTION")
        if Key.REPORT not in city:
            return
        box = self.layout.box().column(align=True)
        for sentence in city[Key.REPORT]:
            draw_sentence(box, sentence)
        self.layout.operator("citypv.show_report", icon="TEXT")
        row = self.layout.row(align=True)
        row.operator("citypv.select_buildings", icon="HOME")
        row.operator("citypv.deselect", text="", icon="X")
        draw_rows(self.layout, city, ("class", "material", *FINDINGS))


class ClassifyPanel(_Step, bpy.types.Panel):
    """Classify."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_classify", "2  Classify", 5

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        place = ("latitude", "longitude") if settings.own_place else ()
        terrain = ("terrain",) if settings.ground == "terrain" else ()
        cells = ("grid_size",) if settings.split else ()
        names = (
            "own_place",
            *place,
            "ground",
            *terrain,
            *settings_of_panel("classify"),
            "split",
            *cells,
        )
        draw_settings(column, settings, *names)
        draw_step(self.layout, column, "citypv.classify", "MOD_BUILD")
        draw_rows(self.layout, city, ("kind", "orientation", "eligible"))


class TracePanel(_Step, bpy.types.Panel):
    """Trace."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_trace", "3  Trace", 6

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        draw_presets(column, city, settings)
        draw_running(self.layout, "Predict time and error")
        number = () if settings.suns == "hourly" else (settings.suns.replace("-", "_"),)
        file = ("albedo_file",) if settings.albedo_source == "file" else ()
        names = "suns", *number, *settings_of_panel("trace"), "albedo_source", *file, "horizon"
        draw_settings(column, settings, *names)
        sampling = open_panel(column, "citypv_sampling", "Sampling")
        if sampling:
            draw_settings(sampling, settings, *settings_of_panel("sampling"), "threads")
        effects = open_panel(column, "citypv_effects", "Effects")
        if effects:
            draw_effects(effects, city, settings, OF_LIGHT)
            effects.operator("citypv.plan_effects", icon="PRESET")
        draw_running(self.layout, "Plan effects")
        seeing = context.scene.citypv_seeing
        draw_settings(
            column, seeing, "refine", *(("target_error", "time_budget") if seeing.refine else ())
        )
        draw_step(self.layout, column, "citypv.trace", "LIGHT_SUN")
        draw_table(self.layout, city, "citypv_albedos", ("Material", "Albedo", "Surfaces"))
        draw_told(self.layout, city.get("citypv_unread"))


class EnergyPanel(_Step, bpy.types.Panel):
    """Energy."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_energy", "4  Energy", 7

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        year = ("weather_years",) if settings.weather in ASKED_BY_KEY else ("year",)
        if settings.weather == "file":
            year = "weather_file", "weather_point", "weather_place"
        names = "weather", *year, *settings_of_panel("weather"), *settings_of_panel("energy")
        names += ("leave_out",)
        draw_settings(column, settings, *names)
        column.operator("citypv.find_module", icon="VIEWZOOM")
        effects = open_panel(column, "citypv_electric_effects", "Effects of the modules")
        if effects:
            draw_effects(effects, city, settings, ELECTRIC)
        draw_step(self.layout, column, "citypv.energy", "OUTLINER_OB_LIGHTPROBE")
        draw_table(self.layout, city, "citypv_groups", ("Group", "Count", "Hours"))
        draw_told(self.layout, city.get("citypv_weather"))
        draw_told(self.layout, city.get("citypv_weather_place"), "ERROR")


class ProbePanel(_Result, bpy.types.Panel):
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
            draw_numbers(line.row(align=True), (show_end(value) if name == "Building" else value,))
        largest, bars = max(charts[0].max(), 1e-9), self.layout.box().column(align=True)
        for month, value in zip(MONTHS, charts[0].tolist(), strict=True):
            line = bars.split(factor=0.16)
            line.label(text=month)
            line.progress(factor=min(max(value / largest, 0.0), 1.0), text=f"{value:,.2f} MWh")


class ResultsPanel(_Result, bpy.types.Panel):
    """Best buildings and exports."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_results", "Results", 1

    def draw(self, context):
        """Show the best buildings, with buttons that select them and look at them, and what can be
        written.
        """
        column, settings, city = self.start(context)
        draw_settings(column, settings, "least_hours")
        best = read_best(city)
        body = best and open_panel(column, "citypv_best", "Best buildings, per year")
        table = body.column(align=True) if body else None
        for name, kwp, mwh, *years in [("", "kWp", "MWh"), *best] if body else ():
            line = table.split(factor=0.45)
            if name:
                line.operator("citypv.show_building", text=show_end(name, 18)).building = name
            else:
                line.label(text="Building")
            draw_numbers(line.grid_flow(row_major=True, columns=2, align=True), (kwp, mwh))
            if years:
                draw_numbers(table.row(align=True), ("P50 {}, P90 {}".format(*years),))
        column.operator_menu_enum("citypv.export", "format", icon="EXPORT")
        draw_running(self.layout, "Export")


class ColourPanel(_Step, bpy.types.Panel):
    """Colour."""

    bl_idname, bl_label, bl_order, bl_options = "CITYPV_PT_colour", "5  Colour", 8, set()

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        ends = () if settings.auto_range else ("low", "high")
        draw_settings(
            column,
            settings,
            "show_colours",
            "attribute",
            "colour_map",
            "auto_range",
            *ends,
            "show_legend",
            "show_modules",
        )
        if city and not has_result(city, settings.attribute):
            draw_sentence(
                column.column(align=True), "Not computed yet: run the steps above", "INFO"
            )
        elif ends and not settings.low < settings.high:
            column.label(text="Low must be below High", icon="ERROR")
        draw_told(self.layout, city.get("citypv_stand_ins"))
        column.operator("citypv.colour", icon="COLOR")
        column.operator_menu_enum("citypv.render", "view", icon="RENDER_STILL")


class TimelinePanel(_Result, bpy.types.Panel):
    """Timeline."""

    bl_idname, bl_label, bl_order, bl_options = (
        "CITYPV_PT_timeline",
        "Timeline",
        3,
        {"DEFAULT_CLOSED"},
    )

    def draw(self, context):
        """Show the button, and the moment of the frame."""
        column, _, city = self.start(context)
        seeing = context.scene.citypv_seeing
        column.prop(seeing, "timeline_show")
        draw_step(self.layout, column, "citypv.timeline", "TIME")
        if not seeing.timeline:
            return
        column.prop(context.scene, "frame_current", text=f"Hour of {FRAMES}", slider=False)
        draw_told(column, city.get(Key.MOMENT))
        column.operator("citypv.stop_timeline", icon="X")


class ComparePanel(_Result, bpy.types.Panel):
    """What if: edits, variants, and what they change."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_compare", "What if", 0

    def draw(self, context):
        """Show the buttons, and the totals of both results."""
        column, _, city = self.start(context)
        row = column.row(align=True)
        row.operator("citypv.update", icon="FILE_REFRESH")
        row.prop(context.scene.citypv_seeing, "live", toggle=True)
        draw_running(self.layout, "Update")
        column.operator("citypv.add_to_city", icon="ADD")
        row = column.row(align=True)
        row.operator("citypv.edit_building", icon="EDITMODE_HLT")
        row.operator("citypv.remove_building", icon="REMOVE")
        draw_variants(column, context.scene, city)
        column.operator("citypv.keep_before", icon="COPYDOWN")
        if find_before(context.scene, city) is None:
            return
        column.operator("citypv.compare", icon="ARROW_LEFTRIGHT")
        column.prop(context.scene.citypv_seeing, "side_by_side")
        draw_comparison(self.layout, city, context.scene.citypv_seeing)
        draw_told(self.layout, city.get(Key.MATCHED))
        self.layout.operator("citypv.forget_before", icon="X")


class MaterialPanel(bpy.types.Panel):
    """Reflection of a material."""

    bl_idname, bl_label = "CITYPV_PT_material", "CityPV"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "material"

    @classmethod
    def poll(cls, context):
        """There is a material."""
        return context.material is not None

    def draw(self, context):
        """Show the user's choice, and the resulting reflection."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        self.layout.prop(context.material, "citypv_material")
        self.layout.label(text=describe_material(context.material))


PANELS = (
    *(MainPanel, ImportPanel, ClassifyPanel, TracePanel, EnergyPanel, ColourPanel),
    *(ProbePanel, ResultsPanel, TimelinePanel, ComparePanel),
)
