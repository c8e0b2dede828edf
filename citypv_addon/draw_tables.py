"""Tables of the panel: totals, who gains and who loses, presets with prices, effects with
decisions.
"""

from math import inf, isfinite, isnan

from ..operators.city.declare_settings import name_switch
from ..operators.city.keys import Key
from ..operators.run import compare_results, plan_trace
from ..operators.run.plan_trace import ITEMS
from .draw_steps import draw_numbers, draw_sentence


def draw_table(layout, city, key, head):
    """Show a table that a step stored on the city, with cells separated by bars."""
    if key not in city:
        return
    grid = layout.box().grid_flow(row_major=True, columns=len(head), even_columns=False, align=True)
    for row in [head, *(line.split("|") for line in city[key])]:
        for place, cell in enumerate(row):  # the first to the left, the others to the right
            line = grid.row()
            line.alignment = "RIGHT" if place else "LEFT"
            line.label(text=cell)


def draw_comparison(layout, city, seeing, *, per_page=12):
    """Show who gains and who loses: sums, roofs and facades apart, then the buildings, sorted as
    chosen.
    """
    tables = compare_results.read_comparison(city.get(Key.COMPARED, ""))
    if not tables["sums"]:
        return
    # Sums by what happened to buildings.
    column = layout.box().column(align=True)
    column.label(text="MWh per year: before → after, change")
    for row_of_table in tables["sums"]:
        _draw_change(
            column,
            row_of_table,
            {
                "existing": "Existing",
                "changed": "Changed",
                "new": "New",
                "gone": "Gone",
                "all": "All",
            }[row_of_table["state"]],
        )
    # One page of the sorted buildings, with buttons to sort and to turn pages.
    buildings = _sort_buildings(tables["buildings"], seeing)
    pages = max(1, -(-len(buildings) // per_page))
    page = min(seeing.page, pages)
    row = layout.row(align=True)
    row.use_property_split = False
    row.prop(seeing, "sort_by", text="")
    row.prop(seeing, "sort_down", text="", icon="SORT_DESC" if seeing.sort_down else "SORT_ASC")
    if pages > 1:
        row.prop(seeing, "page", text="Page")
        row.label(text=f"of {pages}")
    column = layout.box().column(align=True)
    for row_of_table in buildings[(page - 1) * per_page : page * per_page]:
        _draw_change(column, row_of_table)


def _draw_change(column, row, title=""):
    """Show a row of a comparison: a building with its button, or a sum with its title; then what
    changes in it.
    """
    name, before, after, change, percent = compare_results.write_row(row)
    line = column.split(factor=0.45)
    if title or row["state"] == "gone":
        line.label(text=title or name)
    else:
        line.operator("citypv.show_building", text=name).building = row["name"]
    draw_numbers(line.row(align=True), (change,))
    line = column.split(factor=0.6)
    line.active = not change.startswith("(")
    line.label(text=f"   {before} → {after}")
    draw_numbers(line.row(align=True), (percent,))
    sides = [
        f"{side} {compare_results.write_energy(row[side], plus=True)}"
        for side in ("roofs", "facades")
        if row[side]
    ]
    draw_numbers(column.row(align=True), (", ".join(sides),) if sides else ())


def _sort_buildings(rows, seeing):
    """Rows of buildings in the order that the panel asks for; without a value last."""
    last = -inf if seeing.sort_down else inf
    percent = [last if isnan(value) else value for value in map(compare_results.percent_of, rows)]
    values = percent if seeing.sort_by == "percent" else [row[seeing.sort_by] for row in rows]
    return [
        rows[k] for k in sorted(range(len(rows)), key=values.__getitem__, reverse=seeing.sort_down)
    ]


def draw_presets(layout, city, settings):
    """Show a button for each preset and, once predicted, its seconds and error; bars show the
    error.
    """
    prices, active = city.get(Key.PREDICTED) or {}, plan_trace.find_preset(settings)
    row = layout.row(align=True)
    for name, title, _ in ITEMS:
        row.operator("citypv.use_preset", text=title, depress=name == active).preset = name
    largest = max((error for _, error in prices.values() if isfinite(error)), default=0.0)
    for name, title, _ in ITEMS if prices else ():
        line = layout.split(factor=0.3)
        line.label(text=title)
        error = prices[name][1]
        line.progress(
            factor=error / largest if largest and isfinite(error) else 0.0,
            text=plan_trace.describe_prediction(prices[name]),
        )
    layout.operator("citypv.predict", icon="TIME")


def draw_effects(layout, city, settings, keys):
    """Show a switch for each of these effects and, once planned, what was decided; its button tells
    why.
    """
    plan = plan_trace.read_plan(city)
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
