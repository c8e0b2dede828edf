"""What a local worker loads first: Ctrl-C is for the process that started it, which then ends its workers."""

import signal


def dask_setup(worker):
    """Ignore interrupts (Dask calls this in each worker)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
