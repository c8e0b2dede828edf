"""Start a second process that compiles loops, where none are kept on this computer yet.

numba compiles one loop after the other, whatever the number of threads. The second process compiles from the last loop
that a run needs towards the first, the run itself from the first one on, as it comes to them; what either has compiled
the other takes from numba's cache on disk, so that they meet between.
"""

import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

from ..sampling.hemisphere_rays import is_compiled
from ..settings.threads import usable_threads

ROOT = Path(__file__).resolve().parents[2]  # the package: "citypv", or another name inside Blender
START = """\
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
root, sys.path[:] = Path(sys.argv[1]), sys.argv[2:]
spec = spec_from_file_location("citypv", root / "__init__.py", submodule_search_locations=[str(root)])
sys.modules["citypv"] = module_from_spec(spec)
from citypv.core.compiling.compile_loops import compile_loops
compile_loops()
"""


@contextmanager
def compile_ahead(threads=None, wanted=True):
    """Let a second process compile during the `with` block.

    Nothing is started where the loops are kept already, or with one thread. That process prints nothing, ends with the
    block or with this process, and its failure is none of the run's: the run compiles what is missing.

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
    """End the process. Files of numba's cache are whole at any time: it writes them beside and renames them."""
    child.kill()
    child.wait()
    child.stdin.close()
