"""Start a second process that compiles loops, where none are kept on this computer yet.

numba compiles one loop after the other, whatever the number of threads. The second process compiles
from the last loop that a run needs towards the first, the run itself from the first one on, as it
comes to them; what either has compiled the other takes from numba's cache on disk, so that they
meet between.
"""

import os
import subprocess
import sys
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from threading import Thread

from numba.core.sigutils import normalize_signature

from ..settings.threads import usable_threads
from .hemisphere_rays import is_compiled

ROOT = Path(__file__).resolve().parents[2]  # the package: "citypv", or another name inside Blender
START = """\
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
root, sys.path[:] = Path(sys.argv[1]), sys.argv[2:]
spec = spec_from_file_location("citypv", root / "__init__.py", submodule_search_locations=[str(root)])
sys.modules["citypv"] = module_from_spec(spec)
from citypv.core.rays.compile_ahead import compile_loops
compile_loops()
"""


@contextmanager
def compile_ahead(threads=None, wanted=True):
    """Let a second process compile during the `with` block.

    Nothing is started where the loops are kept already, or with one thread. That process prints
    nothing, ends with the block or with this process, and its failure is none of the run's: the run
    compiles what is missing.

    Parameters
    ----------
    threads : int, optional
        Of the run; by default all processors available.
    wanted : bool
        Whether the run calls what is listed in `loops.txt`.
    """
    child = start_child() if wanted and usable_threads(threads) > 1 and not is_compiled() else None
    try:
        yield
    finally:
        if child is not None:
            stop_child(child)


def start_child():
    """The second process, or None where the system starts none."""
    if not sys.executable or getattr(sys, "frozen", False):
        return None
    command = [sys.executable, "-I", "-c", START, str(ROOT), *map(str, sys.path)]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    window = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows would open one
    with suppress(OSError):
        return subprocess.Popen(command, stdin=subprocess.PIPE, creationflags=window, **silent)
    return None


def stop_child(child):
    """End the process. Files of numba's cache are whole at any time: it writes them beside and
    renames them.
    """
    child.kill()
    child.wait()
    child.stdin.close()


def compile_loops():
    """Compile all loops. Ends early when the process that started this one ends, or closes its end
    of the pipe.
    """
    Thread(target=_end_with_parent, daemon=True).start()
    for line in reversed(read_loops()):
        compile_loop(line)


def _end_with_parent():
    """Wait for the end of the standard input, which the parent never writes to; then end this
    process.
    """
    os.read(sys.stdin.fileno(), 1)
    os._exit(0)


def read_loops():
    """Lines of `loops.txt`, in the order in which a run needs them: module, function, types of the
    arguments.
    """
    lines = Path(__file__).with_name("loops.txt").read_text("utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def compile_loop(line):
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
