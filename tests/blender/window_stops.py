"""Edits while an update is computed, in a Blender window: its work is held at a report, so that the
moment is known.
"""

import time

from window_edits import CITY, in_view
from window_steps import RUNNING

SUNS = "suns"  # the stage before which the estimate of the update is ready
ELECTRICITY = "electricity"  # the last stage: all that comes before may be seen
IN_VIEW = 500, 300
BEFORE = """
bpy.ops.mesh.primitive_cube_add(size=2, location=(90, 0, 0))
bpy.ops.ed.undo_push(message="added")
bpy.context.object.location.x = 91
bpy.ops.ed.undo_push(message="moved")
"""

# Run once in the window: work waits at the first report of a stage, and its estimate until it may
# be shown.
HOLD = """
from importlib import import_module
from threading import Event
rooms = "bl_ext.user_default.citypv.operators"
Job = import_module(rooms + ".city.job").Job
Update = import_module(rooms + ".run.update_city").UpdateCity
space = bpy.app.driver_namespace
space["hold"] = hold = {"stage": "", "stages": [], "go": Event(), "held": Event(), "shown": True}
space["own"] = progress, refine = Job.progress, Update.refine

def wait_at_stage(self, stage, *told):
    if stage not in hold["stages"]:
        hold["stages"].append(stage)
        if stage == hold["stage"]:
            hold["held"].set()
            hold["go"].wait(300)
    progress(self, stage, *told)

def wait_to_show(self, context):
    if hold["shown"]:
        refine(self, context)

Job.progress, Update.refine = wait_at_stage, wait_to_show
"""
LEAVE = """
from importlib import import_module
rooms = "bl_ext.user_default.citypv.operators"
job, update = import_module(rooms + ".city.job").Job, import_module(rooms + ".run.update_city").UpdateCity
job.progress, update.refine = bpy.app.driver_namespace["own"]
"""
SESSION = f"import_module('bl_ext.user_default.citypv.operators.city.session').Session.of({CITY})"
BUILDINGS = (
    "sorted({name for name in session.transfer.surfaces.building_id if name.startswith('tower')})"
)
TOWERS = f"from importlib import import_module; session = {SESSION}; answer = {BUILDINGS}"
# Nothing runs, and what is seen was computed: no edit is left, and no estimate.
SETTLED = (
    f"{RUNNING} is None and not any({CITY}.get(f'citypv_{{key}}') for key in ('redesigned', "
    "'edited', 'preview'))"
)
ADD = """
bpy.ops.mesh.primitive_cube_add(size=2, location=({x}, -10, 20), scale=(6, 6, 20))
bpy.context.object.name = "tower"
bpy.ops.ed.undo_push(message="tower")
bpy.ops.citypv.add_to_city("INVOKE_DEFAULT")
bpy.ops.ed.undo_push(message="added")
"""
DELETE = "bpy.ops.object.delete()\nbpy.ops.ed.undo_push(message='deleted')"
SELECT = """
bpy.ops.object.select_all(action="DESELECT")
bpy.data.objects["tower"].select_set(True)
bpy.context.view_layer.objects.active = bpy.data.objects["tower"]
"""
COPY = f"""{SELECT}
bpy.ops.object.duplicate_move(TRANSFORM_OT_translate={{"value": (20, 0, 0)}})
bpy.ops.ed.undo_push(message="copied")
"""


def undo(window):
    """Take back that the tower joined the city."""
    window.point("mousemove", *IN_VIEW, "key", "ctrl+z")
    window.wait_for("'citypv_of' not in bpy.data.objects['tower']")


def redo(window):
    """Take it back, and make it again."""
    undo(window)
    window.point("mousemove", *IN_VIEW, "key", "ctrl+shift+z")
    window.wait_for("'citypv_of' in bpy.data.objects['tower']")


def delete(window):
    """Delete the tower."""
    window.ask(in_view(SELECT + DELETE))


def duplicate(window):
    """Put a second tower beside it."""
    window.ask(in_view(COPY))


def replace(window):
    """Put a second tower beside it, and delete the first."""
    duplicate(window)
    delete(window)


# What is done while the work waits -> towers that the city has in the end.
EDITS = {
    undo: [],
    redo: ["tower"],
    delete: [],
    duplicate: ["tower", "tower.001"],
    replace: ["tower.001"],
}


def edit_while_computed(window, edit, stage, x, *, shown=True, hidden=False):
    """Add a tower, hold the update of it, edit, and let it go on; the city is as it is seen then.

    Parameters
    ----------
    window : Window
    edit : callable
        Of `EDITS`.
    stage : str
        At its first report the work waits.
    x : float [m]
        Place of the tower: one that was not computed before.
    shown : bool
        Whether to wait until the estimate is shown; only where the work waits after it is ready.
    hidden : bool
        Whether the estimate is held back until the edit is made.

    Returns
    -------
    list of str
        Stages of the update that were reported.
    """
    window.ask(
        "hold = bpy.app.driver_namespace['hold']; hold['stages'].clear(); hold['go'].clear(); "
        "hold['held'].clear()\n"
        f"hold['stage'], hold['shown'] = {stage!r}, {not hidden}"
    )
    window.ask(in_view(ADD.format(x=x)))
    if stage:
        window.wait_for("bpy.app.driver_namespace['hold']['held'].is_set()", 60)
        if shown:
            window.wait_for(f"{CITY}.get('citypv_preview')", 60)
        edit(window)
        window.ask("bpy.app.driver_namespace['hold']['shown'] = True")
        time.sleep(0.4 * hidden)  # until the window has looked at the work
        window.ask(
            "bpy.app.driver_namespace['hold']['stage'] = ''; "
            "bpy.app.driver_namespace['hold']['go'].set()"
        )
    else:
        window.wait_for(f"{RUNNING} is not None", 60)
    wait_until_settled(window, EDITS[edit] if stage else ["tower"])
    return window.ask("answer = bpy.app.driver_namespace['hold']['stages']")


def wait_until_settled(window, towers):
    """Wait until nothing is left to compute, and the city has these towers: no others, no fewer."""
    end = time.monotonic() + 60
    while not (window.ask(f"answer = {SETTLED}") and window.ask(TOWERS) == towers):
        assert time.monotonic() < end, (window.ask(TOWERS), towers, window.read_log()[-2000:])
        time.sleep(0.1)


def clear_towers(window):
    """Delete all towers, and wait for the city without them."""
    window.ask(
        "bpy.data.batch_remove([item for item in bpy.data.objects if "
        "item.name.startswith('tower')])\n"
        "bpy.ops.ed.undo_push(message='cleared')"
    )
    wait_until_settled(window, [])


def list_moments(window):
    """Moments of an update: list of (stage, shown, hidden) of `edit_while_computed`, the estimate's
    own last.
    """
    stages = edit_while_computed(window, undo, "", 41.0)
    clear_towers(window)
    assert SUNS in stages and len(stages) >= 5, stages
    return [(stage, False, False) for stage in stages] + [(SUNS, False, True), (SUNS, True, False)]


def edit_at_moments(window, choose):
    """Make each edit of `EDITS` at those of all moments of an update that `choose` takes for it:
    number made.
    """
    window.ask(HOLD)
    try:
        every, count = list_moments(window), 0
        for edit in EDITS:
            for stage, shown, hidden in choose(edit, every):
                count += 1
                edit_while_computed(
                    window, edit, stage, 41.0 + 0.1 * count, shown=shown, hidden=hidden
                )
                clear_towers(window)
    finally:
        window.ask(LEAVE)
    return count


def undo_first_city(window, path):
    """Undo *Solar city* in a new file while it shows the first city, and go on undoing and redoing:
    it ends.

    Before, the scene and its collection hold no city in any step of undo.
    """
    window.ask("bpy.ops.wm.read_homefile()")
    window.ask(
        f"s = bpy.context.scene.citypv; s.city_path, s.suns, s.days, s.samples = {path!r}, 'days', "
        "4, 64"
    )
    window.ask(HOLD)
    try:
        window.ask(f"hold = bpy.app.driver_namespace['hold']; hold['stage'] = {ELECTRICITY!r}")
        window.ask(in_view(BEFORE + "bpy.ops.citypv.solar_city('INVOKE_DEFAULT')"))
        window.wait_for(
            "bpy.app.driver_namespace['hold']['held'].is_set() and 'City' in bpy.data.objects", 300
        )
        window.point("mousemove", *IN_VIEW, "key", "ctrl+z")
        window.wait_for("'City' not in bpy.data.objects")
        for key in ("ctrl+z", "ctrl+shift+z", "ctrl+shift+z", "ctrl+z"):
            window.point("key", key, "sleep", 0.2)
        window.ask(
            "bpy.app.driver_namespace['hold']['stage'] = ''; "
            "bpy.app.driver_namespace['hold']['go'].set()"
        )
        window.wait_for(f"{RUNNING} is None", 60)
        assert not window.ask("answer = 'City' in bpy.data.objects")
    finally:
        window.ask(LEAVE)
