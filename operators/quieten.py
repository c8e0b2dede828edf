"""Keep Blender's own chatter off the standard output, which belongs to the program that calls it."""

import ctypes
import io
import os
import sys
from contextlib import contextmanager, redirect_stdout, suppress


@contextmanager
def quieten():
    """Drop what Blender prints to the standard output meanwhile; errors go elsewhere and stay."""
    _flush()
    kept, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        # Reports of operators come through Python, the progress of a render does not.
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        _flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def _flush():
    # Blender writes through C's buffers, which Python does not empty.
    sys.stdout.flush()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
