"""The sections of report.html that are pictures. Needs matplotlib."""

from .draw_day import draw_day
from .draw_histograms import draw_histograms
from .draw_months import draw_months
from .draw_plan import draw_plan
from .draw_sun_path import draw_sun_path
from .html import paragraph, picture, section
from .picture import embed_figure, plain_style
from .tabulate import select_mounted

NO_PLAN = (
    "There is no plan of the city here: this folder has no shapes of the surfaces. Results of citypv simulate have "
    "them in transfer.nc, unless it was left out for its size (--transfer keeps it) or written by an earlier version."
)


def compose_pictures(results):
    """Plan, times and histograms, drawn alike on every machine."""
    with plain_style():
        return "\n".join([compose_plan(results), compose_times(results), compose_histograms(results)])


def compose_plan(results):
    """The city from above."""
    if results.outlines is None:
        return section("Plan of the city", paragraph(NO_PLAN))
    captions = {
        "roof": "Roofs from above: full load hours of pitched roofs, and of flat roofs with modules lying flat. Grey: "
        "roofs that are too small, too steep, covered, or not within 30° of a main direction.",
        "facade": "Facades as lines on the outline of the buildings: full load hours. Where several stand above each "
        "other, the highest is drawn. Facades without a line are covered by a "
        "neighbour, too small, or not within 30° of a main direction.",
    }
    kinds = select_mounted(results.faces)["kind"]
    parts = []
    for show, caption in captions.items():
        if ((kinds == "facade") == (show == "facade")).any():
            uri = embed_figure(draw_plan(results.faces, results.outlines, show), "png")
            note = " Yellow is high, dark blue is low; the two plans have different scales. North is up."
            parts.append(picture(uri, f"plan-{show}", caption + note))
    return section("Plan of the city", *(parts or [paragraph("No surface carries modules.")]))


def compose_times(results):
    """Months, hours of the day, and the sun's path."""
    site = results.summary["input"]["site"]
    known = "" if results.suns is not None else " The traced suns are listed in transfer.nc, which is missing."
    suns = draw_sun_path(results.times, results.interval, site["latitude"], site["longitude"], results.suns)
    hours = "Local solar time is UTC plus four minutes for each degree east; the sun stands highest at about 12."
    parts = []
    if len(results.groups):
        months = "Full load hours by month, means over all surfaces of a kind that face the same direction."
        day = f"Full load hours of a year by hour of the day. {hours}"
        parts.append(picture(embed_figure(draw_months(results.groups)), "months", months))
        parts.append(picture(embed_figure(draw_day(results.groups)), "day", day))
    caption = (
        "Position of the sun: pale curves for each hour of the day through the year (UTC), coloured ones for three "
        f"days. Green dots are the sun positions for which shadows and reflections were computed.{known}"
    )
    return section("Over the year and the day", *parts, picture(embed_figure(suns), "sun-path", caption))


def compose_histograms(results):
    """How much area has how many hours."""
    if not len(select_mounted(results.faces)):
        return ""
    caption = "Area by full load hours; the dashed line marks the mean. The surfaces furthest to the right yield most."
    uri = embed_figure(draw_histograms(results.faces))
    return section("How the hours are spread over the area", picture(uri, "histograms", caption))
