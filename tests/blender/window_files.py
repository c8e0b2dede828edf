"""Steps in a Blender window: one by one, all at once, undone, repeated."""

from window_edits import in_view
from window_steps import PREPARE, RUNNING, keep_picture, press

CITY = "bpy.data.objects['City']"
SHADING = PREPARE + "s = area.spaces.active.shading; answer = [s.light, s.color_type]"
IN_VIEW = 400, 400  # a place in the 3D view [pixels]
HAS_KIND = f"'citypv_kind' in {CITY}.data.attributes"

# Notes what the view shows, each time that it is something else.
NOTE = """
space = bpy.app.driver_namespace
space["shown"] = []
def note():
    city = next((one for one in bpy.data.objects if one.get("citypv_part") == "city" and one.visible_get()), None)
    now = None if city is None else [city.get("citypv_colour_attribute"), city.get("citypv_interrupted", "")[:10]]
    if now != (space["shown"] or [None])[-1]:
        space["shown"].append(now)
    return 0.02 if space["noting"] else None
space["noting"] = True
bpy.app.timers.register(note)
"""

# Notes of each work of these steps whether it is in the window's own thread.
NOTE_THREAD = """
import functools, threading
from importlib import import_module
run = "bl_ext.user_default.citypv.operators.run"
steps = import_module(run + ".classify_city").ClassifyCity, import_module(run + ".import_city").ImportCity
bpy.app.driver_namespace["worked"] = worked = []
def note(label, real, task, progress):
    worked.append([label, threading.current_thread() is threading.main_thread()])
    return real(task, progress)
for step in steps:
    step.work = staticmethod(functools.partial(note, step.bl_label, step.work))
"""
WORKED = "bpy.app.driver_namespace['worked']"
FIELD = 211, 51  # place of the field *File* in the box of F9, from the mouse [pixels]


def press_step(window, operator, evidence):
    """Press the button of a step that was not run yet, and wait for what it leaves."""
    assert not window.ask(f"answer = {evidence}")
    press(window, operator)
    window.wait_for(evidence, 300)  # the loops are compiled first
    window.wait_for(f"{RUNNING} is None")
    window.take_picture(window.pictures / f"{operator}.png")
    assert "Traceback" not in window.read_log()


def undo_to_import(window):
    """Undo the classification: the shape is seen in a studio light, not as a white silhouette; then
    redo it.
    """
    assert window.ask(SHADING) == ["FLAT", "VERTEX"]
    window.point("mousemove", *IN_VIEW, "key", "ctrl+z")
    window.wait_for(f"not {HAS_KIND}")
    assert window.ask(SHADING) == ["STUDIO", "MATERIAL"]
    keep_picture(window, "undone")
    window.point("mousemove", *IN_VIEW, "key", "ctrl+shift+z")
    window.wait_for(HAS_KIND)
    assert window.ask(SHADING) == ["FLAT", "VERTEX"]
    assert "Traceback" not in window.read_log()


def three_clicks(window, path):
    """Run *Solar city*: kinds, first look and result are seen one after the other.

    By so many rays that the window shows the first look before the work has ended, on a busy
    machine, too. Buildings without kinds are seen for a tick at most: the kinds of this street are
    known as soon.
    """
    window.ask(
        f"s = bpy.context.scene.citypv; s.city_path = {path!r}\n"
        "s.suns, s.days, s.samples, s.shadow_samples = 'days', 24, 8192, 64"
    )
    window.ask(NOTE)
    press(window, "citypv.solar_city")
    window.wait_for(f"{RUNNING} is not None", 20)
    window.wait_for(f"{RUNNING} is None", 600)
    keep_picture(window, "solar-city")
    shown = window.ask("s = bpy.app.driver_namespace; s['noting'] = False; answer = s['shown']")
    assert shown[-3:] == [
        ["kind", ""],
        ["full_load_hours", "First look"],
        ["full_load_hours", ""],
    ], shown
    assert window.ask(f"answer = 'citypv_totals' in {CITY}")
    assert "Traceback" not in window.read_log()


def repeat_steps(window, path, other):
    """Import a city in a new file, then another path by F9 (*Adjust Last Operation*); classify it,
    and that again by Shift R: list of the works in their order, of NOTE_THREAD.
    """
    window.ask("bpy.ops.wm.read_homefile()")
    window.ask(f"bpy.context.scene.citypv.city_path = {path!r}")
    window.ask(NOTE_THREAD)
    window.ask(in_view("bpy.ops.citypv.import_city('INVOKE_DEFAULT')"))
    _wait_for_works(window, 1)
    window.point("mousemove", *IN_VIEW, "sleep", 0.5, "key", "F9", "sleep", 2)
    keep_picture(window, "adjust-last")
    place = [a + b for a, b in zip(IN_VIEW, FIELD, strict=True)]
    window.point("mousemove", *place, "sleep", 0.5, "click", "--repeat", 2, 1, "sleep", 0.5)
    window.point("key", "ctrl+a", "type", other)
    window.point("key", "Return")
    _wait_for_works(window, 2)
    assert window.ask("answer = bpy.context.scene.citypv.city_path") == other
    window.point("key", "Escape")  # closes the box, which takes all keys
    window.ask(in_view("bpy.ops.citypv.classify('INVOKE_DEFAULT')"))
    _wait_for_works(window, 3)
    window.point("mousemove", *IN_VIEW, "sleep", 0.5, "key", "shift+r")
    _wait_for_works(window, 4)
    return window.ask(f"answer = {WORKED}")


def _wait_for_works(window, count):
    """Wait until so many works have begun, and none runs."""
    window.wait_for(f"len({WORKED}) == {count} and {RUNNING} is None", 300)
