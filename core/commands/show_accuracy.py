"""`citypv accuracy`: what accuracy costs on a city, as a table, as JSON and as a picture."""

import json
import time

from ..accuracy.price_list import describe_prices, list_prices, price_as_dict
from ..results.write_summary import finite
from ..settings.errors import InputError
from ..settings.progress import TerminalProgress
from ..study import check_tracing, read_scene, read_year

PICTURES = (".png", ".svg", ".pdf")


def show_accuracy(paths, request, *, plot=None, as_json=False):
    """Predict seconds and errors of presets and settings.

    Parameters
    ----------
    paths : list of path-like
    request : Request
        Its settings are varied one at a time.
    plot : path-like, optional
        Picture to write.
    as_json : bool

    Returns
    -------
    list of str
        Lines to print.

    Raises
    ------
    InputError
    """
    if plot and not str(plot).endswith(PICTURES):
        raise InputError("--plot", f"{plot} is not a picture", f"give a name that ends in {', '.join(PICTURES)}")
    check_tracing(request)
    started, progress = time.perf_counter(), TerminalProgress(lasting=False)
    scene = read_scene(paths, request, progress)
    weather = read_year(scene.site, request)
    listed = list_prices(scene, weather, request, time.perf_counter() - started, progress)
    if plot:
        from ..plots.draw_prices import draw_prices

        draw_prices(listed, plot)
    return [json.dumps(finite(price_as_dict(listed)), indent=2)] if as_json else describe_prices(listed)
