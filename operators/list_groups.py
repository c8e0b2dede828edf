"""The groups of a city's report: kinds, orientations, classes of the file, and what reading came upon."""

from dataclasses import dataclass, field

import numpy as np

from .attributes import KIND_CODES, ORIENTATION_CODES


@dataclass
class Group:
    """Surfaces, or what was left out, under a name."""

    heading: str  # kind, orientation, eligible, class, material, repaired, skipped, inside or sheet
    name: str
    surfaces: np.ndarray  # (k,) int64 rows of the scene's surfaces; empty for what was left out
    count: int
    area: float | None  # [m²]; None where what was left out has no shape
    ids: list = field(default_factory=list)  # of what was found; empty where the surfaces say it all


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
