"""Tables of results: totals, what was probed with bars of the months, the best buildings."""

from ..operators.result.compute_energy import read_best
from ..operators.result.probe_faces import MONTHS, PROBE, read_charts
from ..operators.session import find_city


def draw_table(layout, context, key, head):
    """Show a table that a step stored on the city, with cells separated by bars."""
    city, _ = find_city(context.scene)
    if city is None or key not in city:
        return
    draw_cells(layout, [head, *(line.split("|") for line in city[key])])


def draw_probed(layout, context):
    """Show what was probed, the months as bars."""
    city, _ = find_city(context.scene)
    rows = [line.split("|") for line in city.get(PROBE, ())] if city is not None else []
    draw_cells(layout, [("Probed", "")] + [row for row in rows if row[0] not in MONTHS] if rows else [])
    charts = read_charts(city)
    if not rows or charts is None:
        return
    largest = max(charts[0].max(), 1e-9)
    bars, told = layout.box().column(align=True), dict(rows)
    for month, value in zip(MONTHS, charts[0].tolist(), strict=True):
        line = bars.split(factor=0.16)
        line.label(text=month)
        line.progress(factor=min(max(value / largest, 0.0), 1.0), text=told.get(month, ""))


def draw_best(layout, context):
    """Show the buildings with the most energy; their buttons select them and move the view to them."""
    best = read_best(find_city(context.scene)[0])
    if not best:
        return
    head, body = layout.panel("citypv_best", default_closed=True)
    head.label(text="Best buildings")
    for name, *numbers in [("", "kWp", "MWh per year"), *best] if body else ():
        line = body.split(factor=0.45)
        if name:
            line.operator("citypv.show_building", text=name).building = name
        else:
            line.label(text="Building")
        cells = line.split(factor=0.4)
        for cell in numbers:
            place = cells.row()
            place.alignment = "RIGHT"
            place.label(text=cell)


def draw_cells(layout, rows):
    """Show rows of cells, the first of each to the left, the others to the right."""
    if not rows:
        return
    grid = layout.box().grid_flow(row_major=True, columns=len(rows[0]), even_columns=False, align=True)
    for row in rows:
        for place, cell in enumerate(row):
            line = grid.row()
            line.alignment = "RIGHT" if place else "LEFT"
            line.label(text=cell)
