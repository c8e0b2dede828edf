"""Suppress Blender's own messages on standard output, which is reserved for the calling program."""

import ctypes
import io
import os
import sys
from contextlib import contextmanager, redirect_stdout, suppress


@contextmanager
def quieten():
    """Discard what Blender prints to standard output; standard error is not affected."""
    _flush()
    kept, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        # Operator reports are printed by Python, render progress by C.
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        _flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def _flush():
    # Blender writes to C's stdio buffers, which Python does not flush.
    sys.stdout.flush()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
