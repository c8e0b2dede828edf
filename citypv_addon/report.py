"""Report in the panels: sentences, and rows with buttons that select their faces."""

import textwrap

from ..operators.result.keep_report import REPORT, describe_row, read_rows
from ..operators.session import find_city

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
CLOSED = ("orientation", "eligible", "class", "material")
FOUND = ("repaired", "skipped", "inside", "sheet")
WIDTH, ICON = 40, 4  # characters per line in the panel, and those that an icon takes


def draw_report(layout, context):
    """Show the import report, and its buttons."""
    city, _ = find_city(context.scene)
    if city is None or REPORT not in city:
        return
    box = layout.box().column(align=True)
    for sentence in city[REPORT]:
        draw_sentence(box, sentence)
    row = layout.row(align=True)
    row.operator("citypv.show_report", icon="TEXT")
    row = layout.row(align=True)
    row.operator("citypv.select_buildings", icon="HOME")
    row.operator("citypv.deselect", text="", icon="X")
    draw_rows(layout, context, ("class", "material", *FOUND))


def draw_sentence(column, sentence, icon="NONE"):
    """Show a sentence, wrapped to the width of the sidebar."""
    width = WIDTH if icon == "NONE" else WIDTH - ICON
    for number, line in enumerate(textwrap.wrap(sentence, width, subsequent_indent="   ")):
        column.label(text=line, icon="NONE" if number else icon)


def draw_rows(layout, context, headings):
    """Show the rows of headings, each in a collapsible subpanel."""
    city, _ = find_city(context.scene)
    for heading in headings:
        rows = read_rows(city, heading)
        if not rows:
            continue
        head, body = layout.panel(f"citypv_{heading}", default_closed=heading in CLOSED)
        head.label(text=TITLES[heading])
        for row in rows if body else ():
            (_draw_finding if heading in FOUND else _draw_row)(body.column(align=True), row)


def _draw_row(column, row):
    line = column.split(factor=0.42)
    line.operator("citypv.select_group", text=row["name"]).group = row["key"]
    cells = line.split(factor=0.38)
    for cell in (row["count"], row["area"]):
        place = cells.row()
        place.alignment = "RIGHT"
        place.label(text=cell)


def _draw_finding(column, row):
    # Elements that were left out have no faces to select.
    line = column.row(align=True)
    if len(row["surfaces"]):
        line.operator("citypv.select_group", text=row["name"]).group = row["key"]
    else:
        line.label(text=row["name"])
    line.operator("citypv.copy_group", text="", icon="COPYDOWN").group = row["key"]
    column.label(text=describe_row(row))
