"""Draw the legend of the coloured city in the 3D view."""

import blf
import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from .colour_faces import read_scale
from .colour_scale import format_tick
from .draw_highlight import draw_highlight
from .in_place import is_in_place
from .legend_note import note_of
from .session import find_city
from .wear_colours import wears_colours

PAPER = (0.95, 0.95, 0.94, 0.94)  # background of the legend; all colours here are sRGB with alpha

_handlers = []


def start_drawing():
    """Start drawing legend and highlight in all 3D views."""
    if not bpy.app.background:
        from .draw_probe import draw_probe

        for draw, moment in ((draw_legend, "POST_PIXEL"), (draw_probe, "POST_PIXEL"), (draw_highlight, "POST_VIEW")):
            _handlers.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", moment))


def stop_drawing():
    """Stop drawing them."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")


def draw_legend():
    """Draw the legend of the city in the current 3D view, if it has one and the panel enables it."""
    context = bpy.context
    settings = getattr(context.scene, "citypv", None)
    if settings is None or not settings.show_legend or not context.space_data.overlay.show_overlays:
        return
    city, _ = find_city(context.scene)
    scale = read_scale(city) if city is not None and is_coloured(city) else None
    if scale is None:
        return
    pixel = context.preferences.system.ui_scale
    # Above Blender's box with the last operator.
    left, bottom, width, height = 76 * pixel, 92 * pixel, 440 * pixel, 16 * pixel
    draw_box((left - 26 * pixel, bottom - 46 * pixel, width + 52 * pixel, height + 80 * pixel), PAPER)
    title = f"{scale.title} [{scale.unit}]" if scale.unit else scale.title
    write_text(title, left, bottom + height + 10 * pixel, 14 * pixel)
    write_text(note_of(city, scale.attribute), left, bottom - 37 * pixel, 11 * pixel)
    draw = _draw_classes if scale.classes else _draw_bar
    for place, text in draw(scale, left, bottom, width, height):
        write_text(text, place, bottom - 18 * pixel, 12 * pixel, centred=True)


def is_coloured(city):
    """Whether the colours of a city are to be seen, on its own faces or on the objects it was taken from."""
    return wears_colours(city) if is_in_place(city) else city.visible_get()


def _draw_bar(scale, left, bottom, width, height):
    # The graphics card interpolates colours between two stops.
    count = len(scale.stops)
    places = [left + width * i / (count - 1) for i in range(count)]
    points = [(x, y) for x in places for y in (bottom, bottom + height)]
    colours = [(*stop.tolist(), 1.0) for stop in scale.stops for _ in range(2)]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(shader, "TRI_STRIP", {"pos": points, "color": colours}).draw(shader)
    share = (scale.ticks - scale.low) / (scale.high - scale.low)
    return [(left + width * float(s), format_tick(t, scale)) for s, t in zip(share, scale.ticks, strict=True)]


def _draw_classes(scale, left, bottom, width, height):
    step = width / len(scale.classes)
    for place, stop in enumerate(scale.stops):
        draw_box((left + place * step, bottom, step, height), (*stop.tolist(), 1.0))
    return [(left + (place + 0.5) * step, name) for place, name in enumerate(scale.classes)]


def draw_box(box, colour):
    """Fill a rectangle (left, bottom, width, height) [pixels] with a colour (sRGB with alpha)."""
    x, y, width, height = box
    points = [(x, y), (x + width, y), (x, y + height), (x + width, y + height)]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", colour)
    batch_for_shader(shader, "TRI_STRIP", {"pos": points}).draw(shader)
    gpu.state.blend_set("NONE")


def write_text(text, x, y, size, centred=False):
    """Write dark text [pixels]."""
    blf.size(0, size)
    blf.color(0, 0.13, 0.15, 0.17, 1.0)
    blf.position(0, x - (blf.dimensions(0, text)[0] / 2 if centred else 0), y, 0)
    blf.draw(0, text)
