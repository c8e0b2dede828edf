"""Compile loops before a run needs them, so that its progress can be shown."""

from importlib import import_module
from pathlib import Path

from numba.core.sigutils import normalize_signature


def read_loops():
    """Lines of `loops.txt`, in the order in which a run needs them: module, function, types of the
    arguments.
    """
    lines = Path(__file__).with_name("loops.txt").read_text("utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def _compile_loop(line):
    """Compile one loop, or load it from the cache, with the loops that it calls.

    Parameters
    ----------
    line : str
        Module of core, function and types of the arguments as numba writes them, separated by a
        blank.

    Returns
    -------
    numba.core.dispatcher.Dispatcher
    """
    module, function, arguments = line.split(" ", 2)
    loop = getattr(import_module(f"{__package__.rpartition('.')[0]}.{module}"), function)
    types, _ = normalize_signature(arguments)  # of a text, numba's cache would keep the letters
    loop.compile(types)
    return loop


def compile_loops():
    """Compile all loops, one after the other.

    Yields
    ------
    done, count : int
        Before each loop, and at the end.
    """
    loops = read_loops()
    for number, loop in enumerate(loops):
        yield number, len(loops)
        _compile_loop(loop)
    yield len(loops), len(loops)
