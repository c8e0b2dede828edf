"""Progress reports of long tasks.

A report is a callable `progress(stage, done, total, unit)`. It is called repeatedly from the thread
that started the task, first with nothing done in each stage; an exception raised in it ends the
task. If it raises CancelledError, the finished part is kept if it can be used: the suns traced so
far. Otherwise the exception reaches the caller.

`core.run.interruption` turns Ctrl-C into that: the first ends tracing and keeps the suns done, the
second ends the program.
"""

import sys
import time

SUN_STAGE = "suns"  # from this stage on, a cancelled task returns a partial result


class CancelledError(Exception):
    """The user ends the task, keeping what is done."""


def silent(*report):
    """Report nothing, of `progress(stage, done, total, unit)` or of `report_share(share)`, the part
    done, 0 to 1.
    """


def report_part(report_share, begin, end, share):
    """Report a share of a part of a task, which goes from one share of the task to another."""
    report_share(begin + (end - begin) * share)


def report_polygons(progress, stage, count, share):
    """Report a share of a stage as a number of polygons."""
    progress(stage, round(share * count), count, "polygons")


class TerminalProgress:
    """Progress as one line per stage, with rate and time left, on a terminal or in a log.

    On a terminal the line is updated in place; in a log a line is written every ten seconds.

    Parameters
    ----------
    stream : text stream, optional
        By default standard error.
    lasting : bool
        Whether a finished stage keeps its line. If not, the line is erased on a terminal, and a log
        has only the lines written every ten seconds.
    """

    def __init__(self, stream=None, *, lasting=True):
        self.stream = sys.stderr if stream is None else stream
        self.lasting = lasting
        self.live = self.stream.isatty()
        self.stage, self.started, self.shown = None, 0.0, 0.0

    def __call__(self, stage, done, total, unit):
        """Update the line of a stage."""
        now = time.monotonic()
        if stage != self.stage:
            self.stage, self.started, self.shown = (
                stage,
                now,
                now - 9.0 * (self.lasting or self.live),
            )
        finished = done >= total
        if not finished and now - self.shown < (0.2 if self.live else 10.0):
            return
        self.shown = now
        line = ""
        if self.lasting or not finished:
            line = f"  {stage}: {describe_progress(done, total, unit, now - self.started)}"
            line += "\n" if finished or not self.live else ""
        self.stream.write(("\r\x1b[2K" if self.live else "") + line)
        self.stream.flush()
        if finished:
            self.stage = None


class Clock:
    """Seconds per stage: of wall time, and of this process on all processors."""

    def __init__(self):
        self.seconds, self.last = {}, time.perf_counter()
        self.processor_seconds, self.used = {}, time.process_time()

    def lap(self, stage):
        """Add the seconds since the last lap to a stage's."""
        now, used = time.perf_counter(), time.process_time()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self.last
        self.processor_seconds[stage] = self.processor_seconds.get(stage, 0.0) + used - self.used
        self.last, self.used = now, used


def describe_progress(done, total, unit, seconds):
    """Share done, rate and time left (or time taken) as text."""
    rate = done / seconds if seconds > 0 else 0.0
    words = f"{100 * done / max(total, 1):.0f} %"
    if rate > 0:
        words += f", {with_prefix(rate)}{unit}/s"
    if done >= total:
        return f"{words}, took {describe_duration(seconds)}"
    return words + (f", {describe_duration((total - done) / rate)} left" if rate > 0 else "")


def describe_duration(seconds):
    """A time in plain words: less than 0.1 s, 4.2 s, 75 s, 12 min, 3.5 h."""
    if seconds < 0.1:
        return "less than 0.1 s"
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def with_prefix(number):
    """A number in three digits with k, M or G: 12.2 M."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= size:
            return f"{number / size:.3g} {prefix}"
    return f"{number:.3g} "
