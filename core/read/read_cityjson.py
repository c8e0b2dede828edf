"""Read CityJSON 1.0 to 2.0 and CityJSONSeq: buildings with parts and installations, found among its
objects.

CityJSON: Ledoux et al. (2019), doi:10.1186/s40965-019-0064-0.
"""

import re
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..city.city import FileContent
from ..settings.errors import InputError, list_some
from ..settings.progress import silent
from .collect_polygons import INSTALLATIONS
from .collect_shapes import Owner, Shapes, Templates, collect_shapes
from .collect_trees import collect_json_tree, finish_trees
from .lifetimes import GONE, is_terminated, leave_out_demolished, note_demolitions
from .open_input import clean_name
from .parse_json import READ, iterate_json
from .read_attributes import take_attributes
from .read_relief import collect_json_relief
from .walk_boundaries import read_transform, read_vertices


def read_cityjson(path, report_share=silent):
    """Read all building polygons, trees and terrain of one CityJSON file, at all levels of detail;
    demolished buildings are left out.

    Parameters
    ----------
    path : path-like
        ``.json`` or ``.jsonl``, with either content; plain or gzip-compressed.
    report_share : callable, optional
        As in `open_input`, with the share of the work done.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        The file is missing, truncated, not CityJSON, without buildings, or none of them has usable
        geometry.
    """
    path = Path(path)
    content = FileContent(path, plants=FileContent(path))
    reading = _Reading(path, content)
    # One JSON text or, in CityJSONSeq, one a line: the header first, then features.
    for value, line in iterate_json(path, content.notes, report_share):
        kind = value.get("type") if isinstance(value, dict) else None
        # A name that is given twice would hide the first of the two, and is refused.
        twice = [
            name
            for name in (
                "type",
                "CityObjects",
                "vertices",
                "transform",
                "metadata",
                "geometry-templates",
            )
            if name in getattr(value, "names", ())
        ]
        if twice:
            raise InputError(path, f"line {line}: {twice[0]} is given twice", "keep one of the two")
        # A header or whole city, or a feature behind its header; anything else is refused by what
        # it is.
        if kind == "CityJSON":
            reading.start(value, line)
        elif kind in ("FeatureCollection", "Feature", "GeometryCollection"):
            raise InputError(path, "is GeoJSON, not CityJSON", "name it .geojson")
        elif kind != "CityJSONFeature":
            word = clean_name(str(kind))[:60]
            raise InputError(
                path, f"line {line}: JSON, but not CityJSON (type {word!r})", "give a CityJSON file"
            )
        elif reading.templates is None:
            raise InputError(
                path,
                f"line {line}: a CityJSONFeature before the header",
                "put the header object, of type CityJSON, on the first line",
            )
        # Buildings, trees and terrain of this text are added to the content.
        reading.add(value, line, report_share if kind == "CityJSON" else silent)
    # Notes are written, and a file without usable buildings or trees is refused; then demolished
    # buildings go, and each tree gets the polygons of its best level.
    reading.finish()
    leave_out_demolished(content)
    finish_trees(content)
    return content


@dataclass
class _Reading:
    """State of one file while it is read."""

    path: Path
    content: FileContent
    transform: tuple | None = None
    templates: Templates | None = None
    remarks: dict = field(default_factory=partial(defaultdict, list))  # remark -> names of objects
    others: Counter = field(default_factory=Counter)  # types that are no buildings
    extensions: Counter = field(default_factory=Counter)  # types read as buildings

    def start(self, header, line):
        """Read version, transform, templates and coordinate reference system of a CityJSON
        object.
        """
        self.transform = read_transform(self.path, line, header.get("transform"))
        self.templates = Templates(self.path, line, header.get("geometry-templates"))
        version = header.get("version")
        text = clean_name(str(version))[:20]
        if version is None:
            self.content.notes.append(f"{self.path} gives no CityJSON version.")
        elif not re.fullmatch(r"[12]\.\d+(\.\d+)?", text):
            raise InputError(
                self.path,
                f"line {line}: unsupported CityJSON version {text!r}",
                "give CityJSON 1.0 to 2.0; cjio's upgrade converts older files",
            )
        elif self.transform is None and not text.startswith("1.0"):
            self.content.notes.append(
                f"{self.path} has no transform; its vertices were read as real coordinates."
            )
        for name in _srs_names(header):
            self.content.srs_names.setdefault(name, line)
        if not isinstance(header.get("metadata", {}), dict):
            named = (
                "its coordinate reference system was read"
                if self.content.srs_names
                else "it was not used"
            )
            self.content.notes.append(f"{self.path} has metadata that is not an object; {named}.")

    def add(self, text, line, report_share=silent):
        """Add the buildings, trees and terrain of one JSON text to the content of the file."""
        # Refused where CityObjects is no JSON object. Then the vertices of this text, by its own
        # transform if it has one, else by the header's; a note tells of its own one, and of
        # vertices that are no integers though there is a transform.
        objects = text.get("CityObjects", {})
        if not isinstance(objects, dict):
            raise InputError(
                self.path, f"line {line}: CityObjects is not a JSON object", "export the file again"
            )
        transform = self.transform
        if text["type"] == "CityJSONFeature" and "transform" in text:
            transform = read_transform(self.path, line, text["transform"]) or transform
            self.content.notes.append(
                f"{self.path} has features with their own transform; it was applied."
            )
        vertices, whole = read_vertices(self.path, line, text.get("vertices"), transform)
        if transform is not None and not whole:
            self.content.notes.append(
                f"{self.path} has a transform, but vertices that are not integers; it was applied."
            )
        # A name that is used twice hides the earlier object, which is reported as left out.
        for name in getattr(objects, "names", ()):
            self.content.skip(
                "city object whose name is used again later in the file", clean_name(name)
            )
        # All objects of the text are added with these vertices.
        self._add_objects(
            objects,
            Shapes(self.content, vertices, self.templates, self.remarks),
            line,
            report_share,
        )

    def _add_objects(self, objects, shapes, line, report_share):
        # Polygons, trees and terrain of the objects of one JSON text go to the content of the file.
        # Which objects belong together: buildings, their parts and installations; what has ended
        # goes, with what belongs to it, and is reported.
        (kinds, families), content = _find_families(objects), self.content
        families, gone = _part_from_gone(objects, kinds, families)
        for name in gone:
            content.skip(GONE, clean_name(name))
        buildings = [name for name, (top, _) in families.items() if top == name]
        parts = [name for name in families if objects[name]["type"] == "BuildingPart"]
        # An object without a type is reported as left out. Objects other than buildings, trees and
        # terrain are counted by type; so are buildings of extensions, which are read. Parts and
        # installations without a parent are read as buildings, with a remark.
        for name, kind in kinds.items():
            if kind == "no object":
                content.skip("city object is not a JSON object or has no type", clean_name(name))
            elif kind in ("other", "extended building"):
                (self.others if kind == "other" else self.extensions)[objects[name]["type"]] += 1
        for name in buildings:
            if kinds[name] in ("member", "extension"):
                words = "parts or installations have no parent building; they are read as buildings"
                shapes.remarks[words].append(clean_name(name))
        # Numbers of buildings and parts, counted on from the file so far.
        building = {name: len(content.buildings) + k for k, name in enumerate(buildings)}
        part = {name: content.part_count + k + 1 for k, name in enumerate(parts)} | {None: 0}
        content.buildings += [clean_name(name) for name in buildings]
        content.part_count += len(parts)
        own = {
            name: (building[families[name][0]], 0 if name in building else part[name])
            for name in (*buildings, *parts)
        }
        # Dates of demolition and attributes are kept by the numbers of building and part, 0 for a
        # building itself.
        note_demolitions(
            {place: _attributes(objects[name]) for name, place in own.items()}, content
        )
        told = {place: take_attributes(objects[name]) for name, place in own.items()}
        content.attributes |= {place: one for place, one in told.items() if one}
        # Then shapes of each object: of buildings, trees, terrain.
        for number, (name, city_object) in enumerate(objects.items()):
            if number % 64 == 0:
                # At 0.8 of the time the last object of one text is read.
                report_share(READ + (0.8 - READ) * number / len(objects))
            if name in families:
                # An installation belongs to its building, and to a part where it hangs on one.
                top, own = families[name]
                kind = city_object["type"] if city_object["type"] in INSTALLATIONS else ""
                place = building[top], part[own]
                collect_shapes(
                    city_object, Owner(clean_name(name), *place, kind, line, bool(kind)), shapes
                )
            elif kinds[name] == "plant" and name not in gone:
                collect_json_tree(city_object, name, shapes, line)
            elif kinds[name] == "relief":
                collect_json_relief(city_object, name, shapes.vertices, content)
            if isinstance(city_object, dict):
                city_object.pop("geometry", None)  # frees memory

    def finish(self, *, most_named=5, most_types=30):
        """Write the notes, and raise an error if the file has no usable buildings."""
        content = self.content
        content.notes = list(dict.fromkeys(content.notes))  # each note once
        for kind, count in sorted(self.extensions.items())[:most_types]:
            content.notes.append(f"{count} {clean_name(kind)} (extension type) read as buildings.")
        for kind, count in sorted(self.others.items())[:most_types]:
            content.notes.append(f"{count} {clean_name(kind)} left out: not a building.")
        for words, names in self.remarks.items():
            named = list_some(list(dict.fromkeys(names)), most_named)
            content.notes.append(f"{len(names)} {words}: {named}")
        if not content.buildings and not content.trees:
            skipped = {reason: len(names) for reason, names in content.skipped.items()}
            met = {**self.others, "terrain triangles": content.relief.count(), **skipped}
            words = [f"{count} {clean_name(kind)}" for kind, count in met.items() if count]
            more = f" (but {', '.join(words[:most_named])})" if words else ""
            raise InputError(
                self.path, f"contains no buildings{more}", "give a file with buildings"
            )
        if not content.polygons and content.skipped:
            reason, names = max(content.skipped.items(), key=lambda item: len(item[1]))
            raise InputError(
                self.path,
                f"no building has usable geometry ({reason}: {len(names)}, for example "
                f"{names[0]!r})",
                "correct or export the file again",
            )


def _srs_names(header):
    """Spellings of the coordinate reference system: as in 1.0 and later, and as in earlier drafts.

    Metadata is an object; some producers wrap it into a list.
    """
    metadata = header.get("metadata")
    for members in (*(metadata if isinstance(metadata, list) else [metadata]), header):
        if isinstance(members, dict):
            crs = members.get("crs")
            for value in (
                members.get("referenceSystem"),
                crs.get("epsg") if isinstance(crs, dict) else crs,
            ):
                if isinstance(value, str) and value.strip():
                    yield clean_name(value)
                elif type(value) is int and 0 < value < 10**6:
                    yield f"EPSG:{value}"


KINDS = {"Building": "building", "TINRelief": "relief"}
KINDS |= dict.fromkeys(
    ("BuildingPart", "BuildingInstallation", "BuildingConstructiveElement"), "member"
)
KINDS |= dict.fromkeys(("SolitaryVegetationObject", "PlantCover"), "plant")
FAMILY = ("building", "member", "extension")
INSIDE = re.compile(r"Room|Furniture|Unit|Storey|Interior|Space")


def _find_families(objects):
    """Sort city objects into buildings, their parts and installations, and objects that are not
    read.

    Extension types whose name contains "Building" are read as a building if they have geometry or
    children, and as a part if one of their parents is a building. A part whose parent building is
    missing (parents not in the file, or cyclic) is read as a building of its own. Groups of objects
    do not count as parents.

    Parameters
    ----------
    objects : dict
        Name -> object, as in ``CityObjects``.

    Returns
    -------
    kinds : dict
        Name -> building, extended building (of an extension type), member, extension, relief,
        plant, other, no object.
    families : dict
        Name of each building, part and installation -> name of its building, and of the part that
        it is or belongs to, or None.
    """
    kinds, families = (
        {name: _classify_object(city_object) for name, city_object in objects.items()},
        {},
    )
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
    for name in [name for name, kind in kinds.items() if kind in FAMILY]:
        city_object = objects[name]
        if kinds[name] == "extension" and not above[name] and not _names(city_object, "parents"):
            alone = city_object.get("geometry") or _names(city_object, "children")
            kinds[name] = "extended building" if alone else "other"
        if kinds[name] in ("building", "extended building"):
            families[name] = name, None
        elif kinds[name] != "other":
            families[name] = _climb(name, objects, above)
    return kinds, families


def _classify_object(city_object):
    """building, member, extension, relief, plant, other or no object."""
    kind = city_object.get("type") if isinstance(city_object, dict) else None
    if not isinstance(kind, str):
        return "no object"
    # An extension is called such as +NoiseBuilding.
    if (
        kind in KINDS
        or not re.fullmatch(r"\+?\w*Building\w*", kind, re.ASCII)
        or INSIDE.search(kind)
    ):
        return KINDS.get(kind, "other")
    return "extension"


def _attributes(city_object):
    attributes = city_object.get("attributes") if isinstance(city_object, dict) else None
    return attributes if isinstance(attributes, dict) else {}


def _part_from_gone(objects, kinds, families):
    """Families without what no longer stands, and the names of buildings, parts and plants that do
    not: dict, list.
    """
    relevant = (name for name, kind in kinds.items() if name in families or kind == "plant")
    gone = [name for name in relevant if is_terminated(_attributes(objects[name]))]
    # What belongs to a building or part that is gone is gone with it.
    ended = set(gone)
    return {name: both for name, both in families.items() if ended.isdisjoint((name, *both))}, gone


def _names(city_object, key):
    names = city_object.get(key)
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _climb(name, objects, above):
    """Topmost ancestor of a part or installation, and the first part on the way; itself if parents
    are cyclic.
    """
    start, met, part = name, set(), None
    while name not in met:
        met.add(name)
        if part is None and objects[name]["type"] == "BuildingPart":
            part = name
        if not above.get(name):
            return name, part
        name = above[name][0]
    return start, start if objects[start]["type"] == "BuildingPart" else None
