"""Ctrl-C while suns are traced: the first one ends the tracing with what is there, the second one ends the program."""

import os
import signal
import threading

from .progress import SUN_STAGE, CancelledError

ANSWER = "\nInterrupting: suns that are done are kept; Ctrl-C again leaves at once and writes nothing\n"


class Interruption:
    """A progress that ends its task with CancelledError after Ctrl-C (or a request to end, SIGTERM).

    Before the first sun there is nothing to keep: Ctrl-C is KeyboardInterrupt then, as ever, and so is a second one.
    Signals reach the main thread only; in others this passes on the progress and no more.

    Parameters
    ----------
    progress : callable
        See `core.progress`; gets every report until the interruption.
    stream : text stream, optional
        Where to answer.
    """

    def __init__(self, progress, stream=None):
        self.progress, self.stream = progress, stream
        self.asked, self.worthwhile, self.before = False, False, {}

    def __enter__(self):
        """Hear the signals."""
        if threading.current_thread() is threading.main_thread():
            self.before = {number: signal.signal(number, self.hear) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_):
        """Let those hear them who did before."""
        for number, handler in self.before.items():
            # What was not installed from Python cannot be installed again; Python's own way takes its place.
            signal.signal(number, signal.default_int_handler if handler is None else handler)

    def __call__(self, stage, done, total, unit):
        """Pass on a report, or end the task."""
        if self.asked:
            raise CancelledError
        self.worthwhile |= stage == SUN_STAGE
        self.progress(stage, done, total, unit)

    def hear(self, number, frame):
        """A signal came."""
        if self.asked or not self.worthwhile:
            raise KeyboardInterrupt
        self.asked = True
        if self.stream is not None:
            # Not through the stream itself: the main thread may be writing to it just now.
            os.write(self.stream.fileno(), ANSWER.encode())
