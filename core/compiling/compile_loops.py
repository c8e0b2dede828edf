"""The second process: compile what `loops.txt` lists into numba's cache, from its last line to its first."""

import os
import sys
from importlib import import_module
from pathlib import Path
from threading import Thread

from numba.core.sigutils import normalize_signature

LOOPS = Path(__file__).with_name("loops.txt")
CORE = __package__.rpartition(".")[0]


def compile_loops():
    """Compile all loops. Ends early when the process that started this one ends, or closes its end of the pipe."""
    Thread(target=end_with_parent, daemon=True).start()
    for line in reversed(read_loops()):
        compile_loop(line)


def end_with_parent():
    """Wait for the end of the standard input, which the parent never writes to; then end this process."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(0)


def read_loops():
    """Lines of `loops.txt`, in the order in which a run needs them: module, function, types of the arguments."""
    lines = LOOPS.read_text("utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def compile_loop(line):
    """Compile one loop, or load it from the cache, with the loops that it calls.

    Parameters
    ----------
    line : str
        Module of core, function and types of the arguments as numba writes them, separated by a blank.

    Returns
    -------
    numba.core.dispatcher.Dispatcher
    """
    module, function, arguments = line.split(" ", 2)
    loop = getattr(import_module(f"{CORE}.{module}"), function)
    types, _ = normalize_signature(arguments)  # of a text, numba's cache would keep the letters
    loop.compile(types)
    return loop
