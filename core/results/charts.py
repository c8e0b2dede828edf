"""Charts of the pages in the colours of their map, as HTML without pictures: they follow the style
sheet, light and dark, and their numbers are text.
"""

from html import escape

import numpy as np

from .colour_map import MAPS
from .read_results import kind_title, select_mounted, tabulate_histograms, tabulate_periods
from .words import number, say

STOPS = MAPS["viridis"].split()


def style_of_heat():
    """Rules of the style sheet: a class of cells, and of bars, for each stop of the map's
    colours."""
    rules = []
    for place, stop in enumerate(STOPS):
        red, green, blue = (int(stop[k : k + 2], 16) for k in (0, 2, 4))
        # The letters' colour with more contrast against it, by the luminance of sRGB.
        light = [((part / 255 + 0.055) / 1.055) ** 2.4 for part in (red, green, blue)]
        ink = "#000" if np.dot(light, (0.2126, 0.7152, 0.0722)) > 0.18 else "#fff"
        rules.append(f".v{place} {{ background: #{stop}; fill: #{stop}; color: {ink}; }}")
    return "\n".join(rules) + "\n"


def _class_of(value, most):
    """Class of a value between 0 and the highest."""
    share = np.clip(value / most, 0, 1) if most > 0 else 0
    return f"v{round(float(share) * (len(STOPS) - 1))}"


def tabulate_heat(groups, period, name):
    """Full load hours of each group by month or hour of the day, as tables with coloured cells.

    Parameters
    ----------
    groups : pandas.DataFrame
        groups.csv.
    period : {"month", "solar_hour"}
    name : callable
        Heading of a month or hour.

    Returns
    -------
    str
        A table for each kind, rows by direction; "" where there are none. All share their colours.
    """
    tables = tabulate_periods(groups, period)
    most = max((float(np.nanmax(table)) for table in tables.values()), default=0.0)
    parts = []
    # Hours of the night, in which no group yields anything, are left out.
    yields = sum((table > 0).any(axis=1) for table in tables.values())
    for kind, every_hour in tables.items():
        table = every_hour[yields > 0]
        head = "".join(f'<th scope="col">{escape(name(index))}</th>' for index in table.index)
        rows = [f"<thead><tr><td></td>{head}</tr></thead><tbody>"]
        for side, hours in table.items():
            words = say("all") if side == "none" else say(side)
            cells = "".join(
                f'<td class="{_class_of(value, most)}">{number(value, ",.0f")}</td>'
                for value in hours
            )
            rows.append(f'<tr><th scope="row">{escape(words)}</th>{cells}</tr>')
        body = "".join([*rows, "</tbody>"])
        parts.append(
            f"<div><h3>{escape(say(kind_title(kind)))}</h3>"
            f'<div class="wide" tabindex="0"><table class="heat" data-kind="{escape(kind)}">{body}</table></div>'
            "</div>"
        )
    return "\n".join([f'<div class="panels {period}">', *parts, "</div>"]) if parts else ""


def draw_histograms(faces):
    """Area by full load hours, a chart for each kind; bars have the colours of the map: str.

    Parameters
    ----------
    faces : pandas.DataFrame
        Of `count_faces`.
    """
    mounted = select_mounted(faces)
    edges, areas = tabulate_histograms(mounted)
    return "\n".join(
        [
            '<div class="panels small-ones">',
            *(
                _draw_histogram(kind, edges, area, mounted[mounted["kind"] == kind])
                for kind, area in areas.items()
            ),
            "</div>",
        ]
    )


def _draw_histogram(kind, edges, area, mounted, *, width=480, height=230, left=8, bottom=32):
    """HTML figure of one kind of surface: its area by classes of full load hours as bars, its mean
    as a dashed line, and a caption; sizes in units of the drawing.
    """
    mean = np.average(mounted["full_load_hours"], weights=mounted["area"])
    across = (width - 2 * left) / edges[-1]
    top, tall = 8, height - bottom - 8
    parts = []
    # A bar for each class of hours, as high as its area; the pointer shows its numbers.
    for low, high, value in zip(edges[:-1], edges[1:], area, strict=True):
        size = tall * value / area.max()
        parts.append(
            f'<rect class="{_class_of((low + high) / 2, edges[-1])}" x="{left + low * across:.1f}" '
            f'y="{top + tall - size:.1f}" width="{max((high - low) * across - 1, 0.5):.1f}" '
            f'height="{size:.1f}"><title>{escape(_words_of_bar(low, high, value))}</title></rect>'
        )
    # The mean, weighted by area, then an axis with three numbers: 0, half, and the upper edge.
    middle = left + mean * across
    parts.append(
        f'<line class="mean" x1="{middle:.1f}" x2="{middle:.1f}" y1="{top}" y2="{top + tall}"/>'
    )
    parts.append(f'<line x1="{left}" x2="{width - left}" y1="{top + tall}" y2="{top + tall}"/>')
    for share in (0, 0.5, 1):
        place = f'x="{left + share * edges[-1] * across:.0f}" y="{height - 6}"'
        anchor = {0: "start", 0.5: "middle", 1: "end"}[share]
        parts.append(f'<text {place} text-anchor="{anchor}">{number(share * edges[-1])} h</text>')
    # The caption is the drawing's description for screen readers, too.
    words = say(
        "{kind}: mean {mean:,.0f} h, {area:,.0f} m²",
        kind=say(kind_title(kind)),
        mean=mean,
        area=mounted["area"].sum(),
    )
    return (
        f'<figure><svg class="bars" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="{escape(words)}">{"".join(parts)}</svg>'
        f"<figcaption>{escape(words)}</figcaption></figure>"
    )


def _words_of_bar(low, high, area):
    """What a bar says where the mouse rests on it."""
    return say("{low:,.0f} to {high:,.0f} h: {area:,.0f} m²", low=low, high=high, area=area)
