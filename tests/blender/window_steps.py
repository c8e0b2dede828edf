"""What a user does in a Blender window: find buttons, press them, read what is told, look."""

import time

PREPARE = """
area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
sidebar = next(r for r in area.regions if r.type == "UI")
"""
RUNNING = "__import__('importlib').import_module('bl_ext.user_default.citypv.operators.city.run_step').Step.current"


# Run once in the window: F8 notes which command the button under the mouse has.
NOTE = """
class NoteButton(bpy.types.Operator):
    bl_idname = "wm.note_button"
    bl_label = "Note the command of the button under the mouse"

    def invoke(self, context, event):
        context.window_manager.clipboard = ""
        if bpy.ops.ui.copy_python_command_button.poll():
            bpy.ops.ui.copy_python_command_button()
        bpy.app.driver_namespace["noted"].append(context.window_manager.clipboard)
        return {"FINISHED"}


bpy.utils.register_class(NoteButton)
keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.new("User Interface")
keymap.keymap_items.new("wm.note_button", "F8", "PRESS")
"""


PAGES = 5  # of the sidebar
# a window's height down and 80 pixels up, so that pages overlap
NEXT = [
    "key",
    "Next",
    *["click", 4] * 2,
]
STEP = 18  # pixels from row to row: a button is 20 high
ROWS_AT_ONCE = 12
# over each row before the key [s]: a busy computer draws what is under the mouse late
WAITS = [
    0.02,
    0.05,
    0.2,
]


def find_button(window, operator, *, below=False):
    """Find where an operator's button is, on the pages of the sidebar from the top down, or from
    its end up.

    An operator with several buttons is given with its arguments, as Blender writes them. The page
    on which it was seen last is tried first. What is not found is looked for again, more slowly.
    """
    for wait in WAITS:
        found = search_pages(window, operator, below, wait)
        if found is not None:
            return found
    raise AssertionError(f"no button of {operator}; on the pages: {window.places}")


def search_pages(window, operator, below, wait):
    """Look for a button on each page of the sidebar once: its place on the screen, None if it was
    not seen.
    """
    call = f"bpy.ops.{operator}" if "(" in operator else f"bpy.ops.{operator}("
    left, bottom, width, height = window.ask(
        PREPARE + "answer = (sidebar.x, sidebar.y, sidebar.width, sidebar.height)"
    )
    # where short buttons are as well
    top, place = (
        window.size[1] - bottom - height,
        left + width // 4,
    )
    known = [
        page
        for page, commands in window.places.items()
        if any(call in command for command in commands)
    ]
    pages = sorted(range(PAGES), key=lambda page: (page not in known, -page if below else page))
    rows = range(top + 40, top + height - 8, STEP)
    for page in pages:
        window.point("mousemove", place, top + height // 2, "key", "Home", *NEXT * page)
        note_buttons(window, place, rows[:1], wait)  # all keys before it have been heard
        draw_window(window)
        found = find_row(
            window, call, place, rows, window.places.setdefault(page, [""] * len(rows)), wait=wait
        )
        if found is not None:
            return place, found
    return None


def find_row(window, call, place, rows, commands, *, wait):
    """Find the row of a button on one page, first where it was seen last; notes the commands of the
    rows it reads.
    """
    parts = [slice(first, first + ROWS_AT_ONCE) for first in range(0, len(rows), ROWS_AT_ONCE)]
    for part in sorted(
        parts, key=lambda part: not any(call in command for command in commands[part])
    ):
        commands[part] = note_buttons(window, place, rows[part], wait)
        for row, command in zip(rows[part], commands[part], strict=True):
            if call in command and call in note_buttons(window, place, [row], wait)[0]:
                return row
    return None


def note_buttons(window, place, rows, wait):
    """Read the commands of the buttons in some rows, with one press of a key over each: list of
    str.
    """
    if not window.ask("answer = 'noted' in bpy.app.driver_namespace"):
        window.ask(NOTE)
    window.ask("bpy.app.driver_namespace['noted'] = []")
    moves = (
        ("mousemove", place, row, "sleep", 0.01, "mousemove", place + 2, row, "sleep", wait)
        for row in rows
    )
    window.point(*(word for move in moves for word in (*move, "key", "F8")))
    window.wait_for(f"len(bpy.app.driver_namespace['noted']) >= {len(rows)}")
    return window.ask("answer = bpy.app.driver_namespace['noted']")


def draw_window(window):
    """Draw everything that has changed, now."""
    window.ask(
        "with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):\n"
        "    bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)"
    )


def press(window, operator, *, below=False):
    """Click a button."""
    window.point("mousemove", *find_button(window, operator, below=below), "click", 1)


def read_reports(window):
    """Read what Blender told the user so far, from its Info editor (opened in place of the
    timeline).
    """
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
    time.sleep(0.5)
    draw_window(window)
    window.take_picture(window.pictures / f"{name}.png")


def find_on_screen(window, name, normal):
    """Place on the screen of the middle of the face of an object that looks the most in a
    direction.
    """
    x, y = window.ask(
        PREPARE + "from bpy_extras.view3d_utils import location_3d_to_region_2d as project\n"
        f"item = bpy.data.objects[{name!r}]; normal = __import__('mathutils').Vector({normal!r})\n"
        "face = max(item.data.polygons, key=lambda face: face.normal.dot(normal))\n"
        "region = next(r for r in area.regions if r.type == 'WINDOW')\n"
        "place = project(region, area.spaces.active.region_3d, item.matrix_world @ face.center)\n"
        "answer = (region.x + place.x, region.y + place.y)"
    )
    return round(x), round(window.size[1] - y)
