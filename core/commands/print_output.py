"""Printing to standard output, whose reader may leave before the end, as in `citypv inspect CITY | head`."""

import os
import sys


def print_output(text):
    """Print text and a line end; what a reader who has left does not take is dropped.

    Parameters
    ----------
    text : str
    """
    try:
        print(text, flush=True)
    except BrokenPipeError:
        # Otherwise the interpreter flushes the buffer once more at its end, and reports the error there.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
