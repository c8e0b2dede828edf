"""Ctrl-C that keeps what is traced."""

import os
import signal
import threading

from ..settings.progress import SUN_STAGE, CancelledError


class Interruption:
    """Progress report that ends its task with CancelledError after Ctrl-C (SIGINT) or SIGTERM.

    Before the first sun there is nothing to keep, and Ctrl-C raises KeyboardInterrupt as usual; so
    does a second one. Signals reach the main thread only; in other threads this only passes on
    progress.

    Parameters
    ----------
    progress : callable
        Receives every report until the interruption.
    stream : text stream, optional
        For the message after Ctrl-C.
    """

    def __init__(self, progress, stream=None):
        self.progress, self.stream = progress, stream
        self.asked, self.worthwhile, self.before = False, False, {}

    def __enter__(self):
        """Install the signal handlers."""
        if threading.current_thread() is threading.main_thread():
            self.before = {
                number: signal.signal(number, self.handle)
                for number in (signal.SIGINT, signal.SIGTERM)
            }
        return self

    def __exit__(self, *_):
        """Restore the previous signal handlers."""
        for number, handler in self.before.items():
            # A handler not installed from Python cannot be restored; Python's default takes its
            # place.
            signal.signal(number, signal.default_int_handler if handler is None else handler)

    def __call__(self, stage, done, total, unit):
        """Pass on a report, or end the task."""
        if self.asked:
            raise CancelledError
        self.worthwhile |= stage == SUN_STAGE
        self.progress(stage, done, total, unit)

    def handle(self, number, frame):
        """Handle a signal."""
        if self.asked or not self.worthwhile:
            raise KeyboardInterrupt
        self.asked = True
        if self.stream is not None:
            # Not through the stream object: the main thread may be writing to it.
            answer = (
                "\nInterrupting: finished suns are kept; press Ctrl-C again to quit at once "
                "without results\n"
            )
            os.write(self.stream.fileno(), answer.encode())
