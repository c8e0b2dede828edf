"""The command line, with Blender's part of it."""

from .draw_results import draw_results


def run_command(arguments=None):
    """Run the command line; inside Blender with the arguments that follow `blender --command citypv`.

    Parameters
    ----------
    arguments : list of str, optional
        By default those of the process.

    Returns
    -------
    int
        Exit status, see `core.commands.command_line`.
    """
    from ..core.commands.command_line import main

    return main(arguments, draw=draw_results)
