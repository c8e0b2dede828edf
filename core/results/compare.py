"""`citypv compare`: who gains and who loses between two states of a city, as tables, sums and a
page with maps.
"""

import importlib.util

from ..settings.errors import list_some, show_number
from . import page
from .columns import write_table
from .compare_runs import EXISTING, compare_folders, describe_light
from .output_folder import whole_folder
from .words import number, say, say_count, say_weather, speaking
from .write_report import compose_city
from .write_summary import write_summary

CAPTIONS = {
    "roof": "Roofs from above: change of the full load hours. Blue loses, brown gains; grey: "
    "below two standard errors, or without modules; outlined in black: new. North is up.",
    "facade": "Facades as lines: change of the full load hours, in the colours above.",
}
STATES = {
    "existing": "Existing buildings that stay as they are",
    "changed": "Buildings that change themselves",
    "new": "New buildings",
    "gone": "Buildings that are gone",
    "all": "All",
}
HEAD = (
    "Before [MWh]",
    "After [MWh]",
    "Change [MWh]",
    "± [MWh]",
    "on roofs [MWh]",
    "on facades [MWh]",
)


def compare(before, after, folder, *, language="en", overwrite=False):
    """Compare two result folders, and write surfaces.csv, buildings.csv, summary.json and
    report.html.

    Parameters
    ----------
    before, after : path-like
        Result folders of `citypv simulate` or `citypv yield`.
    folder : path-like
        Written completely or not at all.
    language : str
        Of the page, one of `words.list_languages`.
    overwrite : bool
        Replace results in a folder that is not empty.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        A folder holds no results, or not only the city differs.
    """
    with whole_folder(folder, overwrite) as work:
        comparison = compare_folders(before, after)
        for name in ("surfaces", "buildings"):
            write_table(work / f"{name}.csv", getattr(comparison, name))
        with speaking(language):
            page_text = _compose_page(comparison)
        (work / "report.html").write_text(page_text, encoding="utf-8", newline="\n")
        write_summary(work / "summary.json", comparison.summary)
    return comparison


def describe_comparison(comparison):
    """A Comparison as lines of text: list of str. Both names and the weather come first."""
    lines = [
        f"{comparison.summary['before']} → {comparison.summary['after']}, "
        f"{comparison.summary['weather']}"
    ]
    # Change of energy and energy before, for all, and for buildings that stay, change, are new or
    # are gone, if there are any.
    for state, words in STATES.items():
        sums = comparison.summary["sums"][state]
        if sums["buildings"]:
            change = show_number(sums["mwh_change"], 1, plus=True)
            change += f" ± {sums['mwh_change_standard_error']:.1f} MWh a year"
            lines.append(f"  {words}: {change} ({sums['mwh_before']:,.1f} before)")
    # Of the buildings that stay, the three that lose most and the three that gain most, beyond two
    # standard errors.
    buildings = comparison.buildings
    # what is written as 0.00 is not named
    least = (2 * buildings["mwh_change_standard_error"]).clip(lower=0.005)
    sure = buildings["mwh_change"].abs() >= least
    neighbours = buildings[sure & (buildings["state"] == "existing")].sort_values("mwh_change")
    losing, gaining = (
        neighbours[neighbours["mwh_change"] < 0],
        neighbours[neighbours["mwh_change"] > 0],
    )
    for words, rows in (("Lose most", losing[:3]), ("Gain most", gaining[:-4:-1])):
        if len(rows):
            changes = [show_number(change, 2, plus=True) for change in rows["mwh_change"]]
            each = zip(rows["building_id"], changes, strict=True)
            lines.append(f"  {words}: {', '.join(f'{name} {change} MWh' for name, change in each)}")
    # Then surfaces that an edit brings across the least hours, and how the light differs.
    return [*lines, *_note_paying(comparison), *_note_light(comparison)]


def _note_paying(comparison):
    """Name what an edit brings below or above the least hours: list of str."""
    paying, notes = comparison.summary.get("paying"), []
    # Of what an edit brings below or above the least hours.
    sentences = {
        "no_longer": "Would no longer pay, below {least_hours:g} h, and counts with the modules of "
        "before ({mwh_before:,.1f} MWh a year): {told}",
        "newly": "Would pay now, from {least_hours:g} h, and does not count: {told}",
    }
    for name, words in sentences.items() if paying else ():
        if names := paying[name]["surfaces"]:
            told = say_count(len(names), "{count:,} surface", "{count:,} surfaces")
            told = f"{told}: {list_some(names, 5)}"
            notes.append(say(words, told=told, **{**paying, **paying[name]}))
    return notes


def _note_light(comparison):
    """Warn where layouts or settings of light differ, or light before was solved again: list of
    str.
    """
    notes, names = [], ", ".join(comparison.summary["light_differs_in"])
    # Each note is written only where it applies; settings of light that differ are named.
    if "layout" in comparison.summary:
        notes.append(
            say(
                "Modules lie in rows in one of the two only: both are compared with modules on "
                "every square metre that counts."
            )
        )
    if "base_light" in comparison.summary:
        light = describe_light(comparison.summary["base_light"])
        notes.append(
            say(
                "Before is {before} with the light that {later} asks for: {light}.",
                before=comparison.summary["before"],
                later=comparison.later.name,
                light=light,
            )
        )
    if names:
        notes.append(
            say(
                "The light was traced with other settings: {names}; part of the change is theirs.",
                names=names,
            )
        )
    return notes


def _compose_page(comparison):
    """The page in HTML: sums, the later state in 3D, maps, and the buildings whose change is
    beyond two standard errors.
    """
    # Sums of what was built, stays and went; then the buildings that changed for certain, from loss
    # to gain.
    summary, buildings = comparison.summary, comparison.buildings
    sums = [
        (say(words), number(one["buildings"]), *_numbers_of(one))
        for state, words in STATES.items()
        if (one := summary["sums"][state])["buildings"]
    ]
    sure = buildings[buildings["mwh_change"].abs() > 2 * buildings["mwh_change_standard_error"]]
    # The page's table has at most 200 rows, with the largest changes.
    listed = sure.reindex(sure["mwh_change"].abs().sort_values(ascending=False).index[:200])
    listed = listed.sort_values("mwh_change")
    # "–" of what was not there.
    percent = [_signed(value, 1) for value in listed["percent_change"]]
    listed = zip(listed.to_dict("records"), percent, strict=True)
    rows = [
        (one["building_id"], say(one["state"]), *_numbers_of(one), share) for one, share in listed
    ]
    # Maps of gain and loss, where a drawing library is installed.
    maps = []
    if importlib.util.find_spec("matplotlib") is not None:
        from .draw_plan import draw_change
        from .picture import embed_figure, plain_style

        with plain_style():
            for show, caption in CAPTIONS.items():
                maps.append(
                    page.picture(
                        embed_figure(
                            draw_change(comparison.surfaces, comparison.later.outlines, show), "png"
                        ),
                        show,
                        say(caption),
                    )
                )
    # The later state in 3D, and one sentence on what happens to neighbours.
    (view, tables), data = compose_city(comparison.later, comparison.surfaces)
    kept = summary["sums"][EXISTING]
    lead = say(
        "What stays as it is gains {change:,.1f} ± {error:,.1f} MWh a year, of {before:,.1f} MWh "
        "before."
        if kept["mwh_change"] > 0
        else "What stays as it is loses {change:,.1f} ± {error:,.1f} MWh a year, of {before:,.1f} "
        "MWh before.",
        change=abs(kept["mwh_change"]),
        error=kept["mwh_change_standard_error"],
        before=kept["mwh_before"],
    )
    weather = say("Weather: {label}.", label=say_weather(summary["weather"]))
    head = [say(title) for title in HEAD]
    # Sections: sums with notes and warnings, the city in 3D, maps, the table of buildings.
    body = [
        page.section(
            say("In short"),
            page.paragraph(f"{weather} {lead}"),
            *(page.paragraph(note) for note in _note_paying(comparison)),
            *(page.paragraph(note, "warning") for note in _note_light(comparison)),
            page.table(("", say("Buildings"), *head), sums, numbers=range(1, 8)),
            page.paragraph(
                say(
                    "± is the standard error of the change: from the rays that both states share "
                    "where one is a variant of the other, else as if both were independent, which "
                    "is more. What sees nothing new differs by 0."
                ),
                "small",
            ),
        ),
        view,
        tables,
        page.section(say("Where"), *maps) if maps else "",
        page.section(
            say("Who loses, who gains"),
            page.paragraph(
                say(
                    "{count:,} of {all:,} buildings change by more than two standard errors.",
                    count=len(sure),
                    all=len(buildings),
                )
            ),
            page.table((say("Building"), "", *head, "%"), rows, numbers=range(2, 9)),
            page.paragraph(say("All are in buildings.csv, all surfaces in surfaces.csv."), "small"),
        ),
    ]
    return page.fill_page(
        say("Comparison: {before} and {after}", before=summary["before"], after=summary["after"]),
        "\n".join(filter(None, body)),
        data,
    )


def _numbers_of(sums):
    """Sums as text, in the order of HEAD."""
    names = ("before", "after", "change", "change_standard_error", "change_roofs", "change_facades")
    signed = ("change", "change_roofs", "change_facades")
    return [
        _signed(sums[f"mwh_{name}"], 2) if name in signed else number(sums[f"mwh_{name}"], ",.2f")
        for name in names
    ]


def _signed(value, digits):
    """A change with its sign, none where it is written as zero; "–" of NaN."""
    plus = "+" if round(value, digits) > 0 else ""
    return number(value, f"{plus},.{digits}f")
