"""Compile the loops of a run for this computer, before it begins."""

from ..city.job import COMPILING


def compile_loops(progress):
    """Compile the loops of a run if they are not kept on this computer yet; returns at once if they
    are.

    Parameters
    ----------
    progress : callable
        See `core.settings.progress`.
    """
    from ...core.rays.hemisphere_rays import is_compiled

    if is_compiled():
        return
    from ...core.rays import compile_ahead

    for done, count in compile_ahead.compile_loops():
        progress(COMPILING, done, count, "loops")
