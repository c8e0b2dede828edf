"""`citypv`, `python -m citypv` and `blender --command citypv`: the command line, with Blender's part when asked for."""

import sys


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
    """Blender's part, see `operators.draw_results`; imported when pictures are asked for."""
    from .operators.draw_results import draw_results as draw

    draw(*results, **options)


if __name__ == "__main__":
    sys.exit(main())
