"""`citypv`, `python -m citypv` and `blender --command citypv`: the command line, with Blender's
part when asked for.
"""

import atexit
import gc
import os
import sys
from contextlib import suppress
from pathlib import Path


def run_program():
    """Run the command line as a program of its own: ends the process, with main's exit status."""
    gc.set_threshold(
        100_000
    )  # of the thousands of modules and functions that are imported nothing is garbage
    for name in ("stdout", "stderr"):  # None where whoever started this has closed it
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115, until the process ends
    status = []
    atexit.register(end_at_once, status)  # the first that is registered is the last that is called
    status.append(main())
    sys.exit(status[0])


def end_at_once(status):
    """End the process without taking thousands of modules apart, which takes a fifth of a second.

    Does nothing before there is a status, or where the last output cannot be written, of which
    Python tells then.
    """
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
        if status:
            os._exit(status[0])


def main(arguments=None):
    """Run the command line.

    Parameters
    ----------
    arguments : list of str, optional
        Without the program's name; by default those of the process.

    Returns
    -------
    int
        Exit status.
    """
    from .core.commands.command_line import main as run

    return run(arguments, draw=draw_results)


def draw_results(*results, **options):
    """Blender's part, see `operators.show.draw_results`; imported when pictures are
    asked for.
    """
    from .operators.show.draw_results import draw_results as draw

    draw(*results, **options)


if __name__ == "__main__":
    run_program()
