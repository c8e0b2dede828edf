"""report.html: pictures and tables of a run on one page that opens offline. Read this first."""

import importlib.util
from html import escape
from pathlib import Path
from string import Template

from ..settings.version import __version__
from .describe_errors import LIMITS, SPREAD, list_errors, summarise_errors
from .describe_run import describe_assumptions, describe_input, list_settings
from .html import fold, paragraph, section, table
from .tabulate import MONTHS, kind_title, tabulate_groups, tabulate_periods

NAME = "report.html"
HOURS = (
    "Full load hours are the hours in which modules at nominal power would generate the energy of a year: 800 h mean "
    "800 kWh for each kWp (kilowatt of nominal power). They refer to direct current (DC), before inverter and cables."
)
ELSEWHERE = "Further uncertainties are listed under “How sure the numbers are”."
NO_PICTURES = (
    "This page has no pictures, as matplotlib is not installed where it was written. After pip install matplotlib, "
    "citypv plot of the command line draws them."
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
    return "\n".join(
        [
            *map(lambda text: paragraph(text, "warning"), list_warnings(summary)),
            compose_totals(summary),
            compose_groups(results),
            compose_drawings(results),
            section("How sure the numbers are", *compose_errors(summary["error_budget"])),
            section("What was read", table((), describe_input(summary))),
            compose_assumptions(results),
            paragraph(f"Made by CityPV {__version__} from the files in the folder {results.name}.", "small"),
        ]
    )


def compose_drawings(results):
    """The sections with pictures; a sentence where matplotlib is missing."""
    if importlib.util.find_spec("matplotlib") is None:
        return paragraph(NO_PICTURES, "small")
    from .compose_pictures import compose_pictures

    return compose_pictures(results)


def list_warnings(summary):
    """What a reader must know before any number: list of str."""
    warnings = []
    label = summary["weather"]["label"]
    if "clear" in label.lower():
        warnings.append(f"The weather has no clouds ({label}): the hours are an upper bound, not an expectation.")
    if "climatology" in label:
        warnings.append("The weather is a climatology, not a measurement: for a design use measured or satellite data.")
    stopped = (summary.get("traced") or {}).get("interrupted")
    if stopped:
        warnings.append(
            "The run was interrupted: {suns_traced:,} of {of:,} sun positions were traced.".format(**stopped)
        )
    return warnings


def compose_totals(summary):
    """What all suitable surfaces together would give."""
    totals, flat = summary["totals"], summary["totals"].get("flat_roofs") or {}
    rows = [("Facades and pitched roofs that can carry modules", *row_of_potential(totals))]
    if flat.get("count"):
        rows.append((f"In addition {flat['count']:,} flat roofs, modules lying flat", *row_of_potential(flat)))
    head = ["", "Area for modules [m²]", "Nominal power [kWp]", "Energy in a year [MWh]", "Full load hours [h]"]
    if "mwh_ac_per_year" in totals:
        head += ["Energy after losses [MWh]"]
    hidden = totals.get("hidden_walls") or {}
    left_out = (
        f"{hidden['count']:,} walls ({hidden['area']:,.0f} m²) are left out, as a neighbouring building covers them."
        if hidden.get("count")
        else ""
    )
    return section(
        "In short",
        paragraph(f"Weather: {summary['weather']['label']}."),
        table(head, rows, numbers=range(1, len(head))),
        paragraph(
            f"This is the potential of all suitable surfaces, with {totals['area_per_kwp']:.2f} m² "
            f"of modules for each kWp. {left_out} Building law, statics, windows and cost are not considered."
        ),
        paragraph(HOURS),
        paragraph(f"{summarise_errors(summary['error_budget'])} {LIMITS}"),
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
