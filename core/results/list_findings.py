"""Findings on a city: repaired, skipped, covered surfaces and sheets, with areas."""

from dataclasses import dataclass

import numpy as np

from ..energy.counted_area import MOST_COVERED, REASONS
from ..light.measure_cover import measure_cover
from ..settings.progress import silent


@dataclass
class Finding:
    """Surfaces, or skipped objects, with the same reason."""

    heading: str  # repaired, skipped, inside or sheet
    reason: str
    names: list  # ids of surfaces, or of buildings and polygons that were skipped
    surfaces: np.ndarray  # (k,) int64 rows of the scene's surfaces; empty if skipped
    area: float | None  # [m²]; None for skipped objects without a shape


def list_findings(scene, covered_share=None, progress=silent):
    """Findings of a scene, in the order repaired, skipped, inside, sheet.

    Parameters
    ----------
    scene : Scene
    covered_share : (n,) float, optional
        Of each surface, if it was traced; by default a few rays are traced for it.
    progress : callable, optional
        See `core.settings.progress`; of these rays.

    Returns
    -------
    list of Finding
    """
    # What was repaired has rows among the surfaces; what was skipped has none.
    surfaces, report = scene.surfaces, scene.report
    rows = rows_of_names(surfaces.surface_id)
    findings = []
    for reason, names in report.repaired.items():
        chosen = np.unique(
            np.array([row for name in names for row in rows.get(name, ())], np.int64)
        )
        findings.append(
            Finding("repaired", reason, list(names), chosen, float(surfaces.area[chosen].sum()))
        )
    for reason, names in report.skipped.items():
        area = report.skipped_area.get(reason)
        findings.append(Finding("skipped", reason, list(names), np.zeros(0, np.int64), area))
    # What lies inside or under something and receives no light has the first reason that holds:
    # it closes a building towards its neighbour, is ground under a building, or is mostly covered.
    # Sheets without thickness stand under a heading of their own.
    every, owner = np.arange(len(surfaces)), scene.triangle_surface
    closure, footprint = (
        np.isin(every, owner[scene.closure]),
        np.isin(every, owner[scene.footprint]),
    )
    covered = (
        measure_cover(scene, progress=progress)
        if covered_share is None
        else np.asarray(covered_share)
    )
    headed = [("inside", REASONS["closure"], closure)]
    headed += [("inside", REASONS["ground"], footprint & ~closure)]
    covered = (covered > MOST_COVERED) & ~closure & ~footprint
    headed += [("inside", REASONS["covered"], covered)]
    if scene.sheet is not None:
        sheet = (
            "has no thickness and encloses nothing: its back receives and reflects too, its "
            "row is the front as drawn"
        )
        headed += [("sheet", sheet, np.isin(every, owner[scene.sheet]))]
    # Each finding with the names and area of its surfaces.
    for heading, reason, mask in headed:
        chosen = np.flatnonzero(mask)
        if len(chosen):
            names = [surfaces.surface_id[k] for k in chosen]
            findings.append(
                Finding(heading, reason, names, chosen, float(surfaces.area[chosen].sum()))
            )
    return findings


def rows_of_names(names):
    """Rows of each surface id; cells ``id#k`` stand under the id they were cut from, too."""
    rows = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
        parent, mark, cell = name.rpartition("#")
        if mark and cell.isdigit():
            rows.setdefault(parent, []).append(row)
    return rows
