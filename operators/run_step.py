"""Run a step: blocking in a script, in a background thread when a button is pressed."""

import threading
import time

import bpy

from ..core.errors import InputError
from ..core.progress import CancelledError, describe_progress, silent
from .panel_words import in_panel_words
from .select_faces import leave_edit_mode

TICK = 0.1  # polling interval [s]


class Job:
    """Work that runs in its own thread, with its progress."""

    def __init__(self, title, work):
        self.title, self.text, self.share = title, title, 0.0
        self.result, self.error = None, None
        self._stop, self.dropped = threading.Event(), False
        self._stage, self._started = None, 0.0
        self._thread = threading.Thread(target=self._run, args=(work,), name=title, daemon=True)

    def start(self):
        """Start the work."""
        self._thread.start()

    def cancel(self):
        """Request the work to stop at its next report and keep what is done; a second time, to discard it."""
        self.dropped = self.cancelled
        self._stop.set()
        self.text = f"{self.title}: ends, and keeps nothing" if self.dropped else f"{self.title}: keeps what is done"

    @property
    def cancelled(self):
        """Whether cancellation was requested."""
        return self._stop.is_set()

    @property
    def running(self):
        """Whether the work is still running."""
        return self._thread.is_alive()

    def progress(self, stage, done, total, unit):
        """Receive a progress report of core (see `core.progress`)."""
        if self.cancelled:
            raise CancelledError
        if stage != self._stage:
            self._stage, self._started = stage, time.monotonic()
        seconds = time.monotonic() - self._started
        self.share = done / total if total else 0.0
        self.text = f"{stage}: {describe_progress(done, total, unit, seconds)}"

    def _run(self, work):
        # Errors are reported in Blender's main thread.
        try:
            self.result = work(self.progress)
        except BaseException as error:
            self.error = error


class Step:
    """Base of the operators: `prepare` reads settings, `work` calls core in a thread, `finish` writes back.

    Called from a script (or without a window) a step blocks and returns when it is done. Called from a button it is
    modal: progress shows in the status bar and in the panel. Esc cancels: the step ends with what is done where that is
    of use by itself (the suns that were traced), or changes nothing. After Esc twice it changes nothing in any case.
    """

    current = None  # the running job; the panels show it below the button with its title

    def prepare(self, context):
        """Read settings in Blender's thread; return what `work` needs."""
        raise NotImplementedError

    @staticmethod
    def work(task, progress):
        """Call core; knows nothing of Blender."""
        raise NotImplementedError

    def finish(self, context, result):
        """Write back in Blender's thread; return the message for the user."""
        raise NotImplementedError

    def execute(self, context):
        """Run the step and wait for it."""
        try:
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
        try:
            task = self.prepare(context)
        except (InputError, ImportError) as error:
            return self._refuse(error)
        Step.current = self._job = Job(self.bl_label, lambda progress: self.work(task, progress))
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
            context.workspace.status_text_set(f"CityPV   {self._job.text}   (Esc cancels)")
            redraw_panels(context)
            if not self._job.running:
                return self._end(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Cancel the work because Blender quits."""
        self._job.cancel()
        self._leave(context)

    def _end(self, context):
        self._leave(context)
        error = self._job.error
        if isinstance(error, CancelledError) or (error is None and self._job.dropped):
            self.report({"WARNING"}, f"{self.bl_label} was cancelled; nothing was changed")
            return {"CANCELLED"}
        if isinstance(error, (InputError, ImportError)):
            return self._refuse(error)
        if error is not None:
            raise error
        leave_edit_mode(context)
        try:
            return self._tell(self.finish(context, self._job.result), "WARNING" if self._job.cancelled else "INFO")
        except InputError as problem:
            return self._refuse(problem)
        finally:
            redraw_panels(context, views=True)

    def _leave(self, context):
        Step.current = None
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        redraw_panels(context)

    def _tell(self, text, level="INFO"):
        self.report({level}, text)
        return {"FINISHED"}

    def _refuse(self, error):
        # A library that fails to load is not the user's fault: name it.
        prefix = "A library could not be loaded: " if isinstance(error, ImportError) else ""
        self.report({"ERROR"}, prefix + in_panel_words(error))
        return {"CANCELLED"}


def redraw_panels(context, *, views=False):
    """Redraw the sidebars of all 3D views; the views themselves, with city and legend, only if asked for."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if views or region.type == "UI":
                        region.tag_redraw()
