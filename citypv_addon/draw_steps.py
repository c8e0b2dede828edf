"""Parts that the panels of all steps have: buttons with progress, settings, sentences."""

from ..operators.city.declare_settings import AUTO
from ..operators.light.keep_transfer import describe_missing
from ..operators.picture.show_result import has_result
from ..operators.run_step import Step
from ..operators.session import find_city, list_cities
from .report import draw_sentence


def draw_cities(layout, context):
    """Show the cities of the file, if there are several: the one to be seen, and buttons for the others."""
    cities, (shown, _) = list_cities(context.scene), find_city(context.scene)
    for city in cities if len(cities) > 1 else ():
        icon = "RADIOBUT_ON" if city == shown else "RADIOBUT_OFF"
        text = city.get("citypv_report", [city.name])[0]
        layout.operator("citypv.switch_city", text=f"{city.name}: {text}", icon=icon).name = city.name


def draw_missing(layout, context):
    """Say why the choice *Show* is not what the view shows."""
    settings, (city, _) = context.scene.citypv, find_city(context.scene)
    if city is not None and not has_result(city, settings.attribute):
        layout.label(text="Not computed yet: run the steps above", icon="INFO")
    elif not settings.auto_range and not settings.low < settings.high:
        layout.label(text="Low must be below High", icon="ERROR")


def draw_missing_light(layout, context):
    """Say which file with traced light is missing, if one is."""
    missing = describe_missing(find_city(context.scene)[0])
    if missing:
        draw_sentence(layout.box().column(align=True), missing, "ERROR")
        layout.operator("citypv.retrace", icon="FILE_REFRESH")


def draw_setting(column, settings, name):
    """Show a setting; one that may be left to the program, as a switch and, where it is off, the number."""
    switch, properties = AUTO + name, settings.bl_rna.properties
    if switch not in properties:
        column.prop(settings, name)
        return
    column.row(heading=properties[name].name).prop(settings, switch)
    if not getattr(settings, switch):
        column.prop(settings, name, text=" ")


def draw_step(layout, column, operator, icon):
    """Show the button of a step and, while it runs, its progress and a cancel button."""
    draw_running(layout, column.operator(operator, icon=icon).bl_rna.name)


def draw_running(layout, title):
    """Show progress and a cancel button while the step with this title runs."""
    if Step.current is not None and Step.current.title == title:
        draw_bar(layout, "{}")
        # Each on a line of its own: the sidebar is narrow.
        lines = layout.column(align=True)
        for text in filter(None, (Step.current.stage, Step.current.rate, Step.current.left)):
            draw_sentence(lines, text)


def draw_bar(layout, text):
    """Show the share of the running step that is done, and a cancel button; {} in the text stands for the share."""
    row = layout.row(align=True)
    row.progress(factor=Step.current.share, text=text.format(f"{100 * Step.current.share:.0f} %"))
    row.operator("citypv.cancel", text="", icon="CANCEL")


def draw_lines(layout, context, key, icon="NONE"):
    """Show a sentence that a step stored on the city."""
    city, _ = find_city(context.scene)
    if city is not None and city.get(key):
        draw_sentence(layout.box().column(align=True), city[key], icon)
