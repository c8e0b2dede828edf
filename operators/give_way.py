"""Let background work give way to Blender's window, so that it stays fluent on a machine with few free cores."""

import os
import sys
import threading

from ..core.settings.threads import usable_threads

NICENESS = 10  # above the window's own: it gets nine tenths of a core that both want
LARGEST = 19


def give_way():
    """Lower the priority of the calling thread, and of the threads that it will start.

    On Linux, where threads have priorities of their own; elsewhere `threads_beside_window` leaves a core to the window.
    """
    if sys.platform == "linux":
        own = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, own, min(os.getpriority(os.PRIO_PROCESS, own) + NICENESS, LARGEST))


def threads_beside_window(windowed, platform=sys.platform):
    """Number of threads of a run if the user gives none: int, or None for as many as there are processors.

    Parameters
    ----------
    windowed : bool
        Whether there is a window to draw.
    platform : str, optional
        As `sys.platform` names it.
    """
    return max(1, usable_threads() - 1) if windowed and platform != "linux" else None
