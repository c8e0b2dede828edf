"""Short tables that stay on the city's object for the panel: what was read, kinds, full load hours of the groups."""

import numpy as np

from .attributes import KIND_CODES, PREFIX

REPORT, KINDS, GROUPS, WEATHER = (PREFIX + name for name in ("report", "kinds", "groups", "weather"))


def summarise_import(item, scene):
    """Keep what was read as lines on the object; return them in one sentence."""
    report, site = scene.report, scene.site
    lines = [f"{report.building_count} buildings, {len(scene.surfaces)} surfaces"]
    if report.lods_chosen:
        chosen = ", ".join(f"LoD {lod}: {count}" for lod, count in report.lods_chosen.items())
        lines.append(f"Level of detail: {chosen}")
    lines.append(f"Reference system: {site.crs or 'none named'}")
    lines.append(describe_place(site))
    for word, groups in (("repaired", report.repaired), ("skipped", report.skipped)):
        lines += [f"{len(names)} {word}: {reason}" for reason, names in groups.items()]
    item[REPORT] = lines + list(report.notes)
    return f"Read {lines[0]}"


def describe_place(site):
    """Where the city stands on Earth, in words."""
    if site.latitude is None or site.longitude is None:
        return "Place on Earth unknown: give latitude and longitude"
    north, east = "N" if site.latitude >= 0 else "S", "E" if site.longitude >= 0 else "W"
    return f"{abs(site.latitude):.4f}° {north}, {abs(site.longitude):.4f}° {east}"


def summarise_kinds(item, scene):
    """Keep count and area of each kind on the object; return a sentence."""
    surfaces = scene.surfaces
    rows = []
    for kind in KIND_CODES:
        of_kind = surfaces.kind == kind
        if of_kind.any():
            rows.append(f"{kind}|{of_kind.sum()}|{surfaces.area[of_kind].sum():,.0f}".replace(",", " "))
    eligible = surfaces.eligible
    rows.append(f"eligible|{eligible.sum()}|{surfaces.area[eligible].sum():,.0f}".replace(",", " "))
    item[KINDS] = rows
    return f"{len(surfaces)} surfaces, {eligible.sum()} of them eligible for photovoltaics"


def summarise_energy(item, weather, energy):
    """Keep the annual full load hours of each group on the object; return a sentence."""
    hours = energy.interval.total_seconds() / 3600
    annual = energy.capacity_factor.sum(axis=0) * hours / energy.years
    item[GROUPS] = [
        f"{kind} {orientation}|{count}|{value:,.0f}".replace(",", " ")
        for (kind, orientation), count, value in zip(energy.groups, energy.group_count, annual, strict=True)
    ]
    item[WEATHER] = weather.label
    mean = np.average(annual, weights=energy.group_area) if len(annual) else 0.0
    return f"Full load hours of the eligible area: {mean:.0f} h per year ({weather.label})"


def forget_energy(item):
    """Take the tables of an earlier energy off the object."""
    for key in (GROUPS, WEATHER):
        if key in item:
            del item[key]
