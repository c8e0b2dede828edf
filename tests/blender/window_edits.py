"""Edits by mouse in a Blender window: a tower is added and moved with *Live* on, and who loses is
read in the table.
"""

import json

from window_steps import PREPARE, RUNNING, keep_picture, press

CITY = "next(o for o in bpy.data.objects if o.get('citypv_part') == 'city' and o.visible_get())"
# The exact numbers of the city seen are there, and nothing is left to compute.
READY = f"'citypv_full_load_hours' in {CITY}.data.attributes"
DONE = f"{RUNNING} is None and {CITY}.get('citypv_redesigned') == 0 and {READY}"
SUMS = f"answer = {CITY}['citypv_compared']"
IN_VIEW = 500, 300
ADD = """
bpy.ops.mesh.primitive_cube_add(size=2, location={place}, scale=(6, 6, 20))
bpy.context.object.name = "tower"
"""


def in_view(code):
    """Code that is run as if in the 3D view."""
    lines = "".join(f"    {line}\n" for line in code.strip().split("\n"))
    return (
        PREPARE + "window = bpy.context.window_manager.windows[0]\n"
        "region = next(r for r in area.regions if r.type == 'WINDOW')\n"
        f"with bpy.context.temp_override(window=window, area=area, region=region):\n{lines}"
    )


def read_sums(window):
    """What the table of sums says of the existing buildings: dict."""
    rows = json.loads(window.ask(SUMS))["sums"]
    return next(row for row in rows if row["name"] == "existing")


def move_tower(window):
    """Add a tower beside the city by one click, and move it as a user does: G X, the distance,
    Enter.

    Returns
    -------
    list of dict
        Rows of the existing buildings before and after the move, of what is seen.
    """
    window.ask(in_view(ADD.format(place="(30, -10, 20)")))
    press(window, "citypv.add_to_city", below=True)
    window.wait_for(DONE, 120)
    keep_picture(window, "tower")
    before, found = window.ask(SUMS), read_sums(window)
    window.point("mousemove", *IN_VIEW, "key", "g", "sleep", 0.1, "key", "x", "sleep", 0.1)
    window.point("key", "minus", "3")
    window.point("key", "Return")
    window.wait_for(f"{DONE} and {CITY}['citypv_compared'] != {before!r}", 120)
    keep_picture(window, "tower-moved")
    return [found, read_sums(window)]


def undo_move(window, row):
    """Undo the last move: the results of the place before are there again, without tracing."""
    window.ask(
        "trace = "
        "__import__('importlib').import_module('bl_ext.user_default.citypv.core.light.change_light')\n"
        "space = bpy.app.driver_namespace; space['trace_change'] = trace.trace_change; "
        "trace.trace_change = None"
    )
    place = window.ask("answer = bpy.data.objects['tower'].location.x")
    for _ in range(3):  # clicks in the sidebar are steps of undo as well
        window.point("mousemove", *IN_VIEW, "key", "ctrl+z", "sleep", 0.5)
        if window.ask("answer = bpy.data.objects['tower'].location.x") != place:
            break
    window.wait_for(DONE, 60)
    assert window.ask("answer = bpy.data.objects['tower'].location.x") == place + 3
    assert read_sums(window) == row
    window.ask(
        "__import__('importlib').import_module('bl_ext.user_default.citypv.core.light.change_light').trace_change = "
        "bpy.app.driver_namespace['trace_change']"
    )
