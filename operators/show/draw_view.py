"""What CityPV draws over the 3D view: the legend of the coloured city, charts of what was probed,
selected faces.
"""

import textwrap
from itertools import pairwise

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..city.attributes import read_array, read_corners
from ..city.keys import Key
from ..city.session import find_city
from ..city.source_objects import is_in_place, is_seen
from .build_legend import note_of
from .colour_faces import read_scale
from .probe_faces import CURVES, read_charts
from .select_faces import read_selection

PAPER = (0.95, 0.95, 0.94, 0.94)  # background; all colours here are sRGB with alpha
LINES = ((0.13, 0.15, 0.17, 1.0), (0.84, 0.37, 0.0, 1.0), (0.0, 0.45, 0.70, 1.0))
WIDTH, HEIGHT, GAP = 250, 90, 52  # of a chart, and between them [pixels]
SMALLEST = 0.7  # of that size, at which legend and charts are drawn in a narrow view
# of the legend's note: from one line to the next [pixels], and letters on one
LINE, LETTERS_OF_NOTE = (
    15,
    84,
)


def _find_coloured(switch):
    """The city if its colours are to be seen, on its own faces or on the objects it was taken from,
    else None.

    Also None where this switch of the panel is off, or the 3D view shows no overlays.
    """
    context = bpy.context
    if not getattr(getattr(context.scene, "citypv", None), switch, False):
        return None
    city, _ = find_city(context.scene)
    if city is None or not context.space_data.overlay.show_overlays:
        return None
    return city if (city.get(Key.WORN) if is_in_place(city) else city.visible_get()) else None


def _draw_legend():
    """Draw the legend of the city in the current 3D view, if it has one and the panel
    enables it.
    """
    # Nothing to draw without a coloured city.
    city = _find_coloured("show_legend")
    scale = read_scale(city) if city is not None else None
    if scale is None:
        return
    # Sizes follow Blender's scale and the width of the view.
    whole = bpy.context.preferences.system.ui_scale
    # The legend and what is left of it take 600 pixels.
    pixel = max(_fit_width(600), SMALLEST) * whole
    blf.size(0, 11 * pixel)
    lines = textwrap.wrap(note_of(city, scale.name), LETTERS_OF_NOTE) or [""]
    # Above Blender's box with the last operator; the note's last line is always at the same height.
    deep = (46 + LINE * (len(lines) - 1)) * pixel  # from the colour bar to the lower edge
    left, bottom, width, height = 76 * whole, 46 * pixel + deep, 440 * pixel, 16 * pixel
    across = max(width, *(blf.dimensions(0, line)[0] for line in lines))
    # Paper first, then heading, note and labels on it.
    _draw_box(
        (left - 26 * pixel, bottom - deep, across + 52 * pixel, height + deep + 34 * pixel), PAPER
    )
    _write_text(scale.heading(), left, bottom + height + 10 * pixel, 14 * pixel)
    for number, line in enumerate(lines):
        _write_text(line, left, bottom - (37 + LINE * number) * pixel, 11 * pixel)
    for share, text in scale.labels():
        _write_text(text, left + share * width, bottom - 18 * pixel, 12 * pixel, centred=True)
    # The bar: boxes of classes, or a smooth run of colours.
    values = (
        np.arange(len(scale.classes))
        if scale.classes
        # The bar has 110 boxes of colours.
        else np.linspace(scale.low, scale.high, 110)
    )
    edges = np.linspace(left, left + width, len(values) + 1).tolist()
    points = [(x, y) for ends in pairwise(edges) for x in ends for y in (bottom, bottom + height)]
    colours = [(*colour, 1.0) for colour in scale.colours(values).tolist() for _ in range(4)]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(shader, "TRI_STRIP", {"pos": points, "color": colours}).draw(shader)


def _fit_width(width):
    """Size, at most 1, at which so many pixels fit into what the sidebar leaves of the current 3D
    view.
    """
    free = bpy.context.region.width - sum(
        region.width for region in bpy.context.area.regions if region.type == "UI"
    )
    return min(1.0, free / (width * bpy.context.preferences.system.ui_scale))


def _draw_box(box, colour):
    """Fill a rectangle (left, bottom, width, height) [pixels] with a colour (sRGB with alpha)."""
    x, y, width, height = box
    points = [(x, y), (x + width, y), (x, y + height), (x + width, y + height)]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", colour)
    batch_for_shader(shader, "TRI_STRIP", {"pos": points}).draw(shader)
    gpu.state.blend_set("NONE")


def _write_text(text, x, y, size, centred=False):
    """Write dark text [pixels]."""
    blf.size(0, size)
    blf.color(0, 0.13, 0.15, 0.17, 1.0)
    blf.position(0, x - (blf.dimensions(0, text)[0] / 2 if centred else 0), y, 0)
    blf.draw(0, text)


def _draw_charts():
    """Draw the charts in the current 3D view, above the legend, if something was probed and the
    panel enables them.
    """
    charts = read_charts(_find_coloured("show_charts"))
    if charts is None:
        return
    whole, region = bpy.context.preferences.system.ui_scale, bpy.context.region
    # At most a third of what the sidebar leaves; where letters would be too small to read, there
    # are none.
    share = _fit_width(3 * (WIDTH + 28))
    if share < SMALLEST:
        return
    pixel = share * whole
    left, bottom = (
        64 * whole,
        min(216 * whole, max(region.height - (2 * HEIGHT + GAP + 90) * pixel, 190 * whole)),
    )
    _draw_box(
        (
            left - 14 * pixel,
            bottom - 24 * pixel,
            (WIDTH + 28) * pixel,
            (2 * HEIGHT + GAP + 54) * pixel,
        ),
        PAPER,
    )
    _draw_curves(charts[1], left, bottom, pixel)
    _draw_months(charts[0], left, bottom + (HEIGHT + GAP) * pixel, pixel)


def _draw_months(months, left, bottom, pixel):
    """Draw a bar for each month [MWh]."""
    largest = max(float(months.max()), 1e-9)
    step = WIDTH * pixel / 12
    for number, value in enumerate(months.tolist()):
        height = HEIGHT * pixel * max(value, 0.0) / largest
        _draw_box((left + number * step, bottom, 0.8 * step, height), (0.90, 0.62, 0.0, 1.0))
        _write_text(
            "JFMAMJJASOND"[number],
            left + (number + 0.4) * step,
            bottom - 13 * pixel,
            10 * pixel,
            centred=True,
        )
    title = f"Energy by month, at most {describe_amount(largest, 'MWh', 'kWh')}"
    _write_text(title, left, bottom + (HEIGHT + 8) * pixel, 11 * pixel)


def _draw_curves(curves, left, bottom, pixel):
    """Draw the mean power by hour of solar time, (3, 24) [kW]: year, June, December, in one scale
    that ends at the largest.
    """
    # From the last to the first, so that the year lies on top.
    largest = max(float(curves.max()), 1e-9)
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    for row, colour in reversed(list(enumerate(LINES))):
        places = [left + (hour + 0.5) / 24 * WIDTH * pixel for hour in range(24)]
        # The names stand in 18 pixels above the curves.
        heights = (bottom + (HEIGHT - 18) * pixel * curves[row] / largest).tolist()
        points = list(zip(places, heights, strict=True))
        gpu.state.line_width_set(2.0)
        shader.uniform_float("color", colour)
        batch_for_shader(shader, "LINE_STRIP", {"pos": points}).draw(shader)
        # Names with their colour above, hours below.
        name = list(CURVES)[row].capitalize()
        _write_text(
            name, left + (80 * row + 18) * pixel, bottom + (HEIGHT - 12) * pixel, 10 * pixel
        )
        _draw_box(
            (left + 80 * row * pixel, bottom + (HEIGHT - 9) * pixel, 12 * pixel, 3 * pixel), colour
        )
    gpu.state.line_width_set(1.0)
    for hour in (0, 6, 12, 18, 24):
        _write_text(
            f"{hour}",
            left + hour / 24 * WIDTH * pixel,
            bottom - 13 * pixel,
            10 * pixel,
            centred=True,
        )
    title = f"Power by hour, at most {describe_amount(largest, 'kW', 'W')}"
    _write_text(title, left, bottom + (HEIGHT + 8) * pixel, 11 * pixel)


def describe_amount(value, unit, smaller):
    """A number with its unit, in a thousandth of it where it is small."""
    amount, name = (value, unit) if value >= 1 else (1000 * value, smaller)
    return f"{amount:,.0f} {name}" if amount >= 10 else f"{amount:.2g} {name}"


def _draw_highlight():
    """Draw the highlight of the city in the current 3D view, if it has one."""
    scene = bpy.context.scene
    city, _ = find_city(scene)
    if city is None or not city.get(Key.HIGHLIGHT) or city.mode != "OBJECT" or not is_seen(city):
        return
    # Corners of the selected triangles, lifted off them a little: the city's faces are triangles.
    mesh, chosen = city.data, read_selection(city.data)
    if not chosen.any():
        return
    points, normals = (
        read_array(mesh.vertices, "co", 3),
        read_array(mesh.polygons, "normal", 3)[chosen],
    )
    # In front of the city's faces for the depth buffer, see `show_city`.
    lift = 2e-4 * float(np.linalg.norm(np.ptp(points, axis=0)))
    lifted = points[read_corners(mesh).reshape(-1, 3)[chosen]] + np.float32(lift) * normals[:, None]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(city.matrix_world)
        shader.uniform_float("color", (1.0, 0.35, 0.0, 0.75))
        batch_for_shader(shader, "TRIS", {"pos": lifted.reshape(-1, 3)}).draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


# in all 3D views
DRAWN = (
    (_draw_legend, "POST_PIXEL"),
    (_draw_charts, "POST_PIXEL"),
    (_draw_highlight, "POST_VIEW"),
)
