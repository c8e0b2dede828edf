"""Run a step: blocking in a script, in a background thread when a button is pressed."""

import functools
import time
from contextlib import nullcontext

import bpy

from ..core.settings.errors import InputError
from ..core.settings.progress import CancelledError, silent
from .check_libraries import name_libraries, note_failure
from .job import Job
from .panel_words import in_panel_words
from .select_faces import leave_edit_mode

TICK = 0.1  # polling interval [s]
REDRAW = 0.5  # between two pictures of the progress [s]: drawing them takes time from the work


class Step:
    """Base of the operators: `prepare` reads settings, `work` calls core in a thread, `finish` writes back.

    Called from a script (or without a window) a step blocks and returns when it is done. Called from a button it is
    modal: progress shows in the status bar and in the panel. Esc cancels: the step ends with what is done where that is
    of use by itself (the suns that were traced), or changes nothing. After Esc twice it changes nothing in any case.
    Work ends at its next report, which may be far in a large city; where nothing is kept, the window does not wait.
    """

    current = None  # the running job; the panels show it below the button with its title
    _ending = None  # a cancelled job that the window did not wait for
    _drawn = 0.0, None  # when progress was drawn last, and whether it was cancelled then
    _scene = None  # `session_uid` of the scene that the step was started in
    watched = False  # whether there is a window to show what is found so far
    stages = None  # of `Job`

    def prepare(self, context):
        """Read settings in Blender's thread; return what `work` needs."""
        raise NotImplementedError

    @staticmethod
    def work(task, progress):
        """Call core; knows nothing of Blender."""
        raise NotImplementedError

    def expect(self, task):
        """Stages of this task, with the time that each takes relative to the others; None for those of the class."""
        return None

    def finish(self, context, result):
        """Write back in Blender's thread; return the message for the user."""
        raise NotImplementedError

    def refine(self, context):
        """Show what the work has found so far, in Blender's thread, while it goes on."""

    def name_kept(self):
        """What is shown of a step that was cancelled, as text; "" if nothing was changed."""
        return ""

    def execute(self, context):
        """Run the step and wait for it."""
        try:
            with name_libraries():
                result = self.work(self.prepare(context), silent)
            leave_edit_mode(context)
            return self._tell(self.finish(context, result))
        except (InputError, ImportError) as error:
            return self._refuse(error)

    def invoke(self, context, event):
        """Start the step in the background."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        if Step.current is not None:
            return self._refuse(f"{Step.current.title} is still running: wait, or cancel it with Esc")
        self.watched = True
        try:
            task = self.prepare(context)
        except (InputError, ImportError) as error:
            return self._refuse(error)
        stages = self.expect(task) or self.stages
        work = functools.partial(self.work, task)
        self._scene = context.scene.session_uid
        Step.current = self._job = Job(self.bl_label, work, stages, Step._ending)
        Step._ending = None
        self._timer = context.window_manager.event_timer_add(TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._job.start()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show progress until the work is done or cancelled."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            self._tell_progress(context)
            with in_scene(context, self._scene):
                self._show_progress(context)
            if self._job.overdue:
                Step._ending = self._job
                self._leave(context)
                return self._tell_cancelled()
            if not self._job.running:
                return self._end(context)
        return {"PASS_THROUGH"}

    def _tell_progress(self, context):
        # At once when it was cancelled, else only so often.
        now, cancelled = time.monotonic(), (self._job.cancelled, self._job.dropped)
        if now - self._drawn[0] < REDRAW and cancelled == self._drawn[1]:
            return
        self._drawn = now, cancelled
        context.workspace.status_text_set(f"CityPV   {self._job.text}   (Esc cancels)")
        redraw_panels(context)

    def _show_progress(self, context):
        # The user may have deleted what the step works on.
        try:
            self.refine(context)
        except InputError as problem:
            self._job.cancel()
            self._job.cancel()
            self.report({"ERROR"}, in_panel_words(problem))

    def cancel(self, context):
        """Cancel the work because Blender quits."""
        self._job.cancel()
        self._leave(context)

    def _end(self, context):
        self._leave(context)
        error = self._job.error
        if isinstance(error, CancelledError) or (error is None and self._job.dropped):
            return self._tell_cancelled()
        if isinstance(error, (InputError, ImportError)):
            return self._refuse(error)
        if error is not None:
            raise error
        leave_edit_mode(context)
        try:
            with in_scene(context, self._scene):
                told = self.finish(context, self._job.result)
            return self._tell(told, "WARNING" if self._job.cancelled else "INFO")
        except InputError as problem:
            return self._refuse(problem)
        finally:
            redraw_panels(context, views=True)

    def _leave(self, context):
        Step.current = None
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        redraw_panels(context)

    def _tell_cancelled(self):
        kept = self.name_kept()
        self.report({"WARNING"}, f"{self.bl_label} was cancelled; {f'kept: {kept}' if kept else 'nothing was changed'}")
        return {"FINISHED"} if kept else {"CANCELLED"}

    def _tell(self, text, level="INFO"):
        self.report({level}, text)
        return {"FINISHED"}

    def _refuse(self, error):
        # A library that fails to load is not the user's fault: name it.
        note_failure(error)
        prefix = "A library could not be loaded: " if isinstance(error, ImportError) else ""
        self.report({"ERROR"}, prefix + in_panel_words(error))
        return {"CANCELLED"}


def in_scene(context, uid):
    """Context in which a step goes on in the scene that it was started in, whichever the window shows by now.

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


def redraw_panels(context, *, views=False):
    """Redraw the sidebars of all 3D views; the views themselves, with city and legend, only if asked for."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if views or region.type == "UI":
                        region.tag_redraw()
