"""Groups of a city's report: kinds, orientations, classes of the file, and findings of reading."""

from dataclasses import dataclass, field

import numpy as np

from .attributes import KIND_CODES, ORIENTATION_CODES


@dataclass
class Group:
    """A named group of surfaces, or of elements that were left out."""

    heading: str  # kind, orientation, eligible, class, material, repaired, skipped, inside or sheet
    name: str
    surfaces: np.ndarray  # (k,) int64 rows of the scene's surfaces; empty for what was left out
    count: int
    area: float | None  # [m²]; None for elements left out that have no geometry
    ids: list = field(default_factory=list)  # ids of findings; empty if the surfaces are sufficient


def list_groups(scene, findings):
    """Groups of a scene, in the order of the panel.

    Parameters
    ----------
    scene : core.scene.scene.Scene
    findings : list of core.list_findings.Finding

    Returns
    -------
    list of Group
    """
    surfaces = scene.surfaces
    pairs = np.char.add(np.char.add(surfaces.kind.astype(str), " "), surfaces.orientation.astype(str))
    classes = np.array([name or "without class" for name in surfaces.thematic], dtype=str)
    materials = np.array(surfaces.material or [""] * len(surfaces), dtype=str)
    eligible = np.where(surfaces.eligible, pairs, "")
    groups = [
        *_sort("kind", surfaces.kind, KIND_CODES, surfaces.area),
        *_sort("orientation", surfaces.orientation, ORIENTATION_CODES, surfaces.area),
        _gather("eligible", "all", surfaces.eligible, surfaces.area),
        *_sort("eligible", eligible, sorted(set(eligible.tolist()) - {""}), surfaces.area),
        *_sort("class", classes, sorted(set(classes.tolist())), surfaces.area),
        *_sort("material", materials, sorted(set(materials.tolist()) - {""}), surfaces.area),
    ]
    return groups + [Group(f.heading, f.reason, f.surfaces, len(f.names), f.area, f.names) for f in findings]


def _sort(heading, words, names, area):
    return [_gather(heading, name, words == name, area) for name in names if (words == name).any()]


def _gather(heading, name, chosen, area):
    rows = np.flatnonzero(chosen)
    return Group(heading, name, rows, len(rows), float(area[rows].sum()))
