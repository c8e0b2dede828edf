"""Write core/rays/loops.txt: the loops that a run compiles, in the order in which it needs them.

    python tools/list_loops.py           writes the file
    python tools/list_loops.py --print   prints the list instead

Runs `citypv simulate` with few rays on the city of examples/berlin and notes each call of numba's
compiler.
"""

import contextlib
import sys
import tempfile
import threading
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "core/rays/loops.txt"
HEAD = (
    "# Loops that `citypv simulate --preset draft` calls, in this order. Written by "
    "tools/list_loops.py.\n"
)
# the same loops as with all of a draft's rays
FEW = [
    "--preset",
    "draft",
    "--samples",
    "16",
    "--patch-size",
    "50",
]


def main(arguments):
    """Write or print the list."""
    berlin = ROOT / "examples/berlin"
    weather = ["--weather", str(berlin / "era5_berlin_2017.nc")]
    lines = list_loops([str(berlin / "berlin_3910_5817.gml"), *weather, *FEW])
    if arguments == ["--print"]:
        print("\n".join(lines))
    else:
        FILE.write_text(HEAD + "\n".join(lines) + "\n", "utf-8")


def list_loops(options):
    """Lines of the file for one run, with these options of `citypv simulate`."""
    from numba.core.dispatcher import Dispatcher

    from citypv.__main__ import main as citypv

    lines, inside, compile_one = [], threading.local(), Dispatcher.compile

    def note(dispatcher, signature):
        module = dispatcher.py_func.__module__
        outermost, inside.other = not getattr(inside, "other", False), True
        if outermost and module.startswith("citypv.core."):
            types = ", ".join(map(spell, getattr(signature, "args", signature)))
            lines.append(
                f"{module.removeprefix('citypv.core.')} {dispatcher.py_func.__name__} ({types},)"
            )
        try:
            return compile_one(dispatcher, signature)
        finally:
            inside.other = not outermost

    Dispatcher.compile = note
    try:
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(None):
            assert citypv(["simulate", *options, "--quiet", "--out", f"{folder}/out"]) == 0
    finally:
        Dispatcher.compile = compile_one
    return list(dict.fromkeys(lines))


def spell(kind):
    """A type of numba in the words of `numba.types`, short for ordinary arrays."""
    from numba import types

    if isinstance(kind, types.Array):
        dtype = spell(kind.dtype)
        if kind.mutable and kind.aligned and kind.layout in "AC":
            axes = [":"] * kind.ndim
            return f"{dtype}[{','.join([*axes[:-1], '::1' if kind.layout == 'C' else ':'])}]"
        return (
            f"Array({dtype}, {kind.ndim}, {kind.layout!r}, {not kind.mutable}, "
            f"aligned={kind.aligned})"
        )
    if isinstance(kind, types.BaseTuple):
        return f"Tuple(({', '.join(map(spell, kind))},))"
    assert isinstance(kind, types.Number | types.Boolean), kind
    return "boolean" if isinstance(kind, types.Boolean) else str(kind)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
