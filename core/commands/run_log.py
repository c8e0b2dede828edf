"""Messages of a run, and the seconds of its stages."""

import time

from ..settings.progress import Clock, TerminalProgress, silent


class RunLog:
    """Prints messages, and measures the seconds of each stage."""

    def __init__(self, stream):
        self.stream = stream
        self.progress = TerminalProgress(stream) if stream else silent
        self.clock, self.started = Clock(), time.monotonic()

    def write(self, text):
        """Print one line."""
        if self.stream:
            print(text, file=self.stream, flush=True)

    def show(self, transfer):
        """Receive the Transfer of all rounds so far, after each of them."""
