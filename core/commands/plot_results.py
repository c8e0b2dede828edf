"""`citypv plot`: pictures and tables of a result folder on one page, or the pictures of a world."""

import importlib.util
from pathlib import Path

from ..settings.errors import InputError


def plot_results(folder):
    """Draw the results in a folder and write report.html beside them; of a world, draw its pictures.

    Parameters
    ----------
    folder : path-like
        Of `citypv simulate`, `citypv yield` or `citypv world`. A report or pictures of an earlier call are replaced.

    Returns
    -------
    list of pathlib.Path
        Files written: the page, or the pictures.

    Raises
    ------
    InputError
        matplotlib is not installed, or the folder holds no results.
    """
    if importlib.util.find_spec("matplotlib") is None:
        raise InputError("citypv plot", "needs matplotlib, which is not installed", "type: pip install matplotlib")
    if (Path(folder) / "world.nc").is_file():
        return redraw_world(Path(folder))
    from ..plots.read_results import read_results
    from ..plots.write_report import write_report

    return [write_report(folder, read_results(folder))]


def redraw_world(folder):
    """Draw the pictures of a world anew: list of pathlib.Path."""
    from ..plots.draw_world import draw_world

    path = folder / "world.nc"
    names = draw_world(path, folder)
    if not names:
        raise InputError(path, "holds single places, of which there are no pictures", "give a world on a grid")
    return [folder / name for name in names]
