"""`citypv plot`: pictures and tables of a result folder on one page."""

import importlib.util

from ..errors import InputError


def plot_results(folder):
    """Draw the results in a folder and write report.html beside them.

    Parameters
    ----------
    folder : path-like
        Of `citypv simulate` or `citypv yield`. A report of an earlier call is replaced.

    Returns
    -------
    pathlib.Path
        Of the page.

    Raises
    ------
    InputError
        matplotlib is not installed, or the folder holds no results.
    """
    if importlib.util.find_spec("matplotlib") is None:
        raise InputError(
            "citypv plot", "needs matplotlib, which is not installed", "install it with pip install 'citypv[plot]'"
        )
    from ..plots.read_results import read_results
    from ..plots.write_report import write_report

    return write_report(folder, read_results(folder))
