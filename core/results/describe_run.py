"""What a run read, what it assumed and what it left out, in words and as rows of a table."""

from pathlib import PurePath

from ..city.choose_levels import SHAPELESS
from ..energy.counted_area import LEFT_OUT
from ..settings.request import declared_settings, option_of
from .describe_errors import percent, plain_number
from .read_results import WORDS, kind_title
from .words import number, say, say_count

# words for sources of heights that are no measurement, of `City.height_source`
ESTIMATED = {
    "floors": "by the number of floors",
    "outline": "by the outline around a part",
    "default": "by --default-height",
}


def describe_input(summary):
    """What was read: list of (str, str).

    Parameters
    ----------
    summary : dict
        summary.json. One that `citypv yield` wrote has no import report; that is said.
    """
    # Files, counts of buildings and parts, and levels of detail, if this run read them; else only
    # that an earlier run did.
    read, site = summary["input"], summary["input"].get("site") or {}
    report = read.get("report")
    rows = []
    if report is None:
        earlier = say("traced by an earlier run, whose folder has the import report")
        rows.append((say("City"), earlier))
    else:
        rows.append((say("Files"), ", ".join(PurePath(path).name for path in report["files"])))
        buildings = say_count(
            report["part_count"],
            "{buildings:,}, with {count:,} part",
            "{buildings:,}, with {count:,} parts",
            buildings=report["building_count"],
        )
        rows.append((say("Buildings"), buildings))
        lods = [
            f"{name or say('none named')} ({_count_surfaces(count)})"
            for name, count in report["lods_chosen"].items()
        ]
        rows.append((say("Level of detail"), ", ".join(lods) or say("none named")))
    # Where the city lies, and its surfaces by kind.
    if site.get("latitude") is not None:
        place = say(
            "latitude {latitude:.4f}°, longitude {longitude:.4f}°, altitude {altitude:.0f} m",
            **{name: site[name] for name in ("latitude", "longitude", "altitude")},
        )
        rows.append((say("Place"), place))
    rows.append((say("Coordinate reference system"), site.get("crs") or say("none named")))
    rows += [
        (
            say(WORDS[kind][1]) + (say(WORDS[kind][2]) if WORDS[kind][2] else ""),
            f"{number(one['count'])}, {number(one['area'])} m²",
        )
        for kind, one in sorted((read.get("kinds") or {}).items())
    ]
    return rows


def describe_findings(summary):
    """Findings on the geometry that was read, and notes, whose words are English: list of
    (str, str); parameters as of `describe_input`.
    """
    read, rows = summary["input"], []
    for one in read.get("findings") or []:
        area = "" if one["area"] is None else f", {number(one['area'])} m²"
        headings = {
            "repaired": "Repaired",
            "skipped": "Left out",
            "inside": "Covered",
            "sheet": "Lit on both sides",
        }
        heading = headings.get(one["heading"])
        rows.append(
            (
                say(heading) if heading else one["heading"],
                f"{number(one['count'])}{area}: {one['reason']}",
            )
        )
    notes = (read.get("report") or {}).get("notes", [])
    return rows + [(say("Note"), note) for note in notes]


def _count_surfaces(count):
    return say_count(count, "{count:,} surface", "{count:,} surfaces")


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
    share = plain_number(settings["losses"])
    behind = say("not counted: hours and energy are those of direct current (DC)")
    if has_losses(summary) and inverter:
        behind = say("{share} % of the DC energy, inverter {name}", share=share, name=inverter)
    elif has_losses(summary):
        behind = say("{share} % of the DC energy, no inverter", share=share)
    way, _, count = summary["suns"]["way"].partition(":")
    ways = {
        "hourly": "every hour of the year",
        "days": "{number} days spread over the year",
        "typical-days": "{number} typical days",
        "sky-grid": "a grid of {number} directions",
    }
    suns = say(
        "{way}: {count:,} positions",
        way=say(ways[way], number=count),
        count=summary["suns"]["count"],
    )
    years = say_count(round(years, 2), "{count:.3g} year", "{count:.3g} years")
    irradiation = (
        "{ghi:,.0f} kWh/m² on level ground (GHI), {dhi:,.0f} of it diffuse (DHI); {dni:,.0f} "
        "kWh/m² of direct light on a plane that tracks the sun (DNI)"
    )
    # Rows on weather, modules and losses, method, sky and suns, reflections and albedo, and on what
    # counts.
    rows = [
        (say("Weather"), f"{say(weather['label'])}; {years}"),
        (
            say("Place of the weather"),
            say("{away:,.0f} km away from the city", away=away)
            if away >= 1
            else say("at the city"),
        ),
        (
            say("Irradiation in a year"),
            say(irradiation, **{name: weather[f"{name}_annual"] for name in ("ghi", "dhi", "dni")}),
        ),
        (say("Module"), " ".join(settings["module"].replace("_", " ").split())),
        (say("Mounting"), say(words["mounting"][settings["mounting"]])),
        (say("Strings"), say(words["strings"][settings.get("strings", "module")])),
        (say("Losses and inverter"), behind),
        (
            say("Method"),
            say("as in Bredemeier et al., CityPV")
            if settings["method"] == "paper"
            else say("CityPV's own, with the settings below"),
        ),
        (say("Sky"), say(words["sky"][summary["sky"]])),
        (say("Sun positions"), suns),
        (
            say("Reflections"),
            say("{count} in succession", count=traced.get("max_bounces", light["max_bounces"])),
        ),
        (say("Albedo (share of light reflected)"), _describe_albedo(summary, light)),
        (say("Azimuths that count"), say(words["sectors"][settings["sectors"]])),
        (
            say("Walls that a neighbour covers"),
            say(words["hidden_walls"][settings["hidden_walls"]]),
        ),
    ]
    # Rows on modules: their layout, the share left to them, the least hours if any are asked for.
    usable = ", ".join(
        f"{say(kind_title(kind))} {plain_number(100 * share)} %"
        for kind, share in settings["usable"].items()
    )
    rows.append((say("Modules"), say(words["layout"][settings.get("layout", "area")])))
    rows.append((say("Share left to them by what the city does not show"), usable or say("all")))
    if least := settings.get("least_hours"):
        rows.append(
            (
                say("Least hours of a face with modules"),
                say("{least} h a year", least=plain_number(least)),
            )
        )
    # What is not considered depends on what was switched on.
    trees = any(one["key"] == "trees" and one["on"] for one in traced.get("effects") or [])
    left = [say("light that leaves scatter") if trees else say("trees"), say("street furniture")]
    left.append(
        say("snow on the modules") if has_losses(summary) else say("snow and dirt on the modules")
    )
    return [*rows, (say("Not considered"), ", ".join(left))]


def has_losses(summary):
    """Whether hours and energy are AC after losses, or DC."""
    return bool(summary["settings"]["losses"] or summary["settings"]["inverter"])


def describe_windows(summary):
    """How modules are laid out, what every square metre would give instead, and what windows of
    another height would change: a sentence or two.
    """
    whole, settings = summary["totals"], summary["settings"]
    every, usable = whole.get("every_square_metre"), settings["usable"].get("facade")
    sentences = []
    # Without rows a sentence says that modules cover all, as nothing varies with windows. With rows
    # it is their number and what every square metre would give, and how energy changes with each
    # other height of windows, if some were tried. The share of facades follows, if it is set.
    if every is None or whole.get("layout") != "rows":
        sentences.append(say("Modules cover every square metre that counts, windows included."))
    else:
        sentences.append(
            say(
                "{count:,.0f} modules lie in rows; on every square metre they would have "
                "{kwp:,.0f} kWp and give {energy:,.0f} MWh a year.",
                count=whole["module_count"],
                kwp=every["kwp"],
                energy=every["mwh_per_year"],
            )
        )
        if varied := summary["error_budget"].get("windows"):
            bands = [
                say(
                    "{share:+,.1f} % with {band} m",
                    share=one["percent"],
                    band=plain_number(one["window_band"]),
                )
                for one in varied
            ]
            sentences.append(
                say(
                    "Windows that are not drawn are assumed; energy changes by {bands} of a "
                    "storey.",
                    bands=say(" and ").join(bands),
                )
            )
    if usable is not None:
        sentences.append(
            say("Of the facades {share} % is left to modules.", share=plain_number(100 * usable))
        )
    return " ".join(sentences)


def describe_strings(totals):
    """What strings of modules lose in shade, counted or not: a sentence.

    `totals` come from summary.json, of an older version too.
    """
    lost = totals.get("string_shade")
    if lost is None or lost["percent"] is None:
        return say("What strings of modules would lose in shade is unknown.")
    kinds = [
        f"{say(kind_title(kind))} {percent(share)}"
        for kind, share in lost["kinds"].items()
        if share is not None
    ]
    each = f" ({', '.join(kinds)})" if len(kinds) > 1 else ""
    told = {"share": f"{percent(lost['percent'])}{each}", "energy": lost["mwh_per_year"]}
    if lost["counted"]:
        return say(
            "Modules hang on strings: shade on some of a string's takes {share}, {energy:,.0f} "
            "MWh a "
            "year; it is counted.",
            **told,
        )
    return say(
        "Each module has an optimiser or inverter of its own; on strings, shade on some of a "
        "string's modules would take a further {share}, {energy:,.0f} MWh a year (--strings "
        "string).",
        **told,
    )


def describe_left_out(summary):
    """What carries no modules, where it is more than 1 % of walls and roofs; and buildings without
    a shape: list.
    """
    totals, report, lines = summary["totals"], summary["input"].get("report") or {}, []
    parts = {key: total for key, total in totals["without_modules"].items() if key != "ground"}
    whole = totals["eligible_area"] + sum(part["area"] for part in parts.values())
    # Parts below 1 % of the walls and roofs are not worth naming; ground is left aside.
    told = [
        say(
            "{area:,.0f} m² ({share}) {reason}",
            area=part["area"],
            share=percent(100 * part["area"] / whole),
            reason=say(LEFT_OUT[key]),
        )
        for key, part in parts.items()
        if part["area"] > 0.01 * whole
    ]
    if told:
        lines.append(say("Walls and roofs without modules: {parts}.", parts="; ".join(told)))
    # Courts and shafts that count although they get no light.
    if (dark := totals["dark"])["count"]:
        lines.append(
            say(
                "Area that counts but gets next to no light all year: {area:,.0f} m² ({count}).",
                area=dark["area"],
                count=_count_surfaces(dark["count"]),
            )
        )
    # What blocks without roofs and heights that nobody measured mean for the sums, then buildings
    # that the files name but do not draw.
    lines += describe_detail(report)
    missing = sum(
        len(ids) for why, ids in (report.get("skipped") or {}).items() if why.startswith(SHAPELESS)
    )
    if missing:
        lines.append(
            say(
                "Buildings without a shape in the files, which cast no shadow and have no results: "
                "{missing:,} of {count:,}.",
                missing=missing,
                count=report["building_count"],
            )
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
        every = blocks == sum(chosen.values())
        some = say("LoD1: roofs are flat of {count:,} surfaces.", count=blocks)
        lines.append(say("LoD1: roofs are flat.") if every else some)
    sources = report.get("height_sources") or {}
    guessed = {words: sources[name] for name, words in ESTIMATED.items() if sources.get(name)}
    if guessed:
        told = ", ".join(f"{number(count)} {say(words)}" for words, count in guessed.items())
        lines.append(
            say(
                "Heights that are estimated, not measured: {told}, of {count:,} buildings "
                "(height_source in buildings.csv).",
                told=told,
                count=sum(sources.values()),
            )
        )
    return lines


def describe_edge(summary):
    """How much of the facades looks over the edge of the city, and what that meant: a sentence, ""
    without an edge.
    """
    edge = summary.get("edge")
    if not edge:
        return ""
    told = {
        "near": percent(edge["share_within_25"]),
        "far": percent(edge["share_within_100"]),
    }
    more = [edge[f"more_hours_within_{length}"] for length in ("25", "100")]
    if None in more:
        return say(
            "Of the facades' area {near} within 25 m and {far} within 100 m look over the edge of "
            "the "
            "built area (edge_distance); nothing is known of what stands beyond.",
            **told,
        )
    return say(
        "Of the facades' area {near} within 25 m and {far} within 100 m look over the edge of the "
        "built area (edge_distance); their hours are {nearer:+,.1f} % and {farther:+,.1f} % "
        "against "
        "facades of the same direction further in. Nothing is known of what stands beyond.",
        nearer=more[0],
        farther=more[1],
        **told,
    )


def _describe_albedo(summary, light):
    """Albedos met, in words."""
    met = summary.get("albedo") or []
    names = [one.get("material") or one.get("name") or "" for one in met]
    if not any(names):
        return say(
            "buildings {albedo}, ground {ground}",
            albedo=plain_number(light.get("albedo")),
            ground=plain_number(light.get("ground_albedo")),
        )
    return ", ".join(
        f"{name or one.get('from', '')} {plain_number(one['albedo'])}"
        for name, one in zip(names, met, strict=True)
    )


def list_settings(summary):
    """Every setting: what it is in English, how it is called, its value; settings of the trace
    where they are known.

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


def describe_poor_years(summary):
    """Energy that is exceeded in half and nine of ten of several years of weather; "" for a single
    one.
    """
    totals, years = summary["totals"], int(summary["weather"].get("years") or 1)
    if "p90_mwh_per_year" not in totals:
        return ""
    energy = {name: totals[f"{name}_mwh_per_year"] for name in ("p50", "p90")}
    words = say(
        "Of the {years} years of the weather, half exceed {p50:,.0f} MWh (P50) and nine of ten "
        "{p90:,.0f} MWh (P90).",
        years=years,
        **energy,
    )
    few = say("Of fewer than nine years the P90 is the lowest.")
    return f"{words} {few}" if years < 9 else words
