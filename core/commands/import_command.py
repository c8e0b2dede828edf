"""Import the module of a command, and with it most of the program."""

import gc
import importlib
import sys
from contextlib import contextmanager


def import_command(name):
    """Module of this package, without a search for garbage where it is not imported yet."""
    known = sys.modules.get(f"{__package__}.{name}")
    if known is not None:
        return known
    with nothing_searched():
        return importlib.import_module(f".{name}", __package__)


@contextmanager
def nothing_searched():
    """Import without searching what is imported for garbage, now and at the end.

    Of thousands of modules, classes and functions nothing is garbage: the search takes a quarter of a second while they
    are made, and as long when the process ends.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if collecting:
            gc.enable()


def compile_beside(request):
    """Context in which a second process compiles the loops of the gather estimator, where none are kept."""
    with nothing_searched():
        from ..rays.compile_ahead import compile_ahead
    return compile_ahead(request.threads, wanted=request.estimator == "gather")
