"""`citypv inspect`: what was read, what was repaired or skipped, and its place on Earth."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd

from ..accuracy.sun_sampling import name_groups
from ..city import building_facts
from ..patches.materials import MaterialSpec
from ..results.list_findings import list_findings
from ..run.study import make_scene, read_buildings
from ..settings.errors import list_some, show_number
from ..settings.progress import silent

AXES = {"xy": ", east first", "yx": ", north first"}
NOTES = {"eligible": " (before tracing, which leaves out walls that neighbours cover)"}


def inspect_city(paths, request, progress=silent):
    """Read a city and describe it.

    Parameters
    ----------
    paths : list of path-like
    request : Request
    progress : callable, optional
        See `core.settings.progress`.

    Returns
    -------
    dict
        Plain types only: what the reader reports, the place, of how many buildings the files tell
        a name and the like, counts and areas [m²] by kind, class, eligibility and material, trees,
        and findings with the ids that have them.

    Raises
    ------
    InputError
        If a file is invalid.
    """
    # The city as drawn, without cutting surfaces into patches.
    city = read_buildings(paths, request, progress)
    scene = make_scene(city, replace(request, patch_size=None))
    surfaces, crowns, trees = scene.surfaces, scene.trees, {"count": 0}
    if crowns is not None:
        trees = {
            "count": len(crowns),
            "evergreen": int(crowns.evergreen.sum()),
            "height": [
                round(float(of(crowns.height)), 2) for of in (np.min, np.mean, np.max)
            ],  # [m]
            "crown_volume": round(float(crowns.volume.sum()), 1),  # [m³]
        }
    names = np.array(surfaces.material or [""] * len(surfaces), dtype=object)
    # Area of each material, and how it would reflect.
    materials = _group_areas(names, surfaces.area, names != "")
    for name, group in materials.items():
        taken = MaterialSpec.of_name(name, scene.colours.get(name))
        group["taken_as"] = taken.describe() if taken else ""
    facts = building_facts.tell_facts(city) or building_facts.BuildingFacts()
    # Counts and areas by kind, class and eligibility, with trees and faults.
    return {
        "report": asdict(scene.report),
        "site": asdict(scene.site),
        "read_as": _describe_reading(city, scene),
        # of how many buildings the files tell it
        "told": {name: sum(map(bool, getattr(facts, name))) for name in building_facts.FACTS},
        "surfaces": len(surfaces),
        "holes": int((np.diff(city.polygon_start) - 1).sum()),
        "kinds": _group_areas(surfaces.kind, surfaces.area),
        "thematic": _group_areas(np.array(surfaces.thematic, dtype=object), surfaces.area),
        "eligible": _group_areas(name_groups(surfaces), surfaces.area, surfaces.eligible),
        "materials": materials,
        "trees": trees,
        "findings": [
            {
                "heading": finding.heading,
                "reason": finding.reason,
                "count": len(finding.names),
                "area": finding.area,
                "ids": finding.names,
            }
            for finding in list_findings(scene)
        ],
    }


def _describe_reading(city, scene):
    """What was chosen where files leave it open: order of axes, scale, unit, upward axis, levels of
    detail.

    The scale belongs to the files' own system, along east and north at the site; 1 where it is
    true, and without one.
    """
    site = scene.site
    scale = [
        round(float(value), 5) if np.isfinite(value) else None
        for value in site.grid.measure_scale(site.origin)
    ]
    levels = scene.report.lods_chosen
    return {
        "axes": site.axes,
        "scale": scale,
        "unit": city.report.unit,
        "up": city.report.up,
        "levels": levels,
    }


def _group_areas(names, area, chosen=None):
    """Count and area by name: {name: {"count": int, "area": m²}}."""
    chosen = np.ones(len(area), bool) if chosen is None else chosen
    table = pd.Series(area[chosen]).groupby(names[chosen].astype(str)).agg(["size", "sum"])
    return {
        name: {"count": int(count), "area": round(float(total), 3)}
        for name, count, total in table.itertuples()
    }


def describe_city(found):
    """The description of a city, as of `inspect_city`, as lines of text: list of str."""
    # First words for some lines: the place, levels of detail found and used, what the files tell.
    report, site = found["report"], found["site"]
    place = "unknown: given neither in the files nor by options"
    if site["latitude"] is not None and site["longitude"] is not None:
        degrees = (f"{name} {show_number(site[name], 5)}°" for name in ("latitude", "longitude"))
        place = f"{', '.join(degrees)}, altitude {show_number(site['altitude'], 1)} m"
    met, used = (
        ", ".join(f"{name or '(none)'}: {count:,}" for name, count in report[key].items()) or "none"
        for key in ("lods_met", "lods_chosen")
    )
    told = ", ".join(f"{name} of {count:,}" for name, count in found["told"].items() if count)
    # The lines: files, sizes, place; then counts and areas by kind, class and eligibility.
    lines = [
        *(f"file         {path}" for path in report["files"]),
        f"buildings    {report['building_count']:,}, parts {report['part_count']:,}",
        *([f"facts        {told}"] if told else []),
        f"surfaces     {found['surfaces']:,}, holes {found['holes']:,}",
        f"LoDs found   {met}",
        f"LoDs used    {used}",
        *(f"data         {text}" for text in report["attributions"]),
        f"CRS          {site['crs'] or 'none'}{AXES[site['axes']] if site['crs'] else ''}",
        f"place        {place}",
        f"grid north   at {show_number(site['convergence'], 4, plus=True)}° from true north",
    ]
    for title in ("kinds", "thematic", "eligible"):
        lines.append(f"{title}{NOTES.get(title, '')}:")
        lines += [
            f"  {name or '(none)':<22} {row['count']:>8,}  {row['area']:>14,.1f} m²"
            for name, row in found[title].items()
        ]
    # Trees, materials, and faults with the ids that have them.
    if found["trees"]["count"]:
        trees = found["trees"]
        low, mean, high = trees["height"]
        lines.append(
            f"trees        {trees['count']:,}, of these evergreen {trees['evergreen']:,}; heights "
            f"{low:.1f} to "
            f"{high:.1f} m, mean {mean:.1f} m; crowns {trees['crown_volume']:,.0f} m³"
        )
    if found["materials"]:
        lines.append("materials, and their properties with --materials:")
    lines += [
        f"  {name:<22} {row['count']:>8,}  {row['area']:>14,.1f} m²  "
        f"{row['taken_as'] or 'unknown: --albedo is used'}"
        for name, row in found["materials"].items()
    ]
    # Each finding with its number, reason, area and first ids; notes come last.
    for finding in found["findings"]:
        area = "" if finding["area"] is None else f", {finding['area']:,.1f} m²"
        ids = list_some(finding["ids"])
        lines.append(
            f"{finding['heading']} {finding['count']:,}: {finding['reason']}{area} ({ids})"
        )
    return [*lines, *report["notes"]]
