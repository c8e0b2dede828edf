"""What all pictures share: letters, colours, and how one becomes part of a page."""

import base64
import io
import re

from matplotlib import style
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from .colour_map import MAPS

# By M. Okabe and K. Ito, to be told apart with any colour vision (their yellow darker, since paper
# is white); marks and dashes tell the lines apart in print.
LINES = {
    "north": {"color": "#0072B2", "marker": "s", "linestyle": (0, (5, 2))},
    "northeast": {"color": "#56B4E9", "marker": "x", "linestyle": (0, (5, 2))},
    "east": {"color": "#E69F00", "marker": "^", "linestyle": (0, (3, 1, 1, 1))},
    "southeast": {"color": "#A39A00", "marker": "+", "linestyle": "-"},
    "south": {"color": "#D55E00", "marker": "o", "linestyle": "-"},
    "southwest": {"color": "#CC79A7", "marker": "*", "linestyle": "-"},
    "west": {"color": "#009E73", "marker": "v", "linestyle": (0, (1, 1))},
    "northwest": {"color": "#000000", "marker": ".", "linestyle": (0, (1, 1))},
}
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e0",
    "legend.frameon": False,
    "svg.hashsalt": "citypv",  # the same picture has the same text
    "svg.fonttype": "path",
    "text.parse_math": False,  # names may hold any sign
}
DOTS = 160  # per inch, of pictures that are not drawn in lines


def plain_style():
    """Context in which pictures are drawn alike on every machine, whatever its settings of
    matplotlib are.
    """
    return style.context(STYLE, after_reset=True)


def make_figure(width, height):
    """An empty picture of some inches, without a window."""
    return Figure(figsize=(width, height), layout="constrained")


def colour_scale(name):
    """A colour map of the project as one of matplotlib."""
    return LinearSegmentedColormap.from_list(name, [f"#{stop}" for stop in MAPS[name].split()])


def embed_figure(figure, form="svg"):
    """A picture as text that a page can hold: data URI of an SVG or PNG.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    form : {"svg", "png"}

    Returns
    -------
    str
    """
    file = io.BytesIO()
    if form == "png":
        figure.savefig(file, format="png", dpi=DOTS, metadata={"Software": None})
        return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")
    figure.savefig(
        file, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type"))
    )
    # Without the document type, which names a file on the web.
    text = re.sub(r"<!DOCTYPE[^>]*>\s*", "", file.getvalue().decode("utf-8"))
    return "data:image/svg+xml;base64," + base64.b64encode(text.encode("utf-8")).decode("ascii")


def make_logarithmic(axes):
    """Two logarithmic axes with plain numbers."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
