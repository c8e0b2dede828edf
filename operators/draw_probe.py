"""Draw the charts of what was probed in the 3D view: bars of the months, and the day curve."""

import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from .draw_legend import PAPER, draw_box, is_coloured, write_text
from .probe_charts import CURVES, read_charts
from .session import find_city

BAR = (0.90, 0.62, 0.0, 1.0)  # colours that colour-blind viewers tell apart (Okabe and Ito), sRGB
LINES = ((0.13, 0.15, 0.17, 1.0), (0.84, 0.37, 0.0, 1.0), (0.0, 0.45, 0.70, 1.0))
WIDTH, HEIGHT, GAP = 250, 90, 52  # of a chart, and between them [pixels]
LETTERS = "JFMAMJJASOND"


def draw_probe():
    """Draw the charts in the current 3D view, if something was probed and the panel enables them."""
    context = bpy.context
    settings = getattr(context.scene, "citypv", None)
    if settings is None or not settings.show_charts or not context.space_data.overlay.show_overlays:
        return
    city, _ = find_city(context.scene)
    charts = read_charts(city) if city is not None and is_coloured(city) else None
    if charts is None:
        return
    pixel = context.preferences.system.ui_scale
    left, bottom = place_charts(context, pixel)
    draw_box((left - 14 * pixel, bottom - 24 * pixel, (WIDTH + 28) * pixel, (2 * HEIGHT + GAP + 54) * pixel), PAPER)
    draw_curves(charts[1], left, bottom, pixel)
    draw_months(charts[0], left, bottom + (HEIGHT + GAP) * pixel, pixel)


def place_charts(context, pixel):
    """Lower left corner of the charts: above the legend [pixels]."""
    return 64 * pixel, min(216 * pixel, max(context.region.height - (2 * HEIGHT + GAP + 90) * pixel, 190 * pixel))


def draw_months(months, left, bottom, pixel):
    """Draw a bar for each month [MWh]."""
    largest = max(float(months.max()), 1e-9)
    step = WIDTH * pixel / 12
    for number, value in enumerate(months.tolist()):
        height = HEIGHT * pixel * max(value, 0.0) / largest
        draw_box((left + number * step, bottom, 0.8 * step, height), BAR)
        write_text(LETTERS[number], left + (number + 0.4) * step, bottom - 13 * pixel, 10 * pixel, centred=True)
    title = f"Energy by month, at most {write_amount(largest, 'MWh', 'kWh')}"
    write_text(title, left, bottom + (HEIGHT + 8) * pixel, 11 * pixel)


def draw_curves(curves, left, bottom, pixel):
    """Draw the mean power by hour of solar time [kW]: year, June, December."""
    largest = max(float(curves.max()), 1e-9)
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    for row, colour in reversed(list(enumerate(LINES))):
        places = [left + (hour + 0.5) / 24 * WIDTH * pixel for hour in range(24)]
        points = [(x, bottom + HEIGHT * pixel * y / largest) for x, y in zip(places, curves[row].tolist(), strict=True)]
        gpu.state.line_width_set(2.0)
        shader.uniform_float("color", colour)
        batch_for_shader(shader, "LINE_STRIP", {"pos": points}).draw(shader)
        name = list(CURVES)[row].capitalize()
        write_text(name, left + 196 * pixel, bottom + (HEIGHT - 14 * row - 12) * pixel, 10 * pixel)
        draw_box((left + 178 * pixel, bottom + (HEIGHT - 14 * row - 9) * pixel, 12 * pixel, 3 * pixel), colour)
    gpu.state.line_width_set(1.0)
    for hour in (0, 6, 12, 18, 24):
        write_text(f"{hour}", left + hour / 24 * WIDTH * pixel, bottom - 13 * pixel, 10 * pixel, centred=True)
    title = f"Power by hour, at most {write_amount(largest, 'kW', 'W')}"
    write_text(title, left, bottom + (HEIGHT + 8) * pixel, 11 * pixel)


def write_amount(value, unit, smaller):
    """A number with its unit, in a thousandth of it where it is small."""
    return f"{value:,.2g} {unit}" if value >= 1 else f"{1000 * value:,.3g} {smaller}"
