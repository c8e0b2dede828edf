"""The tab CityPV: what to do first, the running step, totals, and what is missing or stale."""

import bpy

from .check_libraries import FAILURES
from .edit_marks import describe_edit
from .keep_transfer import describe_missing
from .keys import Key
from .panel import Panel
from .run_step import Step
from .session import Session, find_city, list_cities


class MainPanel(Panel, bpy.types.Panel):
    """Header: next step, or the running one."""

    bl_idname, bl_label = "CITYPV_PT_main", "CityPV"

    def draw(self, context):
        """Show the running step, the file of the city and the button that computes all, then
        totals per year, what its results lack, and the cities to switch between.
        """
        # Libraries that are missing or fail to load are told first.
        for failure in FAILURES:
            self.draw_told(self.layout, failure, "ERROR")
        head = self.layout.column()
        column, settings, city = self.start(context)
        if Step.current is not None and Step.current.title != "Solar city":
            # A step that runs, other than the button's own, shows its progress at the top too,
            # since the place below its button may be out of sight.
            self.draw_bar(head, f"{Step.current.title} {{}}")
        # Without a city and a step it says what to do first.
        elif Step.current is None and not city:
            head.label(text="Choose a city, or drop its file here", icon="INFO")
        column.prop(settings, "city_path")
        column.scale_y = 1.2
        self.draw_step(column, "citypv.solar_city", "LIGHT_SUN")
        # Without a city an example is offered.
        if not city:
            column.operator("citypv.berlin_example", icon="WORLD")
        # A city that was edited since its results warns so, but not while the update runs.
        edit, cure = describe_edit(city)
        if edit and (Step.current is None or Step.current.title != "Update"):
            self.draw_told(
                self.layout, f"Results are of before the last edit: {edit}; {cure}", "ERROR"
            )
        # Totals per year, and whether the computation was interrupted.
        self.draw_table(city, "citypv_totals", ("Per year", "kWp", "MWh", "h"))
        self.draw_told(self.layout, city.get("citypv_interrupted"), "INFO")
        # Light that is gone can be traced again, and an edited city of a .blend that was opened.
        # The other cities of the file come last.
        missing = describe_missing(city)
        self.draw_told(self.layout, missing, "ERROR")
        if missing or (edit and Session.is_from_file(city)):
            self.layout.operator("citypv.retrace", icon="FILE_REFRESH")
        # Several cities: a button each, to switch to it.
        _draw_cities(self.layout, context)


def _draw_cities(layout, context):
    """Show the cities of the file, if there are several: the one to be seen, and buttons for the
    others.
    """
    cities, (shown, _) = list_cities(context.scene), find_city(context.scene)
    cities = [city for city in cities if Key.VARIANT not in city]
    for city in cities if cities not in ([], [shown]) else ():
        icon = "RADIOBUT_ON" if city == shown else "RADIOBUT_OFF"
        text = city.get("citypv_report", [city.name])[0]
        layout.operator(
            "citypv.switch_city", text=f"{city.name}: {text}", icon=icon
        ).name = city.name
