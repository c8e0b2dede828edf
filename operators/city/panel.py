"""What all panels of the sidebar tab CityPV are made of: buttons with progress, settings,
sentences, tables, effects with their switches.

Each panel stands in the file of what it shows, and is registered by its `bl_idname`.
"""

import textwrap

from .declare_settings import AUTO, ELECTRIC, OF_LIGHT, name_switch, settings_of_panel
from .keys import Key
from .read_settings import STEPS, state_of_step
from .run_step import Step
from .session import find_city


class Panel:
    """Base of all panels of the tab."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "CityPV"
    list_settings = staticmethod(settings_of_panel)

    def start(self, context):
        """Start a column: it, the settings, and the city, which is empty where there is none."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        column = self.layout.column()
        column.enabled = Step.current is None
        return column, context.scene.citypv, find_city(context.scene)[0] or {}

    @staticmethod
    def draw_settings(column, settings, *names):
        """Show settings; one that may be left to the program, as a switch and, where it is off, the
        number.
        """
        properties = settings.bl_rna.properties
        for name, switch in ((name, AUTO + name) for name in names):
            if switch not in properties:
                column.prop(settings, name)
                continue
            column.row(heading=properties[name].name).prop(settings, switch)
            if not getattr(settings, switch):
                column.prop(settings, name, text=" ")

    def draw_step(self, column, operator, icon):
        """Show the button of a step and, while it runs, its progress and a cancel button."""
        self.draw_running(column.operator(operator, icon=icon).bl_rna.name)

    def draw_running(self, title):
        """Show progress and a cancel button while the step with this title runs."""
        if Step.current is not None and Step.current.title == title:
            self.draw_bar(self.layout, "{}")
            # Each on a line of its own: the sidebar is narrow.
            lines = self.layout.column(align=True)
            for text in filter(None, (Step.current.stage, Step.current.rate, Step.current.left)):
                self.draw_sentence(lines, text)

    @staticmethod
    def draw_bar(layout, text):
        """Show the share of the running step that is done, and a cancel button; {} in the text
        stands for the share.
        """
        row = layout.row(align=True)
        share = Step.current.share
        row.progress(factor=share, text=text.format(f"{100 * share:.0f} %"))
        row.operator("citypv.cancel", text="", icon="CANCEL")

    def draw_told(self, layout, sentence, icon="NONE"):
        """Show a sentence in a box of its own; nothing where there is none."""
        if sentence:
            self.draw_sentence(layout.box().column(align=True), sentence, icon)

    @staticmethod
    def draw_sentence(column, sentence, icon="NONE", *, letters=40):
        """Show a sentence, wrapped to the width of the sidebar."""
        # An icon takes four characters.
        width = letters if icon == "NONE" else letters - 4
        for number, line in enumerate(textwrap.wrap(sentence, width, subsequent_indent="   ")):
            column.label(text=line, icon="NONE" if number else icon)

    @staticmethod
    def open_part(layout, name, title, *, closed=True):
        """A part that can be closed, and is so at first: its layout, or None while it is closed."""
        head, body = layout.panel(name, default_closed=closed)
        head.label(text=title)
        return body

    @staticmethod
    def draw_numbers(cells, numbers):
        """Show texts in cells, to the right."""
        for text in numbers:
            place = cells.row()
            place.alignment = "RIGHT"
            place.label(text=text)

    def draw_table(self, city, key, head):
        """Show a table that a step stored on the city, with cells separated by bars."""
        if key not in city:
            return
        grid = self.layout.box().grid_flow(
            row_major=True, columns=len(head), even_columns=False, align=True
        )
        for row in [head, *(line.split("|") for line in city[key])]:
            for place, cell in enumerate(row):  # the first to the left, the others to the right
                line = grid.row()
                line.alignment = "RIGHT" if place else "LEFT"
                line.label(text=cell)


class StepPanel(Panel):
    """Base of the panels of single steps."""

    bl_parent_id, bl_options = "CITYPV_PT_main", {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        """Show whether the step is done, stale or next."""
        step, city = self.bl_idname.rpartition("_")[2], find_city(context.scene)[0]
        state = state_of_step(city, step, context.scene.citypv) if step in STEPS else ""
        if state:
            self.layout.label(
                text=state,
                icon={"done": "CHECKMARK", "stale": "FILE_REFRESH", "next": "FORWARD"}[state],
            )

    def draw_effects(self, layout, city, settings, *, electric):
        """Show a switch for each effect of the light, or of the modules (`electric`), and, once
        planned, what was decided; its button tells why.
        """
        plan = city.get(Key.PLANNED) or {}
        for key in ELECTRIC if electric else OF_LIGHT:
            column = layout.column(align=True)
            line = column.split(factor=0.42)
            line.label(text=settings.bl_rna.properties[name_switch(key)].name)
            cells = line.row(align=True)
            cells.use_property_split = False
            cells.prop(settings, name_switch(key), expand=True)
            if key in plan:
                cells.operator("citypv.explain_effect", text="", icon="INFO").effect = key
                below = column.column(align=True)
                below.enabled = False
                self.draw_sentence(below, plan[key][0])


class ResultPanel(Panel):
    """Base of the panels of results."""

    bl_parent_id = "CITYPV_PT_main"

    @classmethod
    def poll(cls, context):
        """There are results, or an edit's are estimated: before, the steps stand first."""
        city, _ = find_city(context.scene)
        return city is not None and (
            Key.DIFFUSE_RELATIVE in city.data.attributes or Key.PREVIEW in city
        )
