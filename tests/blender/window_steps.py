"""What a user does in a Blender window: find buttons, press them, read what is told, look."""

import time

PREPARE = """
area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
sidebar = next(r for r in area.regions if r.type == "UI")
"""
RUNNING = "__import__('importlib').import_module('bl_ext.user_default.citypv.operators.run_step').Step.current"


def find_button(window, operator, *, below=False):
    """Find where an operator's button is: over it, Ctrl+C copies its command. Scrolls from the top down to it.

    An operator with several buttons is given with its arguments, as Blender writes them. Where it was found last is
    tried first. `below` starts at the end of the sidebar.
    """
    call = operator if "(" in operator else f"{operator}("
    left, bottom, width, height = window.ask(PREPARE + "answer = (sidebar.x, sidebar.y, sidebar.width, sidebar.height)")
    top, place = window.size[1] - bottom - height, left + width // 4  # where short buttons are as well
    pages, rows = range(8)[:: -1 if below else 1], range(top + 40, top + height - 8, 14)
    known = window.places.get(call)
    for page, row in [*([known] if known else []), *((page, row) for page in pages for row in rows)]:
        if row == rows[0] or (page, row) == known:
            window.point("mousemove", place, top + height // 2, *["click", 4] * 90, *["click", 5] * 8 * page)
            time.sleep(0.5)
            window.ask("bpy.context.window_manager.clipboard = ''")
        if call_below(window, place, row, call) and is_at(window, place, row, call):
            window.places[call] = page, row
            return place, row
    raise AssertionError(f"no button of {operator}")


def call_below(window, place, row, call):
    """Whether the clipboard holds a call after Ctrl+C over a place."""
    window.point("mousemove", place, row, "sleep", 0.03, "mousemove", place + 2, row, "sleep", 0.05, "key", "ctrl+c")
    return f"bpy.ops.{call}" in window.ask("answer = bpy.context.window_manager.clipboard")


def is_at(window, place, row, call):
    """Whether the call came from this place, and not late from the one before."""
    time.sleep(0.1)
    window.ask("bpy.context.window_manager.clipboard = ''")
    call_below(window, place, row, call)
    time.sleep(0.1)
    return f"bpy.ops.{call}" in window.ask("answer = bpy.context.window_manager.clipboard")


def press(window, operator, *, below=False):
    """Click a button."""
    window.point("mousemove", *find_button(window, operator, below=below), "click", 1)


def read_reports(window):
    """Read what Blender told the user so far, from its Info editor (opened in place of the timeline)."""
    window.ask(
        "screen = bpy.context.window_manager.windows[0].screen\n"
        "for area in screen.areas:\n"
        "    if area.type == 'DOPESHEET_EDITOR':\n"
        "        area.type = 'INFO'"
    )
    return window.ask(
        "window = bpy.context.window_manager.windows[0]\n"
        "area = next(a for a in window.screen.areas if a.type == 'INFO')\n"
        "region = next(r for r in area.regions if r.type == 'WINDOW')\n"
        "with bpy.context.temp_override(window=window, area=area, region=region):\n"
        "    bpy.ops.info.select_all(action='SELECT')\n"
        "    bpy.ops.info.report_copy()\n"
        "answer = bpy.context.window_manager.clipboard"
    )


def keep_picture(window, name):
    """Take a picture once everything is drawn, for people to look at."""
    window.point("mousemove", 500, 300)
    window.wait_for(f"{RUNNING} is None", 600)
    time.sleep(3)
    window.take_picture(window.pictures / f"{name}.png")


def find_on_screen(window, name, normal):
    """Place on the screen of the middle of the face of an object that looks the most in a direction."""
    x, y = window.ask(
        PREPARE + "from bpy_extras.view3d_utils import location_3d_to_region_2d as project\n"
        f"item = bpy.data.objects[{name!r}]; normal = __import__('mathutils').Vector({normal!r})\n"
        "face = max(item.data.polygons, key=lambda face: face.normal.dot(normal))\n"
        "region = next(r for r in area.regions if r.type == 'WINDOW')\n"
        "place = project(region, area.spaces.active.region_3d, item.matrix_world @ face.center)\n"
        "answer = (region.x + place.x, region.y + place.y)"
    )
    return round(x), round(window.size[1] - y)
