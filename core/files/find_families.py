"""Find the buildings among the objects of a CityJSON file, and the building of each part and installation."""

import re
from dataclasses import dataclass, field

MEMBERS = {"BuildingPart", "BuildingInstallation", "BuildingConstructiveElement"}
INSIDE = {"BuildingRoom", "BuildingFurniture", "BuildingUnit", "BuildingStorey"}
PLANTS = {"SolitaryVegetationObject", "PlantCover"}
EXTENSION = re.compile(r"\+?\w*Building\w*", re.ASCII)  # such as +NoiseBuilding
EXTENSION_INSIDE = re.compile(r"Room|Furniture|Unit|Storey|Interior|Space")


@dataclass
class Families:
    """Objects of one JSON text that hold geometry of buildings, in input order."""

    buildings: list = field(default_factory=list)  # names
    parts: list = field(default_factory=list)  # names of parts
    owner: dict = field(default_factory=dict)  # name of a building, part, … -> name of its building
    part: dict = field(default_factory=dict)  # the same -> name of the part it is, or belongs to, or None
    orphans: list = field(default_factory=list)  # parts and the like without a parent building: treated as buildings
    skipped: list = field(default_factory=list)  # (reason, name)
    plants: list = field(default_factory=list)  # names of SolitaryVegetationObjects and PlantCovers
    reliefs: list = field(default_factory=list)  # names of TINReliefs
    others: dict = field(default_factory=dict)  # type -> number of objects not read
    extensions: dict = field(default_factory=dict)  # extension type -> number read as buildings


def find_families(objects):
    """Sort city objects into buildings, their parts and installations, and objects that are not read.

    Extension types whose name contains "Building" are read as a building if they have geometry or children, and as a
    part if one of their parents is a building. A part whose parent building is missing (parents not in the file, or
    cyclic) is read as a building of its own.

    Parameters
    ----------
    objects : dict
        Name -> object, as in ``CityObjects``.

    Returns
    -------
    Families
    """
    families, kinds = Families(), {name: classify_object(one) for name, one in objects.items()}
    above = {name: _parents(objects, kinds, name) for name, kind in kinds.items() if kind in ("member", "extension")}
    _add_children(objects, above)
    for name, kind in kinds.items():
        if kind == "no object":
            families.skipped.append(("city object is not a JSON object or has no type", name))
        elif kind == "relief":
            families.reliefs.append(name)
        elif kind == "plant":
            families.plants.append(name)
        elif kind in ("inside", "other"):
            families.others[objects[name]["type"]] = families.others.get(objects[name]["type"], 0) + 1
        else:
            _settle(name, kind, objects, above, families)
    return families


def classify_object(one):
    """building, member, extension, relief, plant, inside, other or no object."""
    kind = one.get("type") if isinstance(one, dict) else None
    if not isinstance(kind, str):
        return "no object"
    if kind in ("Building", "TINRelief"):
        return "building" if kind == "Building" else "relief"
    if kind in MEMBERS or kind in PLANTS:
        return "member" if kind in MEMBERS else "plant"
    if kind in INSIDE or not EXTENSION.fullmatch(kind):
        return "inside" if kind in INSIDE else "other"
    return "inside" if EXTENSION_INSIDE.search(kind) else "extension"


def _names(one, key):
    names = one.get(key)
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _parents(objects, kinds, name):
    """Parents that are buildings or belong to one; groups of objects do not count."""
    return [
        parent
        for parent in _names(objects[name], "parents")
        if kinds.get(parent) in ("building", "member", "extension")
    ]


def _add_children(objects, above):
    """Take the parent of a child that names none from the parents' lists of children."""
    orphans = {name for name, parents in above.items() if not parents}
    for name, one in objects.items():
        if orphans and classify_object(one) in ("building", "member", "extension"):
            for child in _names(one, "children"):
                if child in orphans and child != name:
                    above[child].append(name)


def _settle(name, kind, objects, above, families):
    one = objects[name]
    if kind == "extension" and not above[name] and not _names(one, "parents"):
        if not one.get("geometry") and not _names(one, "children"):
            families.others[one["type"]] = families.others.get(one["type"], 0) + 1
            return
        families.extensions[one["type"]] = families.extensions.get(one["type"], 0) + 1
        kind = "building"
    if kind == "building":
        families.buildings.append(name)
        families.owner[name], families.part[name] = name, None
        return
    if one["type"] == "BuildingPart":
        families.parts.append(name)
    top, families.part[name] = _climb(name, objects, above)
    if top == name:
        families.orphans.append(name)
        families.buildings.append(name)
    families.owner[name] = top


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
