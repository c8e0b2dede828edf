"""What a run read, what it assumed, what it left out and how sure it is, in words and as rows of a
table.
"""

import math
from pathlib import PurePath

from ..city.choose_levels import SHAPELESS
from ..city.city import ESTIMATED
from ..energy.counted_area import LEFT_OUT
from ..settings.errors import count_of, show_number
from ..settings.request import declared_settings, option_of
from .read_results import WORDS, kind_title

WAYS = {
    "hourly": "every hour of the year",
    "days": "{} days spread over the year",
    "typical-days": "{} typical days",
    "sky-grid": "a grid of {} directions",
}
LIGHT = (
    "{ghi_annual:,.0f} kWh/m² on level ground (GHI), {dhi_annual:,.0f} of it diffuse (DHI); "
    "{dni_annual:,.0f} kWh/m² "
    "of direct light on a plane that tracks the sun (DNI)"
)
HEADINGS = {
    "repaired": "Repaired",
    "skipped": "Left out",
    "inside": "Covered",
    "sheet": "Lit on both sides",
}
SPREAD = (
    "standard error: the true value lies within it in 68 % of cases, within twice as much in 95 %"
)
OF_CLIMATE = (  # benchmarks/results/climate.md, stations that do not contradict themselves
    "The error of the weather is much larger: with the built-in climate unshaded walls are off by "
    "7 % (north) to "
    "17 % (east) at 12 stations (root mean square), and 5 to 11 % too high on average."
)
OF_RECORDS = (
    "The error of the weather is larger: a single year differs from the mean of many by 1 to 8 %, "
    "and records of "
    "the light are off by some percent."
)
LIMITS = "Errors of the city model and the module model come on top, and are usually larger."


def describe_input(summary):
    """What was read: list of (str, str).

    Parameters
    ----------
    summary : dict
        summary.json. One that `citypv yield` wrote has no import report; that is said.
    """
    # Files and what they held, if this run read them.
    read, site = summary["input"], summary["input"].get("site") or {}
    report = read.get("report")
    rows = []
    if report is None:
        rows.append(("City", "traced by an earlier run, whose folder has the import report"))
    else:
        rows.append(("Files", ", ".join(PurePath(path).name for path in report["files"])))
        rows.append(
            (
                "Buildings",
                f"{report['building_count']:,}, with {count_of(report['part_count'], 'part')}",
            )
        )
        lods = [
            f"{name or 'none named'} ({count_of(count, 'surface')})"
            for name, count in report["lods_chosen"].items()
        ]
        rows.append(("Level of detail", ", ".join(lods) or "none named"))
        rows += [("Data", text) for text in attributions_of(summary)]
    # Where the city lies, and its surfaces by kind.
    if site.get("latitude") is not None:
        place = f"latitude {site['latitude']:.4f}°, longitude {site['longitude']:.4f}°"
        rows.append(("Place", f"{place}, altitude {site['altitude']:.0f} m"))
    rows.append(("Coordinate reference system", site.get("crs") or "none named"))
    rows += [
        ("".join(WORDS[kind][1:]), f"{one['count']:,}, {one['area']:,.0f} m²")
        for kind, one in sorted((read.get("kinds") or {}).items())
    ]
    # Findings on its geometry, and notes.
    for one in read.get("findings") or []:
        area = "" if one["area"] is None else f", {one['area']:,.0f} m²"
        words_of_count = (
            f"{one['count']:,}"
            if one["heading"] == "skipped"
            else count_of(one["count"], "surface")
        )
        rows.append(
            (
                HEADINGS.get(one["heading"], one["heading"]),
                f"{words_of_count}{area}: {one['reason']}",
            )
        )
    return rows + [("Note", note) for note in (report or {}).get("notes", [])]


def describe_assumptions(summary):
    """Weather, modules and light that the results rest on: list of (str, str).

    Parameters
    ----------
    summary : dict
        summary.json.
    """
    # Each row is a heading and the words or numbers that stand for a setting.
    weather, settings, traced = summary["weather"], summary["settings"], summary.get("traced") or {}
    light = settings | (traced.get("request") or {})
    years, away = weather.get("years") or 1, weather.get("distance_km") or 0
    inverter = settings["inverter"]
    words = {name: details.choices for name, _, details in declared_settings()}
    # What comes behind the modules: losses, and an inverter if there is one.
    behind = f"{settings['losses']:g} % of the DC energy, " + (
        f"inverter {inverter}" if inverter else "no inverter"
    )
    way, _, number = summary["suns"]["way"].partition(":")
    rows = [
        ("Weather", f"{weather['label']}; {years:.3g} year{'s' if years > 1.01 else ''}"),
        (
            "Place of the weather",
            f"{away:,.0f} km away from the city" if away >= 1 else "at the city",
        ),
        ("Irradiation in a year", LIGHT.format(**weather)),
        ("Module", " ".join(settings["module"].replace("_", " ").split())),
        ("Mounting", words["mounting"][settings["mounting"]]),
        ("Strings", words["strings"][settings.get("strings", "module")]),
        (
            "Losses and inverter",
            behind
            if has_losses(summary)
            else "not counted: hours and energy are those of direct current (DC)",
        ),
        (
            "Method",
            ("CityPV's own, with the settings below", "as in Bredemeier et al., CityPV")[
                settings["method"] == "paper"
            ],
        ),
        ("Sky", words["sky"][summary["sky"]]),
        ("Sun positions", f"{WAYS[way].format(number)}: {summary['suns']['count']:,} positions"),
        ("Reflections", f"{traced.get('max_bounces', light['max_bounces'])} in succession"),
        ("Albedo (share of light reflected)", _describe_albedo(summary, light)),
        ("Azimuths that count", words["sectors"][settings["sectors"]]),
        ("Walls that a neighbour covers", words["hidden_walls"][settings["hidden_walls"]]),
    ]
    # What is not considered depends on what was switched on.
    usable = ", ".join(f"{kind} {100 * share:g} %" for kind, share in settings["usable"].items())
    rows.append(("Modules", words["layout"][settings.get("layout", "area")]))
    rows.append(("Share left to them by what the city does not show", usable or "all"))
    if least := settings.get("least_hours"):
        rows.append(("Least hours of a face with modules", f"{least:g} h a year"))
    trees = any(one["key"] == "trees" and one["on"] for one in traced.get("effects") or [])
    plants, dirt = (
        "light that leaves scatter" if trees else "trees",
        "" if has_losses(summary) else " and dirt",
    )
    return [*rows, ("Not considered", f"{plants}, street furniture, snow{dirt} on the modules")]


def has_losses(summary):
    """Whether hours and energy are AC after losses, or DC."""
    return bool(summary["settings"]["losses"] or summary["settings"]["inverter"])


def describe_windows(summary):
    """How modules are laid out, what every square metre would give instead, and what windows of
    another height would change: a sentence or two.
    """
    whole, settings = summary["totals"], summary["settings"]
    every, usable = whole.get("every_square_metre"), settings["usable"].get("facade")
    left = "" if usable is None else f" Of the facades {100 * usable:g} % is left to modules."
    if every is None or whole.get("layout") != "rows":
        return f"Modules cover every square metre that counts, windows included.{left}"
    words = (
        f"{whole['module_count']:,.0f} modules lie in rows; on every square metre they would have "
        f"{every['kwp']:,.0f} kWp and give {every['mwh_per_year']:,.0f} MWh a year."
    )
    if varied := summary["error_budget"].get("windows"):
        bands = ", ".join(
            f"{show_number(variant['percent'], 1, plus=True)} % with {variant['window_band']:g} m"
            for variant in varied
        )
        words += f" Windows that are not drawn are assumed; energy changes by {bands} of a storey."
    return words + left


def describe_strings(totals):
    """What strings of modules lose in shade, counted or not: a sentence.

    `totals` come from summary.json, of an older version too.
    """
    lost = totals.get("string_shade")
    if lost is None or lost["percent"] is None:
        return "What strings of modules would lose in shade is unknown."
    kinds = [
        f"{kind_title(kind).lower()} {percent(share)}"
        for kind, share in lost["kinds"].items()
        if share is not None
    ]
    each = f" ({', '.join(kinds)})" if len(kinds) > 1 else ""
    share = f"{percent(lost['percent'])}{each}, {lost['mwh_per_year']:,.0f} MWh a year"
    if lost["counted"]:
        return f"Modules hang on strings: shade on some of a string's takes {share}; it is counted."
    return (
        "Each module has an optimiser or inverter of its own; on strings, shade on some of a "
        f"string's modules would take a further {share} (--strings string)."
    )


def describe_left_out(summary):
    """What carries no modules, where it is more than 1 % of walls and roofs; and buildings without
    a shape: list.
    """
    totals, report, lines = summary["totals"], summary["input"].get("report") or {}, []
    parts = {key: total for key, total in totals["without_modules"].items() if key != "ground"}
    whole = totals["eligible_area"] + sum(part["area"] for part in parts.values())
    # Parts below 1 % of the walls and roofs are not worth naming.
    told = [
        f"{part['area']:,.0f} m² ({percent(100 * part['area'] / whole)}) {LEFT_OUT[key]}"
        for key, part in parts.items()
        if part["area"] > 0.01 * whole
    ]
    if told:
        lines.append(f"Walls and roofs without modules: {'; '.join(told)}.")
    # Courts and shafts that count although they get no light.
    if (dark := totals["dark"])["count"]:
        number = count_of(dark["count"], "surface")
        lines.append(
            f"Area that counts but gets next to no light all year: {dark['area']:,.0f} m² "
            f"({number})."
        )
    # Level of detail, and buildings that the files name but do not draw.
    lines += describe_detail(report)
    missing = sum(
        len(ids) for why, ids in (report.get("skipped") or {}).items() if why.startswith(SHAPELESS)
    )
    if missing:
        lines.append(
            "Buildings without a shape in the files, which cast no shadow and have no results: "
            f"{missing:,} of {report['building_count']:,}."
        )
    return lines


def attributions_of(summary):
    """Whom to name with what is made of the files of a run: list of str.

    Parameters
    ----------
    summary : dict
        summary.json.
    """
    return ((summary.get("input") or {}).get("report") or {}).get("attributions") or []


def describe_detail(report):
    """What blocks without roofs, and heights that nobody measured, mean for the sums: list of str.

    Parameters
    ----------
    report : dict
        Of an ImportReport; empty where none is known.
    """
    chosen, lines = report.get("lods_chosen") or {}, []
    blocks = sum(count for lod, count in chosen.items() if lod.split(".")[0] == "1")
    if blocks:
        share = "" if blocks == sum(chosen.values()) else f" of {blocks:,} surfaces"
        lines.append(f"LoD1: roofs are flat{share}.")
    sources = report.get("height_sources") or {}
    guessed = {words: sources[name] for name, words in ESTIMATED.items() if sources.get(name)}
    if guessed:
        told = ", ".join(f"{count:,} {words}" for words, count in guessed.items())
        lines.append(
            f"Heights that are estimated, not measured: {told}, of {sum(sources.values()):,} buildings "
            "(height_source in buildings.csv)."
        )
    return lines


def describe_edge(summary):
    """How much of the facades looks over the edge of the city, and what that meant: a sentence, ""
    without an edge.
    """
    edge = summary.get("edge")
    if not edge:
        return ""
    shares = (
        f"{percent(edge['share_within_25'])} within 25 m and {percent(edge['share_within_100'])} "
        "within 100 m"
    )
    more = [edge[f"more_hours_within_{length}"] for length in ("25", "100")]
    words = f"Of the facades' area {shares} look over the edge of the built area"
    if None in more:
        return f"{words} (edge_distance); nothing is known of what stands beyond."
    gains = " and ".join(f"{show_number(value, 1, plus=True)} %" for value in more)
    return (
        f"{words} (edge_distance); their hours are {gains} against facades of the same direction "
        "further in. "
        "Nothing is known of what stands beyond."
    )


def _describe_albedo(summary, light):
    """Albedos met, in words."""
    met = summary.get("albedo") or []
    names = [one.get("material") or one.get("name") or "" for one in met]
    if not any(names):
        return f"buildings {light.get('albedo'):g}, ground {light.get('ground_albedo'):g}"
    return ", ".join(
        f"{name or one.get('from', '')} {one['albedo']:g}"
        for name, one in zip(names, met, strict=True)
    )


def list_settings(summary):
    """Every setting: what it is, how it is called, its value; settings of the trace where they are
    known.

    Returns
    -------
    list of (str, str, str)
    """
    traced = (summary.get("traced") or {}).get("request") or {}
    rows = []
    for name, _, details in declared_settings():
        values = traced if details.group in ("city", "light") and traced else summary["settings"]
        if name in values and details.option != "":
            rows.append((details.words, option_of(name), _show_value(values[name], details.unit)))
    return rows


def _show_value(value, unit=""):
    """A setting as a reader writes it."""
    if value is None or value in ("", [], {}):
        return "–"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, dict):
        return ", ".join(f"{key}={_show_value(item)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(map(str, value))
    text = (
        PurePath(value).name
        if isinstance(value, str) and ("/" in value or "\\" in value)
        else str(value)
    )
    return f"{text} {unit}".strip()


def list_errors(budget):
    """Each part of the error budget: what it is, and how much.

    Parameters
    ----------
    budget : dict
        `error_budget` of summary.json.

    Returns
    -------
    list of (str, str)
        Parts that are unknown say so.
    """
    # Parts in the order of what a reader asks first: the mean, a single surface, the suns, what was
    # cut.
    suns = budget.get("sun_sampling") or {}
    shift = (
        "unknown" if suns.get("bias") is None else f"{show_number(suns['bias'], 2, plus=True)} %"
    )
    return [
        (
            "Mean over all surfaces: standard error of sampling",
            percent(budget.get("sampling_total"), "± "),
        ),
        (
            "Single surface: standard error, typical (median by area)",
            percent(budget.get("sampling_median"), "± "),
        ),
        (
            "Single surface: standard error, exceeded on 5 % of the area only",
            percent(budget.get("sampling_95"), "± "),
        ),
        *(
            (
                f"Energy with windows of {one['window_band']:g} m in each storey",
                f"{show_number(one['percent'], 1, plus=True)} %",
            )
            for one in budget.get("windows") or ()
        ),
        ("Choice of sun positions: shift of the mean, against many more suns", shift),
        (
            "Choice of sun positions: effect on a single surface (rms)",
            percent(suns.get("rms"), "± "),
        ),
        ("Reflections beyond the last one computed would add at most", _describe_cut(budget)),
        (
            "Strings in shade lose more than single modules by",
            percent(budget.get("string_shade")),
        ),
        (
            "Size of the patches that reflect light, in percent of the reflected light",
            percent(budget.get("patches")),
        ),
    ]


def _describe_cut(budget):
    """What cut reflections would add at most, to all surfaces and to the group that they add most
    to.
    """
    groups = {
        name: parts["cut_reflections"]["percent"]
        for name, parts in (budget.get("groups") or {}).items()
    }
    known = {name: most for name, most in groups.items() if most is not None}
    words = percent(budget.get("bounces"))
    if not known or budget.get("bounces") is None:
        return words
    name = max(known, key=known.get)
    return f"{words}; most of all to {name}: {percent(known[name])}"


def percent(value, sign=""):
    """Two digits that count: 0.017 %, 2.4 %; "unknown" of None."""
    if value is None:
        return "unknown"
    if not value > 0:
        return f"{sign}0 %"
    decimals = max(0, 1 - math.floor(math.log10(value)))
    return f"{sign}{value:.{min(decimals, 4)}f} %"


def summarise_errors(summary):
    """The error budget in one sentence, and how far off the weather may be, beside which it is
    small.

    The error of the mean is √(chance² + shift of the suns²). That of a single surface holds what
    the suns do.
    """
    budget, weather = (
        summary["error_budget"],
        OF_CLIMATE if "climatology" in summary["weather"]["label"] else OF_RECORDS,
    )
    shift, typical = (budget.get("sun_sampling") or {}).get("bias"), budget.get("sampling_median")
    if None in (shift, typical, budget.get("sampling_total")):
        return (
            "This run does not tell all errors of ray tracing and of the choice of sun positions. "
            f"{weather}"
        )
    bounces = budget.get("bounces")
    rest = (
        f"; reflections that were left out would add at most {percent(bounces)}" if bounces else ""
    )
    return (
        "As far as ray tracing and the choice of sun positions go, the mean over all surfaces is "
        "known to "
        f"± {percent(math.hypot(budget['sampling_total'], shift))} and the hours of a single "
        "surface typically to "
        f"± {percent(typical)} (one standard error){rest}. {weather}"
    )


def describe_poor_years(summary):
    """Energy that is exceeded in half and nine of ten of several years of weather; "" for a single
    one.
    """
    totals, years = summary["totals"], int(summary["weather"].get("years") or 1)
    if "p90_mwh_per_year" not in totals:
        return ""
    few = "; of fewer than nine years that is the lowest" if years < 9 else ""
    return (
        f"Of the {years} years of the weather, half exceed {totals['p50_mwh_per_year']:,.0f} MWh "
        "(P50) and nine of ten "
        f"{totals['p90_mwh_per_year']:,.0f} MWh (P90{few})."
    )
