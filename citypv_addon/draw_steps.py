"""Parts that the panels of all steps have: buttons with progress, settings, sentences, rows of the
report.
"""

import textwrap

from ..operators.city.declare_settings import AUTO
from ..operators.city.keys import Key
from ..operators.city.run_step import Step
from ..operators.city.session import find_city, list_cities
from ..operators.run.compare_results import find_variants
from ..operators.show.keep_report import describe_row, read_rows

TITLES = {
    "kind": "Kinds",
    "orientation": "Orientations",
    "eligible": "Eligible for photovoltaics",
    "class": "Classes of the file",
    "material": "Materials",
    "repaired": "Repaired",
    "skipped": "Left out",
    "inside": "Inside or covered",
    "sheet": "Without thickness",
}
FOUND = ("repaired", "skipped", "inside", "sheet")


def draw_cities(layout, context):
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


def draw_variants(layout, scene, shown):
    """Show the variants of the city: buttons to show, rename, compare with and delete each."""
    column = layout.column(align=True)
    for city in [city for city in find_variants(scene, shown) if Key.VARIANT in city]:
        row, against = column.row(align=True), shown.get(Key.AGAINST) == city.get(Key.IDENTITY)
        icon = "RADIOBUT_ON" if city == shown else "RADIOBUT_OFF"
        row.operator("citypv.switch_city", text="", icon=icon).name = city.name
        row.prop(city, f'["{Key.VARIANT}"]', text="")
        compare = row.row(align=True)
        compare.enabled = city != shown
        compare.operator(
            "citypv.compare", text="", icon="ARROW_LEFTRIGHT", depress=against
        ).name = city.name
        row.operator("citypv.delete_variant", text="", icon="X").name = city.name
    column.operator("citypv.new_variant", icon="DUPLICATE")


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
    """Show the share of the running step that is done, and a cancel button; {} in the text stands
    for the share.
    """
    row = layout.row(align=True)
    row.progress(factor=Step.current.share, text=text.format(f"{100 * Step.current.share:.0f} %"))
    row.operator("citypv.cancel", text="", icon="CANCEL")


def draw_told(layout, sentence, icon="NONE"):
    """Show a sentence in a box of its own; nothing where there is none."""
    if sentence:
        draw_sentence(layout.box().column(align=True), sentence, icon)


def draw_sentence(column, sentence, icon="NONE", *, letters=40):
    """Show a sentence, wrapped to the width of the sidebar."""
    # An icon takes four characters.
    width = letters if icon == "NONE" else letters - 4
    for number, line in enumerate(textwrap.wrap(sentence, width, subsequent_indent="   ")):
        column.label(text=line, icon="NONE" if number else icon)


def draw_rows(layout, city, headings):
    """Show the report's rows of headings, each in a subpanel: groups with what they count, findings
    with their ids.
    """
    for heading in headings:
        rows, found = read_rows(city, heading), heading in FOUND
        body = rows and open_panel(
            layout,
            f"citypv_{heading}",
            TITLES[heading],
            closed=heading in ("orientation", "eligible", "class", "material"),
        )
        for row in rows if body else ():
            column = body.column(align=True)
            line = column.row(align=True) if found else column.split(factor=0.42)
            if found and not len(row["surfaces"]):  # what was left out has no faces to select
                line.label(text=row["name"])
            else:
                line.operator("citypv.select_group", text=row["name"]).group = row["key"]
            if found:
                line.operator("citypv.copy_group", text="", icon="COPYDOWN").group = row["key"]
                column.label(text=describe_row(row))
            else:
                draw_numbers(line.split(factor=0.38), (row["count"], row["area"]))


def open_panel(layout, name, title, *, closed=True):
    """A part that can be closed, and is so at first: its layout, or None while it is closed."""
    head, body = layout.panel(name, default_closed=closed)
    head.label(text=title)
    return body


def draw_numbers(cells, numbers):
    """Show texts in cells, to the right."""
    for text in numbers:
        place = cells.row()
        place.alignment = "RIGHT"
        place.label(text=text)
