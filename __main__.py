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
    from .core.command_line import main as run

    return run(arguments, draw=draw_results)


def draw_results(folder, scene, transfer, energy, note, *, pictures):
    """Let Blender write `city.blend` and `preview.png` into a folder.

    Parameters
    ----------
    folder : pathlib.Path
    scene : Scene
    transfer : Transfer
    energy : Energy
    note : str
        Printed beside the legend.
    pictures : list of {'blend', 'preview'}
    """
    if "blend" in pictures:
        from .operators.write_blend import write_blend

        write_blend(folder / "city.blend", scene, transfer, energy, note)
    if "preview" in pictures:
        from .operators.render_preview import render_preview

        render_preview(folder / "preview.png", scene, transfer, energy, note)


if __name__ == "__main__":
    sys.exit(main())
