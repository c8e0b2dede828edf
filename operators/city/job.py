"""Work in a thread of its own, with its progress as the panel tells it."""

import os
import sys
import threading
import time

from ...core.settings.progress import CancelledError, with_prefix
from ...core.settings.threads import usable_threads
from .check_libraries import name_libraries

# above the window's own: it gets nine tenths of a core that both want; at most
NICENESS, LARGEST = (
    10,
    19,
)
COMPILING = "compiling for this computer, only once"  # name of the stage


class Job(threading.Thread):
    """Work that runs in its own thread, with its progress.

    Parameters
    ----------
    title : str
    work : callable
        Called as work(progress) in the thread.
    stages : dict of str to float, optional
        Stages of the work in their order, with the time that each takes relative to the others.
    niceness : int
        Above the window's own.
    """

    def __init__(self, title, work, stages=None, niceness=NICENESS):
        super().__init__(name=title, daemon=True)
        self.title, self.share = title, 0.0
        self.stage, self.rate, self.left = title, "", ""  # as the panel shows them
        self.result, self.error = None, None
        self.cancelled = self.dropped = False
        self._work, self._stages, self._niceness = work, stages or {}, niceness
        self._began, self._before = time.monotonic(), 0.0
        self._stage, self._entered = None, 0.0

    def cancel(self, *, drop=False):
        """Request the work to stop at its next report and keep what is done; a second time, to
        discard it.
        """
        self.dropped, self.cancelled = drop or self.cancelled, True
        self.stage = "ends, and keeps nothing" if self.dropped else "keeps what is done"
        self.rate = self.left = ""

    @property
    def text(self):
        """Progress in one line."""
        if self.cancelled:
            return f"{self.title}: {self.stage}"
        return f"{self.stage}: " + ", ".join(
            filter(None, (f"{100 * self.share:.0f} %", self.rate, self.left))
        )

    def progress(self, stage, done, total, unit):
        """Receive a progress report of core (see `core.settings.progress`)."""
        if self.cancelled:
            raise CancelledError
        now = time.monotonic()
        if stage != self._stage:
            if (
                self._stage == COMPILING
            ):  # once on a computer: what went before tells nothing of the rest
                self._began, self._before = now, self.share
            self._stage, self._entered = stage, now
        self.share = share_of_step(self._stages, stage, done / total if total else 0.0, self.share)
        self.stage = stage
        share = (self.share - self._before) / (1 - self._before)
        self.left = describe_left(now - self._began, share) if stage != COMPILING else ""
        # In the first 0.2 s of a stage its rate says nothing.
        told = done and unit and now - self._entered > 0.2
        self.rate = f"{with_prefix(done / (now - self._entered))}{unit}/s" if told else ""

    def run(self):
        """Do the work, at a lower priority than the window's on Linux, where threads have their
        own, and pass it on.

        Elsewhere `threads_beside_window` leaves a core to the window.
        """
        if sys.platform == "linux":
            own = threading.get_native_id()
            niceness = os.getpriority(os.PRIO_PROCESS, own) + self._niceness
            os.setpriority(os.PRIO_PROCESS, own, min(niceness, LARGEST))
        try:
            with name_libraries():
                self.result = self._work(self.progress)
        except BaseException as error:  # reported in Blender's main thread
            self.error = error


def share_of_step(stages, stage, share, before):
    """Share of a whole step that is done.

    Parameters
    ----------
    stages : dict of str to float
        Of `Job`; empty if not known.
    stage : str
    share : float
        Of the stage.
    before : float
        The share that was reported last: it never falls while the stages are known.

    Returns
    -------
    float
    """
    if not stages:
        return share
    if stage not in stages:
        return before
    names = list(stages)
    done = sum(stages[name] for name in names[: names.index(stage)]) + stages[stage] * share
    return max(before, done / sum(stages.values()))


def describe_left(seconds, share):
    """Time that the whole step still takes as text; "" before the estimate is worth something."""
    # Before 5 seconds and a fifth of the work a time left says nothing.
    if seconds < 5.0 or not 0.2 < share < 1:
        return ""
    left = seconds * (1 - share) / share
    return f"about {left:.0f} s left" if left < 90 else f"about {left / 60:.0f} min left"


def threads_beside_window(windowed, platform=sys.platform):
    """Number of threads of a run if the user gives none: int, or None for as many as there are
    processors.

    Parameters
    ----------
    windowed : bool
        Whether there is a window to draw.
    platform : str, optional
        As `sys.platform` names it.
    """
    return max(1, usable_threads() - 1) if windowed and platform != "linux" else None
