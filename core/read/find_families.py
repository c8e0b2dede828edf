"""Find the buildings among the objects of a CityJSON file, and the building of each part and installation."""

import re
from collections import Counter
from dataclasses import dataclass, field

KINDS = {"Building": "building", "TINRelief": "relief"}
KINDS |= dict.fromkeys(("BuildingPart", "BuildingInstallation", "BuildingConstructiveElement"), "member")
KINDS |= dict.fromkeys(("SolitaryVegetationObject", "PlantCover"), "plant")
FAMILY = ("building", "member", "extension")
EXTENSION = re.compile(r"\+?\w*Building\w*", re.ASCII)  # such as +NoiseBuilding
INSIDE = re.compile(r"Room|Furniture|Unit|Storey|Interior|Space")


@dataclass
class Families:
    """Objects of one JSON text that hold geometry of buildings, in input order."""

    buildings: list = field(default_factory=list)  # names
    parts: list = field(default_factory=list)  # names of parts
    owner: dict = field(default_factory=dict)  # name of a building, part, … -> name of its building
    part: dict = field(default_factory=dict)  # the same -> name of the part it is, or belongs to, or None
    orphans: list = field(default_factory=list)  # parts and the like without a parent building: treated as buildings
    broken: list = field(default_factory=list)  # names of what is no object
    plants: set = field(default_factory=set)  # names of SolitaryVegetationObjects and PlantCovers
    reliefs: set = field(default_factory=set)  # names of TINReliefs
    others: Counter = field(default_factory=Counter)  # type -> number of objects not read
    extensions: Counter = field(default_factory=Counter)  # extension type -> number read as buildings


def find_families(objects):
    """Sort city objects into buildings, their parts and installations, and objects that are not read.

    Extension types whose name contains "Building" are read as a building if they have geometry or children, and as a
    part if one of their parents is a building. A part whose parent building is missing (parents not in the file, or
    cyclic) is read as a building of its own. Groups of objects do not count as parents.

    Parameters
    ----------
    objects : dict
        Name -> object, as in ``CityObjects``.

    Returns
    -------
    Families
    """
    families, kinds = Families(), {name: classify_object(one) for name, one in objects.items()}
    above = {
        name: [parent for parent in _names(objects[name], "parents") if kinds.get(parent) in FAMILY]
        for name, kind in kinds.items()
        if kind in FAMILY[1:]
    }
    # A child that names no parent has it from the parents' lists of children.
    lost = {name for name, parents in above.items() if not parents}
    for name in (name for name, kind in kinds.items() if lost and kind in FAMILY):
        for child in _names(objects[name], "children"):
            if child in lost and child != name:
                above[child].append(name)
    for name, kind in kinds.items():
        if kind == "no object":
            families.broken.append(name)
        elif kind in ("relief", "plant"):
            (families.reliefs if kind == "relief" else families.plants).add(name)
        elif kind == "other":
            families.others[objects[name]["type"]] += 1
        else:
            _settle(name, kind, objects, above, families)
    return families


def classify_object(one):
    """building, member, extension, relief, plant, other or no object."""
    kind = one.get("type") if isinstance(one, dict) else None
    if not isinstance(kind, str):
        return "no object"
    if kind in KINDS or not EXTENSION.fullmatch(kind) or INSIDE.search(kind):
        return KINDS.get(kind, "other")
    return "extension"


def _names(one, key):
    names = one.get(key)
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _settle(name, kind, objects, above, families):
    """Add a building, or a member to its building."""
    one = objects[name]
    if kind == "extension" and not above[name] and not _names(one, "parents"):
        if not one.get("geometry") and not _names(one, "children"):
            families.others[one["type"]] += 1
            return
        families.extensions[one["type"]] += 1
        kind = "building"
    top, part = (name, None) if kind == "building" else _climb(name, objects, above)
    if one["type"] == "BuildingPart":
        families.parts.append(name)
    if top == name:
        families.buildings.append(name)
        families.orphans += [name] if kind != "building" else []
    families.owner[name], families.part[name] = top, part


def _climb(name, objects, above):
    """Topmost ancestor of a part or installation, and the first part on the way; itself if parents are cyclic."""
    start, met, part = name, set(), None
    while name not in met:
        met.add(name)
        if part is None and objects[name]["type"] == "BuildingPart":
            part = name
        if not above.get(name):
            return name, part
        name = above[name][0]
    return start, start if objects[start]["type"] == "BuildingPart" else None
