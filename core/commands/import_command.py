"""Import the module of a command, and with it most of the program."""

import gc
import importlib
import sys


def import_command(name):
    """Module of this package that is not imported yet, without searching it for garbage, now and at the end.

    Of thousands of modules, classes and functions nothing is garbage: the search takes a quarter of a second while they
    are made, and as long when the process ends.
    """
    known = sys.modules.get(f"{__package__}.{name}")
    if known is not None:
        return known
    collecting = gc.isenabled()
    gc.disable()
    try:
        return importlib.import_module(f".{name}", __package__)
    finally:
        gc.freeze()
        if collecting:
            gc.enable()
