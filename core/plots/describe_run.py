"""What a run read and what it assumed, as rows of a table."""

from pathlib import PurePath

from ..settings.request import declared_settings

MOUNTINGS = {
    "open-rack": "on open racks, air behind the modules",
    "insulated-back": "on an insulated wall or roof, no air behind the modules",
    "close-mount": "close to the roof, little air behind the modules",
}
SKIES = {"isotropic": "equally bright all over (isotropic)", "perez": "brighter around the sun (Perez)"}
WAYS = {
    "hourly": "every hour of the year",
    "days": "{} days spread over the year",
    "typical-days": "{} typical days",
    "sky-grid": "a grid of {} directions",
}
HEADINGS = {"repaired": "Repaired", "skipped": "Left out", "inside": "Covered", "sheet": "Lit on both sides"}
KINDS = {
    "facade": "Facades (upright within 1°)",
    "roof": "Pitched roofs (15° to 60°)",
    "flat": "Flat roofs (below 15°)",
    "steep": "Steeper than 60°, not upright",
    "downward": "Facing down",
    "ground": "Ground",
    "rack": "Racks on flat roofs",
}


def describe_input(summary):
    """What was read: list of (str, str).

    Parameters
    ----------
    summary : dict
        summary.json. One that `citypv yield` wrote has no import report; that is said.
    """
    read, site = summary["input"], summary["input"].get("site") or {}
    report = read.get("report")
    rows = []
    if report is None:
        rows.append(("City", "traced by an earlier run, whose folder has the import report"))
    else:
        rows.append(("Files", ", ".join(PurePath(path).name for path in report["files"])))
        rows.append(("Buildings", f"{report['building_count']:,}, with {report['part_count']:,} parts"))
        rows.append(("Level of detail", count_names(report["lods_chosen"])))
    if site.get("latitude") is not None:
        place = (
            f"latitude {site['latitude']:.4f}°, longitude {site['longitude']:.4f}°, altitude {site['altitude']:.0f} m"
        )
        rows.append(("Place", place))
    rows.append(("Coordinate reference system", site.get("crs") or "none named"))
    rows += [
        (KINDS.get(kind, kind), f"{one['count']:,}, {one['area']:,.0f} m²")
        for kind, one in sorted((read.get("kinds") or {}).items())
    ]
    for one in read.get("findings") or []:
        area = "" if one["area"] is None else f", {one['area']:,.0f} m²"
        rows.append((HEADINGS.get(one["heading"], one["heading"]), f"{one['count']:,} surfaces{area}: {one['reason']}"))
    return rows + [("Note", note) for note in (report or {}).get("notes", [])]


def count_names(counts):
    """Counts by name in words."""
    return ", ".join(f"{name or 'none named'} ({count:,} surfaces)" for name, count in counts.items()) or "none named"


def describe_assumptions(summary):
    """Weather, modules and light that the results rest on: list of (str, str).

    Parameters
    ----------
    summary : dict
        summary.json.
    """
    weather, settings = summary["weather"], summary["settings"]
    light = {**settings, **((summary.get("traced") or {}).get("request") or {})}
    years, away = weather.get("years") or 1, weather.get("distance_km") or 0
    rows = [
        ("Weather", f"{weather['label']}; {years:.3g} year{'s' if years > 1.01 else ''}"),
        ("Place of the weather", f"{away:,.0f} km away from the city" if away >= 1 else "at the city"),
        (
            "Irradiation in a year",
            f"{weather['ghi_annual']:,.0f} kWh/m² on level ground (GHI), "
            f"{weather['dhi_annual']:,.0f} of it diffuse (DHI); "
            f"{weather['dni_annual']:,.0f} kWh/m² of direct light on a plane that tracks the sun (DNI)",
        ),
        ("Module", " ".join(settings["module"].replace("_", " ").split())),
        ("Mounting", MOUNTINGS.get(settings.get("mounting"), settings.get("mounting") or MOUNTINGS["open-rack"])),
        ("Losses behind the modules", describe_losses(settings)),
        (
            "Method",
            "as in Bredemeier et al., CityPV"
            if settings.get("method") == "paper"
            else "CityPV's own, with the settings below",
        ),
        ("Sky", SKIES.get(summary.get("sky", light.get("sky")), str(light.get("sky")))),
        ("Sun positions", describe_suns(summary["suns"])),
        ("Reflections", f"{(summary.get('traced') or {}).get('max_bounces', light.get('max_bounces'))} in succession"),
        ("Albedo (share of light reflected)", describe_albedo(summary, light)),
        (
            "Walls that a neighbour covers",
            "left out" if settings.get("hidden_walls", "leave-out") == "leave-out" else "counted with zero light",
        ),
    ]
    usable = ", ".join(f"{kind} {100 * share:g} %" for kind, share in (settings.get("usable") or {}).items())
    rows.append(("Area that windows and edges leave", usable or "all (not reduced)"))
    return [*rows, ("Not considered", describe_missing(summary))]


def describe_missing(summary):
    """What no number includes, in words."""
    effects = (summary.get("traced") or {}).get("effects") or []
    trees = any(one["key"] == "trees" and one["on"] for one in effects)
    dirt = "" if summary["settings"].get("losses") else " and dirt"
    return f"{'light that leaves scatter' if trees else 'trees'}, street furniture, snow{dirt} on the modules"


def describe_losses(settings):
    """System losses and inverter in words."""
    losses, inverter = settings.get("losses") or 0, settings.get("inverter")
    if not losses and not inverter:
        return "none: hours and energy are those of direct current (DC)"
    return ", ".join([f"{losses:g} % of the energy", f"inverter {inverter}" if inverter else "no inverter"])


def describe_suns(suns):
    """Which suns were traced, in words."""
    name, _, number = str(suns.get("way", "")).partition(":")
    return f"{WAYS.get(name, name).format(number)}: {suns.get('count', 0):,} positions"


def describe_albedo(summary, light):
    """Albedos met, in words."""
    met = summary.get("albedo") or []
    names = [one.get("material") or one.get("name") or "" for one in met]
    if not any(names):
        return f"buildings {light.get('albedo'):g}, ground {light.get('ground_albedo'):g}"
    return ", ".join(f"{name or one.get('from', '')} {one['albedo']:g}" for name, one in zip(names, met, strict=True))


def list_settings(summary):
    """Every setting: what it is, how it is called, its value; those of the trace where they are known.

    Returns
    -------
    list of (str, str, str)
    """
    traced = (summary.get("traced") or {}).get("request") or {}
    rows = []
    for name, _, details in declared_settings():
        values = traced if details.group in ("city", "light") and traced else summary["settings"]
        if name in values and details.option != "":
            option = details.option or "--" + name.replace("_", "-")
            rows.append((details.words, option, show_value(values[name], details.unit)))
    return rows


def show_value(value, unit=""):
    """A setting as a reader writes it."""
    if value is None or value in ("", [], {}):
        return "–"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, dict):
        return ", ".join(f"{key}={show_value(item)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(map(str, value))
    text = PurePath(value).name if isinstance(value, str) and ("/" in value or "\\" in value) else str(value)
    return f"{text} {unit}".strip()
