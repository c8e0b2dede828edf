"""Tables of the panel: totals, what was probed, the best buildings, presets with prices, effects with decisions."""

from math import isfinite

from ..operators.city.declare_settings import name_switch
from ..operators.light.plan_trace import ITEMS, describe_price, find_preset, read_plan, read_prices
from ..operators.result.compute_energy import read_best
from ..operators.result.probe_faces import MONTHS, PROBE, read_charts
from ..operators.result.summarise import CHANGED
from ..operators.session import find_city
from .draw_steps import draw_numbers, draw_sentence


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
    rows = [(name, show_end(value, 24) if name == "Building" else value) for name, value in rows]
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
    head.label(text="Best buildings, per year")
    if body:
        draw_buildings(body, ("kWp", "MWh"), best)


def draw_changed(layout, context):
    """Show the buildings whose energy changes most, those that lose first."""
    city, _ = find_city(context.scene)
    rows = [line.split("|") for line in city.get(CHANGED, ())] if city is not None else []
    if rows:
        draw_buildings(layout.box(), ("before", "after", "change", "%"), rows)


def draw_buildings(layout, head, rows):
    """Show buildings with numbers; their buttons select them and move the view to them."""
    column, share, most = layout.column(align=True), *((0.45, 18) if len(head) < 3 else (0.28, 11))
    for name, *numbers in [("", *head), *rows]:
        line = column.split(factor=share)
        if name:
            line.operator("citypv.show_building", text=show_end(name, most)).building = name
        else:
            line.label(text="Building")
        draw_numbers(line.grid_flow(row_major=True, columns=len(head), align=True), numbers)


def show_end(name, most):
    """An id, of at most so many characters: those at its end tell one from another."""
    return name if len(name) <= most else f"…{name[1 - most :]}"


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


def draw_presets(layout, context):
    """Show a button for each preset and, once predicted, its seconds and error; bars show the error."""
    prices, active = read_prices(find_city(context.scene)[0]), find_preset(context.scene.citypv)
    row = layout.row(align=True)
    for name, title, _ in ITEMS:
        row.operator("citypv.use_preset", text=title, depress=name == active).preset = name
    largest = max((error for _, error in prices.values() if isfinite(error)), default=0.0)
    for name, title, _ in ITEMS if prices else ():
        line = layout.split(factor=0.3)
        line.label(text=title)
        error = prices[name][1]
        line.progress(factor=error / largest if largest and isfinite(error) else 0.0, text=describe_price(prices[name]))
    layout.operator("citypv.predict", icon="TIME")


def draw_effects(layout, context, keys):
    """Show a switch for each of these effects and, once planned, what was decided; its button tells why."""
    settings, plan = context.scene.citypv, read_plan(find_city(context.scene)[0])
    for key in keys:
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
            draw_sentence(below, plan[key][0])
