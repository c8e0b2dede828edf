"""Run what a button does: at once, or as a step that works in a background thread while the window
stays alive.

Errors are told in one line, in the words of the panel.
"""

import functools
import re
import time
from contextlib import nullcontext

import bpy

from ...core.settings.errors import InputError
from ...core.settings.progress import CancelledError, silent
from ...core.settings.request import declared_settings, option_of
from .build_meshes import hold_cities, is_held, renew_holders
from .check_libraries import FAILURES, describe_cure, name_libraries
from .job import NICENESS, Job
from .session import Session, find_city

# of the command line -> of properties that have another type in the panel; the longer ones first
PHRASES = {
    "--latitude D --longitude D": "Own location",
    "--weather-place LATITUDE LONGITUDE": "Measured at (latitude and longitude)",
    "--suns sky-grid:N": "with Suns: Sky grid",
    "--weather climate": "Weather: Climate",
    "--horizon FILE": "a file as Horizon",
    "--weather-place": "Measured at",
    "--albedo-file": "Albedo from: File",
    "--terrain": "Ground: Terrain",
    "--latitude": "Latitude",
    "--longitude": "Longitude",
    "--horizon": "Horizon",
    "--suns": "Suns",
    "--lod": "LoD",
}


class OfCity:
    """Base of operators that need a city."""

    # beside the city itself: a field of its Session, or a property or face attribute of the city
    needs = ""
    lacking = "Import a city first"  # what to do where it is not there

    @classmethod
    def poll(cls, context):
        """There is a city, with what is needed."""
        cls.poll_message_set(cls.lacking)
        city, _ = find_city(context.scene)
        if city is None or not cls.needs:
            return city is not None
        ready = getattr(Session.of(city), cls.needs, None) is not None
        return ready or cls.needs in city or cls.needs in city.data.attributes


class Action:
    """Base of operators that act at once; errors are told in one line.

    They have `act(context, city, ground)`, with the scene's city and its ground (None where there
    are none), which returns the message for the user, or None.
    """

    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Act, and redraw panels and views."""
        renew_holders()
        try:
            told = self.act(context, *find_city(context.scene))
        except InputError as error:
            return refuse(self, error)
        redraw_panels(context, views=True)
        if told:
            self.report({"INFO"}, told)
        return {"FINISHED"}


class Step:
    """Base of the operators that take a while.

    They have `prepare(context)`, which reads settings in Blender's thread and returns what the work
    needs; `work(task, progress)`, static, which calls core and knows nothing of Blender; and
    `finish(context, result)`, which writes back in Blender's thread and returns the message for the
    user.

    Called from a script (or without a window) a step blocks and returns when it is done. Called
    from a button it is modal: progress shows in the status bar and in the panel. Esc cancels: the
    step ends with what is done where that is of use by itself (the suns that were traced), or
    changes nothing. Work ends at its next report, which may be far in a large city. After Esc twice
    the step ends at once and changes nothing in any case: so `work` must not change what others
    see, a Session least of all.

    Between two of these calls the user may undo, delete or open anything: what they hand on holds
    nothing of Blender's data, which may be freed by then (a reference to it crashes), but names,
    numbers and `session_uid`s.
    """

    bl_options = {"REGISTER", "UNDO"}
    current = None  # the running job; the panels show it below the button with its title
    timer = None  # of the window, which calls it
    _job = None  # the work, once it has begun
    _told = 0.0  # when its progress was drawn last [s]
    _scene = None  # `session_uid` of the scene that the step was started in
    watched = False  # whether there is a window to show what is found so far
    stages = None  # of `Job`; `prepare` sets its task's where they are not always the same
    niceness = NICENESS  # of `Job`
    kept = ()  # what is shown so far, in words: it stays where the step is cancelled

    def is_wanted(self, context):
        """Whether what the work is for is still there as it was; else the step ends, and changes
        nothing.
        """
        return True

    def drop(self):
        """Forget the step, as what it is for is no longer wanted."""

    def refine(self, context):
        """Show what the work has found so far, in Blender's thread, while it goes on."""

    def execute(self, context):
        """Run the step and wait for it; where Blender repeats it (Shift R, F9), start it again in
        the background.
        """
        if (self.options.is_repeat or self.options.is_repeat_last) and not bpy.app.background:
            chosen = {
                name: _read_option(getattr(self, name)) for name in tuple(self.properties.keys())
            }
            bpy.app.timers.register(
                functools.partial(_begin_again, self.bl_idname, chosen), first_interval=0.0
            )
            return {"CANCELLED"}
        try:
            with name_libraries():
                result = self.work(self.prepare(context), silent)
            leave_edit_mode(context)
            self.report({"INFO"}, self.finish(context, result))
            return {"FINISHED"}
        except (InputError, ImportError) as error:
            return refuse(self, error)

    def invoke(self, context, event):
        """Start the step in the background."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        if Step.current is not None:
            return refuse(
                self, f"{Step.current.title} is still running: wait, or cancel it with Esc"
            )
        self.watched = True
        try:
            task = self.prepare(context)
        except (InputError, ImportError) as error:
            return refuse(self, error)
        hold_cities(context.scene, self.bl_label)
        self._scene = context.scene.session_uid
        self._job = Job(
            self.bl_label, functools.partial(self.work, task), self.stages, self.niceness
        )
        Step.current = self._job
        Step.timer = context.window_manager.event_timer_add(0.05, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._job.start()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show progress, and what was found so far, until the work is done or cancelled; return
        what Blender is to do with the event.
        """
        # Esc cancels; all events but the timer's go on to Blender.
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        # A quarter of a second between two drawings of its progress, which take time from the work.
        if time.monotonic() - self._told > 0.25:
            self._told = time.monotonic()
            context.workspace.status_text_set(f"CityPV   {self._job.text}   (Esc cancels)")
            redraw_panels(context)
        try:
            # Results so far are shown while the step's city is there and wanted; else the work is
            # dropped.
            with _in_scene(context, self._scene):
                if is_held() and self.is_wanted(context):
                    self.refine(context)
                else:
                    self._job.cancel(drop=True)
                    self.kept = ()
                    self.drop()
        except InputError as problem:  # the user may have deleted what the step works on
            self._job.cancel(drop=True)
            self.kept = ()
            refuse(self, problem)
        # The step ends when its work is done or dropped; until then events go on to Blender.
        return (
            self._end(context)
            if self._job.dropped or not self._job.is_alive()
            else {"PASS_THROUGH"}
        )

    def cancel(self, context):
        """Cancel the work because Blender quits; where a file browser was closed, none
        has begun.
        """
        if self._job is None:
            return
        self._job.cancel()
        self._leave(context)

    def _end(self, context):
        self._leave(context)
        error = self._job.error
        if isinstance(error, CancelledError) or (error is None and self._job.dropped):
            told = (
                f"kept: {', '.join(dict.fromkeys(self.kept))}"
                if self.kept
                else "nothing was changed"
            )
            self.report({"WARNING"}, f"{self.bl_label} was cancelled; {told}")
            return {"FINISHED"} if self.kept else {"CANCELLED"}
        try:
            if error is not None:
                raise error
            leave_edit_mode(context)
            with _in_scene(context, self._scene):
                told = self.finish(context, self._job.result)
            self.report({"WARNING" if self._job.cancelled else "INFO"}, told)
            return {"FINISHED"}
        except (InputError, ImportError) as problem:
            return refuse(self, problem)
        finally:
            redraw_panels(context, views=True)

    def _leave(self, context):
        self.forget_running(context)
        redraw_panels(context)

    @staticmethod
    def forget_running(context):
        """Forget the running step, if there is one: as its work has ended, or as Blender no longer
        calls its operators.
        """
        if Step.current is not None:
            context.window_manager.event_timer_remove(Step.timer)
            context.workspace.status_text_set(None)
        Step.current = Step.timer = None


def _read_option(value):
    """Value of an operator's property as `bpy.ops` takes it: collections as lists of dict."""
    if isinstance(value, bpy.types.bpy_prop_collection):
        return [{"name": item.name} for item in value]
    return value


def _begin_again(name, options):
    """Start a step by the name of its type, CITYPV_OT_…, in the first window, with these options (a
    timer's call).
    """
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        operator = getattr(bpy.ops.citypv, name.partition("_OT_")[2])
        if operator.poll():
            operator("INVOKE_DEFAULT", **options)


class CancelStep(bpy.types.Operator):
    """Cancel the running step but keep the suns traced so far; press again to discard them"""

    bl_idname, bl_label = "citypv.cancel", "Cancel"

    @classmethod
    def poll(cls, context):
        """A step is running."""
        return Step.current is not None

    def execute(self, context):
        """Request cancellation."""
        Step.current.cancel()
        return {"FINISHED"}


def refuse(operator, error):
    """Tell an error; that a library fails to load is not the user's fault, and the panel keeps it
    with its cure.
    """
    prefix = "A library could not be loaded: " if isinstance(error, ImportError) else ""
    sentence = f"{prefix}{' '.join(str(error).split())}. {describe_cure()}"
    if prefix and sentence not in FAILURES:
        FAILURES.append(sentence)
    operator.report({"ERROR"}, prefix + in_panel_words(error))
    return {"CANCELLED"}


def in_panel_words(text):
    """Text in which options of the command line are the titles of the panel, where it has them:
    str.
    """
    titles = {
        option_of(name): details.title for name, _, details in declared_settings() if details.title
    }
    words = re.sub(
        "|".join(rf"{phrase}(?![a-z-])" for phrase in PHRASES),
        lambda found: PHRASES[found[0]],
        str(text),
    )
    return re.sub(r"--[a-z][a-z-]*", lambda found: titles.get(found[0], found[0]), words)


def _in_scene(context, uid):
    """Context in which a step goes on in the scene that it was started in, whichever the window
    shows by now.

    Parameters
    ----------
    context : bpy.types.Context
    uid : int
        `session_uid` of the scene, which undo does not change.
    """
    begun = next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)
    if begun is None or begun == context.scene:
        return nullcontext()
    return context.temp_override(scene=begun, view_layer=begun.view_layers[0])


def leave_edit_mode(context):
    """Switch to object mode, in which meshes can be read and written."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def list_views(context):
    """Areas of the 3D views that are to be seen, in all windows: list of bpy.types.Area."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    return [area for area in areas if area.type == "VIEW_3D"]


def redraw_panels(context, *, views=False):
    """Redraw the sidebars of all 3D views; the views themselves, with city and legend, only if
    asked for.
    """
    for region in (region for area in list_views(context) for region in area.regions):
        if views or region.type == "UI":
            region.tag_redraw()
