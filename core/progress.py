"""How long tasks tell what they have done.

A report is a callable `progress(stage, done, total, unit)`. It is called now and then from the thread that started the
task, for each stage first with nothing done; an exception raised in it ends the task. Of a task that is ended by
CancelledError the finished part is kept, where it is of use by itself: the suns that are traced. Where nothing is, the
exception reaches the caller.
"""

import sys
import time

SUN_STAGE = "suns"  # the stage from which on a cancelled task leaves something of use


class CancelledError(Exception):
    """The user wants the task to end, and to keep what is done."""


def silent(stage, done, total, unit):
    """Report nothing."""


def untold(share):
    """Tell nobody which share of a task is done, 0 to 1."""


class TerminalProgress:
    """Progress as one line per stage, with rate and time left, on a terminal or in a log.

    On a terminal the line is renewed in place; in a log a line is written every ten seconds.

    Parameters
    ----------
    stream : text stream, optional
        By default the error stream.
    lasting : bool
        Whether a stage that has ended keeps its line. Else the terminal is as before, and a log has only the lines of
        every ten seconds.
    """

    def __init__(self, stream=None, *, lasting=True):
        self.stream = sys.stderr if stream is None else stream
        self.lasting = lasting
        self.live = self.stream.isatty()
        self.stage, self.started, self.shown = None, 0.0, 0.0

    def __call__(self, stage, done, total, unit):
        """Renew the line of a stage."""
        now = time.monotonic()
        if stage != self.stage:
            self.stage, self.started, self.shown = stage, now, now - 9.0 * (self.lasting or self.live)
        finished = done >= total
        if not finished and now - self.shown < (0.2 if self.live else 10.0):
            return
        self.shown = now
        if finished and not self.lasting:
            self.stage = None
            self.stream.write("\r\x1b[2K" if self.live else "")
            self.stream.flush()
            return
        line = f"  {stage}: {describe_progress(done, total, unit, now - self.started)}"
        if self.live:
            self.stream.write(f"\r\x1b[2K{line}" + ("\n" if finished else ""))
        else:
            self.stream.write(line + "\n")
        self.stream.flush()
        if finished:
            self.stage = None


class Clock:
    """Seconds per stage."""

    def __init__(self):
        self.seconds, self.last = {}, time.perf_counter()

    def lap(self, stage):
        """Note the seconds since the last lap."""
        now = time.perf_counter()
        self.seconds[stage], self.last = now - self.last, now


def describe_progress(done, total, unit, seconds):
    """Share done, rate and time left (or time taken) in words."""
    rate = done / seconds if seconds > 0 else 0.0
    words = f"{100 * done / max(total, 1):.0f} %"
    if rate > 0:
        words += f", {with_prefix(rate)}{unit}/s"
    if done >= total:
        return f"{words}, took {seconds:.1f} s"
    return words + (f", {(total - done) / rate:.0f} s left" if rate > 0 else "")


def with_prefix(number):
    """A number in three digits with k, M or G: 12.2 M."""
    for limit, divisor, prefix in ((1e9, 1e9, "G"), (1e6, 1e6, "M"), (1e3, 1e3, "k")):
        if number >= limit:
            return f"{number / divisor:.3g} {prefix}"
    return f"{number:.3g} "
