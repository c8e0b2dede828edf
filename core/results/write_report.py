"""report.html: the city in 3D, pictures and tables of a run on one page that opens offline.

The page may load nothing and run nothing but the two scripts whose hashes its
Content-Security-Policy names. Whatever the pieces of the page are given is escaped; what they
return is not to be escaped again. Pictures need matplotlib, which Blender's own Python lacks: there
the page has tables only.
"""

import base64
import hashlib
import importlib.util
from datetime import UTC, datetime
from html import escape
from math import isnan
from pathlib import Path
from string import Template

from ..city.classify import PAPER
from ..settings.version import __version__
from .describe_run import (
    LIMITS,
    SPREAD,
    attributions_of,
    describe_assumptions,
    describe_edge,
    describe_input,
    describe_left_out,
    describe_poor_years,
    describe_strings,
    describe_windows,
    has_losses,
    list_errors,
    list_settings,
    summarise_errors,
)
from .draw_districts import draw_map, read_districts_of, tabulate_districts
from .output_folder import write_whole
from .pack_city import pack_city
from .read_results import MONTHS, kind_title, tabulate_periods
from .words import WEB, read_html, say, speaking, spoken, words_as_data

HOURS = (
    "Full load hours are the hours in which modules at nominal power would generate the energy of "
    "a year: 800 h mean "
    "800 kWh for each kWp (kilowatt of nominal power). They are "
)
OF_WHAT = (
    "direct current (DC), before inverter and cables.",
    "what is fed in (AC), after losses and inverter.",
)
NO_PICTURES = (
    "This page has no pictures, as matplotlib is not installed where it was written. After pip "
    "install matplotlib, "
    "citypv plot of the command line draws them."
)
NO_PLAN = (
    "There is no plan of the city here: the light is that of a transfer.nc without shapes of the "
    "surfaces."
)
CAPTIONS = {
    "plan-roof": "Roofs from above: full load hours of pitched, steep and flat roofs, and of racks. Grey: roofs that "
    "carry no modules. Yellow is high, dark blue is low; the two plans have different scales. "
    "North is up.",
    "plan-facade": "Facades as lines on the outline of the buildings: full load hours. Where several stand above each "
    "other, the highest is drawn. Facades without a line carry no modules. Yellow is high, dark "
    "blue is low; the two "
    "plans have different scales. North is up.",
    "months": (
        "Full load hours by month, means over all surfaces of a kind that face the same direction."
    ),
    "day": "Full load hours of a year by hour of the day. Local solar time is UTC plus four minutes for each degree "
    "east; the sun stands highest at about 12.",
    "sun-path": "Position of the sun: pale curves for each hour of the day through the year (UTC), coloured ones for "
    "three days. Green dots are the sun positions for which shadows and reflections were computed.",
    "histograms": "Area by full load hours; the dashed line marks the mean. The surfaces furthest to the right yield "
    "most.",
}
SECTIONS = {
    "Plan of the city": ("plan-roof", "plan-facade"),
    "Over the year and the day": ("months", "day", "sun-path"),
    "How the hours are spread over the area": ("histograms",),
}
SCRIPTS = ("viewer.js", "supply.js", "report.js")
NONE = "'none'"
MOST_DATA = 15_000_000  # characters that the 3D view may add to the page
TOO_LARGE = (
    "The city is too large to be shown in 3D on this page: its {count:,} surfaces would take "
    "{size:.0f} MB, of which "
    "there may be {most:.0f}. citypv site makes a map of any size; the tables beside this page "
    "have all numbers."
)


def write_report(folder, results, *, title="", attribution="", language="en"):
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

    Returns
    -------
    pathlib.Path
        Of the page.
    """
    path = Path(folder) / "report.html"
    with speaking(language):
        city, data = compose_city(results)
        sources = attribution or "; ".join(attributions_of(results.summary))
        written = datetime.fromtimestamp((Path(folder) / "summary.json").stat().st_mtime, UTC)
        districts = compose_districts(read_districts_of([Path(folder)]))
        parts = describe_origin(written, sources), compose_body(results, city, districts)
        body = "\n".join(parts)
        page = fill_page(title or f"Solar potential: {results.name}", body, data)
    write_whole(path, lambda file: file.write_text(page, encoding="utf-8", newline="\n"))
    return path


def describe_origin(written, attribution):
    """When the results were written, and whose city model they rest on: a paragraph."""
    source = f" City model: {attribution.rstrip('.')}." if attribution else ""
    return paragraph(f"Results of {written:%Y-%m-%d}.{source}", "small")


def compose_city(results, change=None):
    """Section of the 3D view and its data, parameters as of `pack_city`; a city that is too large
    gets words alone.
    """
    data = pack_city(results, change)
    if len(data) > MOST_DATA:  # the modules are what a reader misses least
        data = pack_city(results, change, with_modules=False)
    if len(data) <= MOST_DATA:
        return read_html("viewer.html"), data
    words = TOO_LARGE.format(count=len(results.faces), size=len(data) / 1e6, most=MOST_DATA / 1e6)
    return paragraph(words, "warning"), ""


def fill_page(title, body, data=""):
    """A page that may load nothing, and run nothing but the 3D view, where there is `data` of
    `pack_city`: str.
    """
    codes = [read_web("three.js"), "".join(map(read_web, SCRIPTS))] if data else []
    scripts = (
        [f'<script type="application/octet-stream" id="city-data">{data}</script>'] if data else []
    )
    allowed = f"script-src {' '.join(map(_hash_source, codes)) or NONE}; img-src data:"
    return fill_template(
        title, body, [*scripts, *(f"<script>{code}</script>" for code in codes)], allowed
    )


def fill_template(title, body, scripts, allowed):
    """A page with scripts as HTML, whose Content-Security-Policy says what is `allowed`: str."""
    style = read_web("page.css") + read_web("viewer.css")
    return Template(read_web("page.html")).substitute(
        policy=(
            f"default-src {NONE}; {allowed}; style-src {_hash_source(style)}; base-uri {NONE}; "
            f"form-action {NONE}"
        ),
        language=spoken()[0],
        title=escape(title),
        style=style,
        body=body,
        scripts="\n".join([words_as_data(), *scripts]),
    )


def read_web(name):
    """Text of a file in the folder web."""
    return (WEB / name).read_text(encoding="utf-8")


def _hash_source(text):
    """Source of a Content-Security-Policy that allows one inline script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode('utf-8')).digest()).decode('ascii')}'"


def compose_body(results, city, districts=""):
    """All sections of the page; the city in 3D goes before the numbers, which end with those of
    the districts.
    """
    # The report's page from top to bottom. Pictures only where a drawing library is installed.
    summary = results.summary
    pictures = paragraph(NO_PICTURES, "small")
    if importlib.util.find_spec("matplotlib") is not None:
        from .draw_results import draw_report

        pictures = "\n".join(_compose_pictures(results, draw_report(results)))
    # Warnings first, then results, then errors, then what was read and assumed.
    return "\n".join(
        [
            *(paragraph(text, "warning") for text in list_warnings(summary)),
            city,
            _compose_totals(summary),
            _compose_groups(results),
            districts,
            pictures,
            compose_errors(summary),
            section("What was read", table((), describe_input(summary))),
            section(
                "What was assumed",
                table((), describe_assumptions(summary)),
                _fold(
                    "Every setting of the run",
                    table(("Setting", "Option", "Value"), list_settings(summary)),
                ),
            ),
            paragraph(
                f"Made by CityPV {__version__} from the files in the folder {results.name}.",
                "small",
            ),
        ]
    )


def compose_errors(summary):
    """How far the numbers hold, for the report and the solar map."""
    return section(
        "How sure the numbers are",
        paragraph(summarise_errors(summary)),
        table(
            ("Part", "Percent of the full load hours"),
            list_errors(summary["error_budget"]),
            numbers=(1,),
        ),
        paragraph(f"± is a {SPREAD}. {LIMITS}", "small"),
    )


def compose_districts(rows):
    """Sums by district for the report and the solar map, of `read_districts_of`; "" without rows."""
    if not rows:
        return ""
    head, cells = tabulate_districts(rows)
    words = say(
        "A building counts where most of its area lies. Only buildings of this city model are summed "
        "up; a district may have more."
    )
    return section(
        say("Sums by district"),
        draw_map(rows),
        table(head, cells, numbers=range(1, len(head))),
        paragraph(words, "small"),
    )


def _compose_pictures(results, drawn):
    """Sections with the pictures that there are, with captions: yields str.

    Parameters
    ----------
    results : Results
    drawn : dict of str to str
        Of `draw_results.draw_report`.
    """
    for title, names in SECTIONS.items():
        parts = [picture(drawn[name], name, CAPTIONS[name]) for name in names if name in drawn]
        if title == "Plan of the city" and not parts:
            parts = [
                paragraph(NO_PLAN if results.outlines is None else "No surface carries modules.")
            ]
        if parts:
            yield section(title, *parts)


def list_warnings(summary):
    """What a reader must know before any number: list of str."""
    warnings = []
    label = summary["weather"]["label"]
    if "clear" in label.lower():
        warnings.append(
            f"The weather has no clouds ({label}): the hours are an upper bound, not an "
            "expectation."
        )
    if "climatology" in label:
        warnings.append(
            "The weather is a climatology, not a measurement: for a design use measured or "
            "satellite data."
        )
    if stopped := (summary.get("traced") or {}).get("interrupted"):
        warnings.append(
            "The run was interrupted: {suns_traced:,} of {of:,} sun positions were traced.".format(
                **stopped
            )
        )
    return warnings


def _compose_totals(summary):
    """What all suitable surfaces together would give, what windows take, and what carries no
    modules.
    """
    # Columns of the table; rows are all, then each kind.
    totals, some = summary["totals"], summary["settings"]["sectors"] == PAPER
    names = [
        "module_area",
        "kwp",
        "mwh_per_year",
        "full_load_hours",
        *["mwh_dc_per_year"] * has_losses(summary),
    ]
    parts = {
        "Facades and roofs of 15° to 60° within 30° of a main direction" if some else "All": totals,
    }
    for kind, total in totals["kinds"].items():
        parts[kind_title(kind) + (", beside these" if some and kind == "flat" else "")] = total
    rows = [
        [name, *("–" if part.get(key) is None else f"{part[key]:,.0f}" for key in names)]
        for name, part in parts.items()
    ]
    head = [
        "",
        "Area for modules [m²]",
        "Nominal power [kWp]",
        "Energy in a year [MWh]",
        "Full load hours [h]",
    ]
    head += ["Before losses, DC [MWh]"] if has_losses(summary) else []
    # What the sums mean and what they leave out stands below them.
    return section(
        "In short",
        paragraph(f"Weather: {summary['weather']['label']}."),
        table(head, rows, numbers=range(1, len(head))),
        paragraph(
            f"This is the potential of all suitable surfaces, with {totals['area_per_kwp']:.2f} m² "
            "of modules for each "
            f"kWp. {describe_windows(summary)} Building law, statics and cost are not considered."
        ),
        *(paragraph(text) for text in describe_left_out(summary)),
        paragraph(describe_strings(totals)),
        paragraph(HOURS + OF_WHAT[has_losses(summary)]),
        *(
            paragraph(text)
            for text in filter(None, [describe_edge(summary), describe_poor_years(summary)])
        ),
        paragraph(f"{summarise_errors(summary)} {LIMITS}"),
    )


def _compose_groups(results):
    """The groups with their hours and errors, year by year where there are several."""
    # A row for each group of a year; months and years are folded away.
    groups = results.groups[results.groups["period"] == "annual"]
    head = ["Surfaces", "facing", "Number", "Area [m²]", "Full load hours [h]", "± [h]"]
    rows = []
    for one in groups.to_dict("records"):
        error = one["full_load_hours_standard_error"]
        row = [
            kind_title(one["kind"]),
            one["orientation"],
            f"{one['count']:,.0f}",
            f"{one['area']:,.0f}",
        ]
        rows.append(
            [*row, f"{one['full_load_hours']:.1f}", "unknown" if isnan(error) else f"{error:.2g}"]
        )
    return section(
        "Full load hours by kind and direction",
        table(head, rows, numbers=range(2, len(head))),
        paragraph(
            f"± is the {SPREAD}. Further uncertainties are listed under "
            "“How sure the numbers are”.",
            "small",
        ),
        _fold_periods(
            results.groups,
            "month",
            "Full load hours of each month [h]",
            lambda month: MONTHS[month - 1],
        ),
        _fold_periods(results.groups, "year", "Full load hours of each year [h]", str),
    )


def _fold_periods(groups, period, title, name):
    """Table of the hours by month or year, folded; "" where there are none."""
    parts = []
    for kind, hours in tabulate_periods(groups, period).items():
        head = [kind_title(kind), *hours.columns]
        rows = [
            [name(index), *(f"{value:.1f}" for value in row)]
            for index, row in zip(hours.index, hours.to_numpy(), strict=True)
        ]
        parts.append(table(head, rows, numbers=range(1, len(head))))
    return _fold(title, "\n".join(parts)) if parts else ""


def table(head, rows, *, numbers=()):
    """A table of text.

    Parameters
    ----------
    head : sequence of str
        Headings of the columns; empty for a table of names and values.
    rows : iterable of sequence of str
    numbers : collection of int
        Columns that are set to the right.

    Returns
    -------
    str
    """
    side = [
        ' class="number"' if column in numbers else ""
        for column in range(1000 if not head else len(head))
    ]
    lines = ['<div class="wide"><table>']
    if head:
        cells = "".join(
            f"<th{look}>{escape(text)}</th>" if text else "<td></td>"  # an empty heading is none
            for text, look in zip(head, side, strict=True)
        )
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for row in rows:
        cells = "".join(
            f"<td{look}>{escape(str(text))}</td>" for text, look in zip(row, side, strict=False)
        )
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join([*lines, "</tbody></table></div>"])


def picture(uri, name, caption):
    """A picture with a caption."""
    return (
        f'<figure id="{escape(name)}"><img src="{uri}" alt="{escape(caption)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def paragraph(text, style=""):
    """A paragraph, of a class of the style sheet where one is named."""
    look = f' class="{style}"' if style else ""
    return f"<p{look}>{escape(text)}</p>"


def section(title, *parts):
    """A heading and what stands below it; parts that are empty are left out."""
    return "\n".join([f"<section><h2>{escape(title)}</h2>", *filter(None, parts), "</section>"])


def _fold(title, content):
    """Something that a reader unfolds; printed folded or not, as it stands."""
    return f"<details><summary>{escape(title)}</summary>\n{content}\n</details>"
