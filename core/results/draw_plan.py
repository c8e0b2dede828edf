"""The city from above, coloured by full load hours: roofs as areas, facades as lines."""

import numpy as np
import shapely
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from .colour_map import DIVERGING, choose_range, tick_step
from .picture import colour_scale, embed_figure, make_figure
from .read_results import select_mounted
from .words import say

FROM_ABOVE = ("roof", "flat", "steep", "rack")


def draw_plan(faces, outlines, show):
    """Draw the city from above, north up.

    Parameters
    ----------
    faces : pandas.DataFrame
        faces.csv.
    outlines : Outlines
        Of its rows.
    show : {"roof", "facade"}
        Roofs, pitched and flat ones, or facades: the others stay grey.

    Returns
    -------
    matplotlib.figure.Figure
    """
    mounted = select_mounted(faces)
    chosen = mounted[(mounted["kind"] == "facade") == (show == "facade")]
    hours = chosen["full_load_hours"]
    ends = choose_range(hours.to_numpy(), chosen["area"].to_numpy())
    look = {"cmap": colour_scale("viridis"), "clim": ends}
    return _draw_surfaces(
        faces, outlines, hours.rename(say("Full load hours a year [h]")), show, look
    )


def draw_change(surfaces, outlines, show):
    """Draw what the hours of a city's surfaces gain or lose, zero in the middle; grey below two
    standard errors.

    Parameters
    ----------
    surfaces : pandas.DataFrame
        Of a Comparison.
    outlines : Outlines
        Of the later state: of the first rows.
    show : {"roof", "facade"}

    Returns
    -------
    matplotlib.figure.Figure
    """
    faces = surfaces.iloc[: len(outlines.surface_start) - 1]
    change = faces["full_load_hours_change"]
    sure = change.abs() > 2 * faces["full_load_hours_change_standard_error"]
    values = change[sure & ((faces["kind"] == "facade") == (show == "facade"))]
    most = (
        max(map(abs, choose_range(change[sure].to_numpy(), faces["area"][sure].to_numpy())))
        if sure.any()
        else 1.0
    )
    colours = LinearSegmentedColormap.from_list(
        "change", [f"#{stop}" for stop in DIVERGING.split()]
    )
    look = {"cmap": colours, "clim": (-most, most)}
    figure = _draw_surfaces(
        faces, outlines, values.rename(say("Change of the full load hours a year [h]")), show, look
    )
    new = _rows_by_height(
        outlines, np.flatnonzero(faces["kind"].isin(FROM_ABOVE) & (faces["state"] == "new"))
    )
    figure.axes[0].add_collection(
        _shade_areas(outlines, new, facecolor="none", edgecolor="black", linewidth=1.2)
    )
    return figure


def _draw_surfaces(faces, outlines, values, show, look, *, inches=10.0):
    """Draw roofs or facades, as `show` says, in the colours of `values`, a Series by surface: a
    Figure. Roofs are areas; facades are lines over grey roofs.
    """
    # A picture in the proportions of the city; roofs are drawn from the lowest to the highest.
    lower, upper = outlines.points[:, :2].min(axis=0), outlines.points[:, :2].max(axis=0)
    size, (low, high) = upper - lower, look["clim"]
    # The city may be 0.3 to 1.2 times as high as wide; the scales need 1.2 inches below it.
    figure = make_figure(
        inches, inches * float(np.clip(size[1] / max(size[0], 1e-3), 0.3, 1.2)) + 1.2
    )
    axes = figure.subplots()
    _frame_plan(axes, lower, upper)
    roofs = _rows_by_height(outlines, np.flatnonzero(faces["kind"].isin(FROM_ABOVE)))
    # Grey comes first: all roofs below facades, else roofs without a value.
    grey = [surface for surface in roofs if show == "facade" or surface not in values.index]
    axes.add_collection(
        _shade_areas(outlines, grey, facecolor="#e4e4e0", edgecolor="#a9a9a4", linewidth=0.3)
    )
    # Facades are lines beside their outline, in metres as wide as they can be told; roofs are
    # areas.
    if show == "facade":
        drawn = _rows_by_height(outlines, values.index)
        lines = [
            facade_line(outlines, surface, faces["surface_azimuth"][surface]) for surface in drawn
        ]
        points = 72 * inches / max(size)  # per metre, about
        # A facade is a line of 1.6 m on the ground, as far as a picture can show it: 1.4 to 4
        # points.
        width = float(np.clip(1.6 * points, 1.4, 4.0))
        coloured = LineCollection(
            lines, array=values[drawn].to_numpy(), linewidth=width, capstyle="butt", **look
        )
    else:
        drawn = [surface for surface in roofs if surface in values.index]
        coloured = _shade_areas(
            outlines,
            drawn,
            array=values[drawn].to_numpy(),
            edgecolor="white",
            linewidth=0.25,
            **look,
        )
    axes.add_collection(coloured)
    # The scale of colours says where values lie beyond it.
    beyond = {(1, 0): "min", (0, 1): "max", (1, 1): "both"}.get(
        ((values < low).any(), (values > high).any())
    )
    bar = figure.colorbar(
        coloured,
        ax=axes,
        location="bottom",
        extend=beyond or "neither",
        shrink=0.6,
        pad=0.02,
        aspect=40,
    )
    bar.set_label(values.name)
    return figure


def _frame_plan(axes, lower, upper):
    """Give the plan its extent, a scale bar and an arrow to the north."""
    size = upper - lower
    margin = 0.03 * max(size)
    x, y, right = lower[0], lower[1] - 1.6 * margin, upper[0] - margin
    xlim, ylim = (
        (lower[0] - margin, upper[0] + margin),
        (lower[1] - 2.4 * margin, upper[1] + margin),
    )
    axes.set(xlim=xlim, ylim=ylim, aspect="equal")
    axes.set_axis_off()
    # The scale bar takes a quarter of the picture's width at most.
    length = tick_step(0, 4 * max(0.25 * size[0], 1e-3))
    axes.plot([x, x + length], [y, y], color="black", linewidth=2.5, solid_capstyle="butt")
    axes.text(x + length + 0.4 * margin, y, f"{length:g} m", va="center", fontsize=9)
    north = {"ha": "center", "va": "center", "arrowprops": {"arrowstyle": "-|>", "color": "black"}}
    axes.annotate(
        say("N"), (right, y + 1.4 * margin), (right, y - 0.4 * margin), fontsize=10, **north
    )


def _rows_by_height(outlines, rows):
    """Rows that have an outline, in the order of their highest corner: list of int."""
    rings = {int(row): outlines.rings(row) for row in rows}
    highest = {row: own[0][:, 2].max() for row, own in rings.items() if own}
    return sorted(highest, key=lambda row: (highest[row], row))


def _shade_areas(outlines, rows, **look):
    """Some surfaces as filled areas, holes left free: a matplotlib collection."""
    return PatchCollection([PathPatch(area_path(outlines.rings(row))) for row in rows], **look)


def area_path(rings):
    """Rings seen from above as one path; holes run against the outline."""
    area = shapely.geometry.polygon.orient(
        shapely.Polygon(rings[0][:, :2], [ring[:, :2] for ring in rings[1:]])
    )
    return Path.make_compound_path(
        *(Path(ring.coords, closed=True) for ring in (area.exterior, *area.interiors))
    )


def facade_line(outlines, row, azimuth):
    """The two ends of a facade seen from above: (2, 2) [m]."""
    points = outlines.rings(row)[0][:, :2].astype(float)
    along = np.array([np.cos(np.radians(azimuth)), -np.sin(np.radians(azimuth))])
    place = points @ along
    return points[[place.argmin(), place.argmax()]]


def embed_plan(results):
    """The roofs of a city from above as text that a page can hold: data URI of a PNG."""
    return embed_figure(draw_plan(results.faces, results.outlines, "roof"), "png")
