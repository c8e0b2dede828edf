"""report.html: pictures and tables of a run on one page that opens offline. Read this first."""

from html import escape
from pathlib import Path
from string import Template

from ..version import __version__
from .describe_errors import LIMITS, SPREAD, list_errors, summarise_errors
from .describe_run import describe_assumptions, describe_input, list_settings
from .draw_day import draw_day
from .draw_histograms import draw_histograms
from .draw_months import MONTHS, draw_months
from .draw_plan import draw_plan
from .draw_sun_path import draw_sun_path
from .html import fold, paragraph, picture, section, table
from .picture import embed_figure, kind_title, plain_style
from .tabulate import select_mounted, tabulate_groups, tabulate_periods

NAME = "report.html"
HOURS = (
    "Full load hours are the hours in which modules at full power would make the energy of a year: 800 h mean 800 kWh "
    "for each kWp (kilowatt of nominal power). They are direct current (DC), before inverter and cables."
)
ELSEWHERE = "Further uncertainties are listed under “How sure the numbers are”."
NO_PLAN = (
    "There is no plan of the city here: this folder has no shapes of the surfaces. Results of citypv simulate have "
    "them in transfer.nc, unless it was left out for its size (--transfer keeps it) or written by an earlier version."
)
PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 16px/1.5 "DejaVu Sans", Verdana, Arial, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto;
  padding: 0 1rem; background: #fff; }
h1 { font-size: 1.7rem; margin-bottom: 0.2rem; }
h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
figure { margin: 1.2rem 0; break-inside: avoid; }
img { max-width: 100%; height: auto; }
figcaption { font-size: 0.9rem; color: #444; }
table { border-collapse: collapse; margin: 0.8rem 0; font-size: 0.92rem; }
th, td { text-align: left; padding: 0.25rem 0.9rem 0.25rem 0; border-bottom: 1px solid #e3e3e0; vertical-align: top; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
.warning { border-left: 4px solid #D55E00; padding-left: 0.8rem; }
.small { font-size: 0.9rem; color: #444; }
summary { cursor: pointer; margin: 0.6rem 0; }
</style>
</head>
<body>
<h1>$title</h1>
$body
</body>
</html>
""")


def write_report(folder, results):
    """Write report.html into a folder, whole or not at all.

    Parameters
    ----------
    folder : path-like
    results : Results

    Returns
    -------
    pathlib.Path
        Of the page.
    """
    path = Path(folder) / NAME
    page = PAGE.substitute(title=escape(f"Solar potential: {results.name}"), body=compose_body(results))
    unfinished = path.with_name(f".{NAME}.unfinished")
    try:
        unfinished.write_text(page, encoding="utf-8")
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path


def compose_body(results):
    """All sections of the page."""
    summary = results.summary
    with plain_style():
        return "\n".join(
            [
                *map(lambda text: paragraph(text, "warning"), list_warnings(summary)),
                compose_totals(summary),
                compose_groups(results),
                compose_plan(results),
                compose_times(results),
                compose_histograms(results),
                section("How sure the numbers are", *compose_errors(summary["error_budget"])),
                section("What was read", table((), describe_input(summary))),
                compose_assumptions(results),
                paragraph(f"Made by CityPV {__version__} from the files in the folder {results.name}.", "small"),
            ]
        )


def list_warnings(summary):
    """What a reader must know before any number: list of str."""
    warnings = []
    label = summary["weather"]["label"]
    if "clear" in label.lower():
        warnings.append(f"The weather has no clouds ({label}): the hours are an upper bound, not an expectation.")
    stopped = (summary.get("traced") or {}).get("interrupted")
    if stopped:
        warnings.append(
            "The run was interrupted: {suns_traced:,} of {of:,} sun positions were traced.".format(**stopped)
        )
    return warnings


def compose_totals(summary):
    """What all suitable surfaces together would give."""
    totals, flat = summary["totals"], summary["totals"].get("flat_roofs") or {}
    rows = [("Facades and pitched roofs that modules may be mounted on", *row_of_potential(totals))]
    if flat.get("count"):
        rows.append(
            (f"Flat roofs ({flat['count']:,}), modules lying flat, not among those above", *row_of_potential(flat))
        )
    head = ["", "Area for modules [m²]", "Nominal power [kWp]", "Energy in a year [MWh]", "Full load hours [h]"]
    if "mwh_ac_per_year" in totals:
        head += ["Energy after losses [MWh]"]
    hidden = totals.get("hidden_walls") or {}
    left_out = (
        f"Left out are {hidden['count']:,} walls ({hidden['area']:,.0f} m²) that a neighbouring building covers."
        if hidden.get("count")
        else ""
    )
    return section(
        "In short",
        paragraph(f"Weather: {summary['weather']['label']}."),
        table(head, rows, numbers=range(1, len(head))),
        paragraph(
            f"If every suitable surface bore modules: {totals['area_per_kwp']:.2f} m² make a kWp. {left_out} "
            "What may be built, statics, windows and cost are not judged."
        ),
        paragraph(HOURS),
        paragraph(summarise_errors(summary["error_budget"])),
    )


def row_of_potential(total):
    """Area, power, energy and hours as text."""
    values = [
        total.get("module_area", total["eligible_area"]),
        total["kwp"],
        total["mwh_per_year"],
        total.get("full_load_hours"),
    ]
    values += [total["mwh_ac_per_year"]] if "mwh_ac_per_year" in total else []
    return ["–" if value is None else f"{value:,.0f}" for value in values]


def compose_groups(results):
    """The groups with their hours and errors, year by year where there are several."""
    groups = tabulate_groups(results.groups, results.faces)
    after_losses = "specific_yield" in groups
    head = ["Surfaces", "facing", "Number", "Area [m²]", "Full load hours [h]", "± [h]"]
    head += ["After losses [kWh/kWp]"] if after_losses else []
    rows = []
    for one in groups.to_dict("records"):
        error = f"{one['error']:.2g}" if one["error"] == one["error"] else "unknown"
        row = [kind_title(one["kind"]), one["orientation"], f"{one['count']:,.0f}", f"{one['area']:,.0f}"]
        row += [f"{one['full_load_hours']:.1f}", error]
        rows.append(row + ([f"{one['specific_yield']:.1f}"] if after_losses else []))
    years = fold_periods(results.groups, "year", "Full load hours of each year [h]", str)
    return section(
        "Full load hours by kind and direction",
        table(head, rows, numbers=range(2, len(head))),
        paragraph(f"± is the {SPREAD}. {ELSEWHERE} A surface faces a direction within 30°.", "small"),
        fold_periods(results.groups, "month", "Full load hours of each month [h]", lambda month: MONTHS[month - 1]),
        years,
    )


def fold_periods(groups, period, title, name):
    """Table of the hours by month or year, folded; "" where there are none."""
    parts = []
    for kind, hours in tabulate_periods(groups, period).items():
        head = [kind_title(kind), *hours.columns]
        rows = [
            [name(index), *(f"{value:.1f}" for value in row)]
            for index, row in zip(hours.index, hours.to_numpy(), strict=True)
        ]
        parts.append(table(head, rows, numbers=range(1, len(head))))
    return fold(title, "\n".join(parts)) if parts else ""


def compose_plan(results):
    """The city from above."""
    if results.outlines is None:
        return section("Plan of the city", paragraph(NO_PLAN))
    captions = {
        "roof": "Roofs from above: full load hours of pitched roofs, and of flat roofs with modules lying flat. Grey: "
        "roofs that are too small, too steep, covered, or face no main direction.",
        "facade": "Facades as lines on the outline of the buildings: full load hours. Where several stand above each "
        "other, the highest is drawn. Without a line: covered by a neighbour, too small, or between two directions.",
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
        months = "Full load hours of each month, means over all surfaces of a kind that face the same direction."
        day = f"In which hours of the day the full load hours of a year arise. {hours}"
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
    caption = (
        "How much area has how many full load hours; the dashed line marks the mean. Modules pay first where the bars "
        "stand furthest to the right."
    )
    uri = embed_figure(draw_histograms(results.faces))
    return section("How the hours are spread over the area", picture(uri, "histograms", caption))


def compose_errors(budget):
    """The error budget: a sentence, a table, and what is not in it."""
    return (
        paragraph(summarise_errors(budget)),
        table(("Part", "Percent of the full load hours"), list_errors(budget), numbers=(1,)),
        paragraph(f"± is a {SPREAD}. {LIMITS}", "small"),
    )


def compose_assumptions(results):
    """What the results rest on, all settings folded."""
    settings = table(("Setting", "Option", "Value"), list_settings(results.summary))
    return section(
        "What was assumed",
        table((), describe_assumptions(results.summary)),
        fold("Every setting of the run", settings),
    )
