"""report.html: how much, where and how sure, the city in 3D, charts and tables of a run on one page
that opens offline.

Plans need matplotlib, which Blender's own Python lacks: there the page has none.
"""

import importlib.util
from datetime import UTC, datetime
from math import isnan
from pathlib import Path

from ..city.classify import PAPER
from ..settings.version import __version__
from .charts import draw_histograms, tabulate_heat
from .describe_buildings import compose_building
from .describe_errors import LIMITS, SPREAD, list_errors, summarise_errors
from .describe_run import (
    attributions_of,
    describe_assumptions,
    describe_edge,
    describe_findings,
    describe_input,
    describe_left_out,
    describe_poor_years,
    describe_strings,
    describe_windows,
    has_losses,
    list_settings,
)
from .group_sums import compose_sums
from .headline import compose_headline
from .output_folder import write_whole
from .pack_city import pack_city
from .page import fill_page, fold, paragraph, picture, section, table
from .read_results import MONTHS, kind_title, tabulate_periods, town_of
from .words import number, read_html, say, say_weather, speaking

HOURS = (
    "Full load hours are the hours in which modules at nominal power would generate the energy of "
    "a year: 800 h mean 800 kWh for each kWp (kilowatt of nominal power). They are direct current "
    "(DC), before inverter and cables.",
    "Full load hours are the hours in which modules at nominal power would generate the energy of "
    "a year: 800 h mean 800 kWh for each kWp (kilowatt of nominal power). They are what is fed in "
    "(AC), after losses and inverter.",
)
CAPTIONS = {
    "plan-roof": "Roofs from above: full load hours of pitched, steep and flat roofs, and of racks. "
    "Grey: roofs that carry no modules. Yellow is high, dark blue is low; the two plans have "
    "different scales. North is up.",
    "plan-facade": "Facades as lines on the outline of the buildings: full load hours. Where several "
    "stand above each other, the highest is drawn. Facades without a line carry no modules. Yellow "
    "is high, dark blue is low; the two plans have different scales. North is up.",
    "sun-path": "Position of the sun: pale curves for each hour of the day through the year (UTC), "
    "coloured ones for three days. Green dots are the sun positions for which shadows and "
    "reflections were computed.",
}
MOST_DATA = 15_000_000  # characters that the 3D view may add to the page


def write_report(folder, results, *, title="", attribution="", language="en", districts=None):
    """Write report.html into a folder, whole or not at all.

    Parameters
    ----------
    folder : path-like
    results : Results
    title : str
        By default with the name of the folder.
    attribution : str
        Source and licence of the city model; "": as its files say.
    language : str
        Of `words.list_languages`.
    districts : str, optional
        FILE or FILE:COLUMN of districts, in place of those that the run was given.

    Returns
    -------
    pathlib.Path
        Of the page.
    """
    path = Path(folder) / "report.html"
    with speaking(language):
        sources = attribution or "; ".join(attributions_of(results.summary))
        written = datetime.fromtimestamp((Path(folder) / "summary.json").stat().st_mtime, UTC)
        origin = describe_origin(results.summary, written, sources)
        city, data = compose_city(results, origin=origin)
        known = results.buildings is not None
        town = town_of(results.buildings["address"]) if known else ""
        heading = title or say("Solar potential: {name}", name=town or results.name)
        body = _compose_body(results, *city, compose_sums([folder], districts))
        page = fill_page(heading, f"{origin}\n{body}", data)
    write_whole(path, lambda file: file.write_text(page, encoding="utf-8", newline="\n"))
    return path


def describe_origin(summary, written, attribution, basemap=""):
    """A paragraph with the date of the results, their weather, the source of the city model and
    the server of the `basemap`.
    """
    words = [
        say("Results of {date}.", date=written.strftime(say("%Y-%m-%d"))),
        say("Weather: {label}.", label=say_weather(summary["weather"]["label"])),
    ]
    if attribution:
        words.append(say("City model: {source}.", source=attribution.rstrip(".")))
    if basemap:
        words.append(say("Basemap: {host}.", host=basemap))
    return paragraph(" ".join(words), "origin")


def compose_city(results, change=None, *, origin=""):
    """Of the city, the 3D view and the tables that belong to it, with the page of a building, (str,
    str), and its data, parameters as of `pack_city`; a city that is too large gets words alone.

    `origin` is of `describe_origin`.
    """
    data = pack_city(results, change)
    if len(data) > MOST_DATA:  # the modules are what a reader misses least
        data = pack_city(results, change, with_modules=False)
    if len(data) <= MOST_DATA:
        tables = read_html("viewer_tables.html") + compose_building(origin, results.zone)
        return (read_html("viewer.html"), tables), data
    size = {"size": len(data) / 1e6, "most": MOST_DATA / 1e6}
    too_large = (
        "The city is too large to be shown in 3D on this page: its {count:,} surfaces would take "
        "{size:.0f} MB, of which there may be {most:.0f}. citypv site makes a map of any size; the "
        "tables beside this page have all numbers."
    )
    return (paragraph(say(too_large, count=len(results.faces), **size), "warning"), ""), ""


def _compose_body(results, view, tables, sums):
    """All sections of the page, as HTML: how much, how sure and where, before any table.

    Parameters
    ----------
    results : Results
    view, tables : str
        Of `compose_city`.
    sums : str
        Of `compose_sums`.
    """
    summary = results.summary
    # The plans are pictures, only where a drawing library is installed; else a sentence says so.
    no_pictures = (
        "There are no plans of the city here, as matplotlib is not installed where this page was "
        "written. After pip install matplotlib, citypv plot of the command line draws them."
    )
    pictures = paragraph(say(no_pictures), "small")
    if importlib.util.find_spec("matplotlib") is not None:
        from .draw_results import draw_report

        pictures = "\n".join(_compose_pictures(results, draw_report(results)))
    # What a reader must know first, then sums, then buildings and groups, then errors and sources.
    return "\n".join(
        [
            *(paragraph(text, "warning") for text in list_warnings(summary)),
            compose_headline(summary),
            view,
            compose_totals(summary),
            sums,
            tables,
            _compose_groups(results),
            pictures,
            compose_errors(summary),
            section(
                say("What was read"),
                fold(
                    say("Files, place and findings"),
                    table((), describe_input(summary))
                    + table((), describe_findings(summary), english=(1,)),
                ),
            ),
            section(
                say("What was assumed"),
                table((), describe_assumptions(summary)),
                fold(
                    say("Every setting of the run"),
                    table(
                        (say("Setting"), say("Option"), say("Value")),
                        list_settings(summary),
                        english=(0, 1, 2),
                    ),
                ),
            ),
            paragraph(
                say(
                    "Made by CityPV {version} from the files in the folder {name}.",
                    version=__version__,
                    name=results.name,
                ),
                "small",
            ),
        ]
    )


def compose_errors(summary):
    """How far the numbers hold, for the report and the solar map."""
    parts = list_errors(summary["error_budget"])
    return section(
        say("How sure the numbers are"),
        paragraph(summarise_errors(summary)),
        table((say("Part"), say("Percent of the full load hours")), parts, numbers=(1,)),
        paragraph(say("± is a {spread}.", spread=say(SPREAD)) + " " + say(LIMITS), "small"),
    )


def _compose_pictures(results, drawn):
    """Sections with the plans, the course of year and day, and the spread over the area: yields
    str.

    Parameters
    ----------
    results : Results
    drawn : dict of str to str
        Of `draw_results.draw_report`.
    """
    plans = [name for name in ("plan-roof", "plan-facade") if name in drawn]
    no_plan = (
        "There is no plan of the city here: the light is that of a transfer.nc without "
        "shapes of the surfaces."
    )
    missing = no_plan if results.outlines is None else "No surface carries modules."
    yield section(
        say("Plan of the city"),
        '<div class="panels plans">',
        *(picture(drawn[name], name, say(CAPTIONS[name])) for name in plans),
        "</div>",
        "" if plans else paragraph(say(missing)),
    )
    yield section(
        say("The sun over the year"),
        picture(drawn["sun-path"], "sun-path", say(CAPTIONS["sun-path"])),
    )


def list_warnings(summary):
    """What a reader must know before any number: list of str."""
    warnings = []
    label = summary["weather"]["label"]
    if "clear" in label.lower():
        warnings.append(
            say(
                "The weather has no clouds ({label}): the hours are an upper bound, not an "
                "expectation.",
                label=label,
            )
        )
    if stopped := (summary.get("traced") or {}).get("interrupted"):
        warnings.append(
            say(
                "The run was interrupted: {suns_traced:,} of {of:,} sun positions were traced.",
                **stopped,
            )
        )
    return warnings


def compose_totals(summary):
    """Section of HTML: what all suitable surfaces together would give, what windows take, and what
    carries no modules.
    """
    # Columns of the table, with energy before losses where losses count; rows are all, then each
    # kind.
    totals, some = summary["totals"], summary["settings"]["sectors"] == PAPER
    columns = {
        "module_area": say("Area for modules [m²]"),
        "kwp": say("Nominal power [kWp]"),
        "mwh_per_year": say("Energy in a year [MWh]"),
        "full_load_hours": say("Full load hours [h]"),
    }
    if has_losses(summary):
        columns["mwh_dc_per_year"] = say("Before losses, DC [MWh]")
    # With the paper's sectors the first row counts only some directions, and flat roofs stand
    # beside it.
    every = (
        say("Facades and roofs of 15° to 60° within 30° of a main direction")
        if some
        else say("All")
    )
    parts = {every: totals}
    for kind, total in totals["kinds"].items():
        beside = say(", beside these") if some and kind == "flat" else ""
        parts[say(kind_title(kind)) + beside] = total
    rows = [
        [name, *(number(part.get(column)) for column in columns)] for name, part in parts.items()
    ]
    head = ["", *columns.values()]
    # What the sums mean and what they leave out stands below them.
    meaning = say(
        "This is the potential of all suitable surfaces, with {area:,.2f} m² of modules for each "
        "kWp. Building law, statics and cost are not considered.",
        area=totals["area_per_kwp"],
    )
    edge = filter(None, [describe_edge(summary), describe_poor_years(summary)])
    return section(
        say("In short"),
        table(head, rows, numbers=range(1, len(head))),
        '<div class="notes">',
        paragraph(meaning),
        paragraph(describe_windows(summary)),
        *(paragraph(text) for text in describe_left_out(summary)),
        paragraph(describe_strings(totals)),
        paragraph(say(HOURS[has_losses(summary)])),
        *map(paragraph, edge),
        "</div>",
    )


def _compose_groups(results):
    """Sections of HTML: the groups with their hours and errors, year by year where there are
    several, and charts of months, hours of the day, and area.
    """
    # A row for each group of a year.
    groups = results.groups[results.groups["period"] == "annual"]
    head = [say("Surfaces"), say("facing"), say("Number"), say("Area [m²]")]
    head += [say("Full load hours [h]"), say("± [h]")]
    rows = []
    for one in groups.to_dict("records"):
        error = one["full_load_hours_standard_error"]
        row = [say(kind_title(one["kind"])), say(one["orientation"])]
        row += [number(one["count"]), number(one["area"]), number(one["full_load_hours"], ",.1f")]
        rows.append([*row, say("unknown") if isnan(error) else number(error, ".2g")])
    spread = say(
        "± is the {spread}. Further uncertainties are listed under “How sure the numbers are”.",
        spread=say(SPREAD),
    )
    # Months and hours of the day as coloured tables, the area by hours as bars.
    months_caption = (
        "Full load hours by month, means over all surfaces of a kind that face the same direction."
    )
    day_caption = (
        "Full load hours of a year by hour of the day. Local solar time is UTC plus four "
        "minutes for each degree east; the sun stands highest at about 12."
    )
    histogram_caption = (
        "Area by full load hours; the dashed line marks the mean. The surfaces furthest to "
        "the right yield most."
    )
    charts = {
        months_caption: tabulate_heat(
            results.groups, "month", lambda month: say(MONTHS[month - 1])
        ),
        day_caption: tabulate_heat(results.groups, "solar_hour", str),
        histogram_caption: draw_histograms(results.faces),
    }
    # A chart without any values is left out.
    titles = say("Over the year"), say("Over the day"), say("Over the area")
    return "\n".join(
        [
            section(
                say("Full load hours by kind and direction"),
                _fold_long(head, rows, numbers=range(2, len(head))),
                paragraph(spread, "small"),
                _fold_years(results.groups),
            ),
            *(
                section(title, paragraph(say(caption), "small"), chart)
                for title, (caption, chart) in zip(titles, charts.items(), strict=True)
                if chart
            ),
        ]
    )


def _fold_long(head, rows, *, numbers, most=12):
    """A table, folded where it is long."""
    content = table(head, rows, numbers=numbers)
    if len(rows) <= most:
        return content
    return fold(say("All {count:,} rows", count=len(rows)), content)


def _fold_years(groups):
    """Table of the hours by year, folded; "" of a single one."""
    parts = []
    for kind, hours in tabulate_periods(groups, "year").items():
        head = [say(kind_title(kind)), *map(say, hours.columns)]
        rows = [
            [str(year), *(number(value, ",.1f") for value in row)]
            for year, row in zip(hours.index, hours.to_numpy(), strict=True)
        ]
        parts.append(table(head, rows, numbers=range(1, len(head))))
    return fold(say("Full load hours of each year [h]"), "\n".join(parts)) if parts else ""
