"""Presets and the table of effects in the panel Trace."""

from math import isfinite

from ..operators.city.declare_settings import ELECTRIC, OF_LIGHT, name_switch
from ..operators.light.plan_trace import ITEMS, describe_price, find_preset, read_plan, read_prices
from ..operators.session import find_city
from .report import draw_sentence


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


def draw_effects(layout, context):
    """Show a switch for each effect of the light and, once planned, what was decided; its button tells why."""
    settings, plan = context.scene.citypv, read_plan(find_city(context.scene)[0])
    for key in OF_LIGHT:
        draw_effect(layout, settings, key, plan)
    layout.operator("citypv.plan_effects", icon="PRESET")


def draw_electric_effects(layout, context):
    """Show a switch for each effect of the modules."""
    settings, plan = context.scene.citypv, read_plan(find_city(context.scene)[0])
    for key in ELECTRIC:
        draw_effect(layout, settings, key, plan)


def draw_effect(layout, settings, key, plan):
    """Show one line of the table."""
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
