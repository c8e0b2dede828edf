"""The command line inside Blender."""


def run_command(arguments):
    """Run the command line with the arguments that follow `blender --command citypv`.

    Parameters
    ----------
    arguments : list of str

    Returns
    -------
    int
        Exit status, see `core.command_line`.
    """
    from ..__main__ import main

    return main(arguments)
