"""Read CityJSON 1.0 to 2.0 and CityJSONSeq: buildings with parts and installations.

CityJSON: Ledoux et al. (2019), doi:10.1186/s40965-019-0064-0.
"""

import re
from pathlib import Path

import numpy as np

from ..city.polygon import FileContent
from ..settings.errors import InputError
from ..settings.progress import ignore_share
from .collect_json_trees import collect_json_tree
from .collect_relief import collect_json_relief
from .collect_shapes import Owner, Shapes, collect_shapes
from .collect_trees import finish_trees
from .find_families import find_families
from .limits import clean_name
from .parse_json import READ, iterate_json
from .place_templates import Templates
from .read_vertices import read_transform, read_vertices

VERSION = re.compile(r"[12]\.\d+(\.\d+)?")
OLD = re.compile(r"0\.\d")
MOST_NAMED = 5  # in a note
SHORT = 60  # characters of a name in a note
MOST_TYPES = 30  # types listed in notes
DRAWN = 0.8  # share of the time when the last object of one text is read
OBJECTS_AT_ONCE = 64  # objects per progress report
TWICE = "duplicate building in the file"
ORPHANS = "parts or installations have no parent building; they are read as buildings"
AGAIN = "city object whose name is used again later in the file"


def read_cityjson(path, report_share=ignore_share):
    """Read all building polygons of one CityJSON file, at all levels of detail.

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
        The file is missing, truncated, not CityJSON, without buildings, or none of them has usable geometry.
    """
    path = Path(path)
    content = FileContent(path, plants=FileContent(path))
    reading = _Reading(path, content)
    for value, line in iterate_json(path, content.notes, report_share):
        kind = value.get("type") if isinstance(value, dict) else None
        if kind == "CityJSON":
            reading.start(value, line)
        elif kind != "CityJSONFeature":
            word = clean_name(str(kind))[:60]
            raise InputError(path, f"line {line}: JSON, but not CityJSON (type {word!r})", "give a CityJSON file")
        elif reading.templates is None:
            cure = "put the header object, of type CityJSON, on the first line"
            raise InputError(path, f"line {line}: a CityJSONFeature before the header", cure)
        reading.add(value, line, report_share if kind == "CityJSON" else ignore_share)
    reading.finish()
    finish_trees(content)
    return content


class _Reading:
    """State of one file while it is read."""

    def __init__(self, path, content):
        self.path, self.content = path, content
        self.transform, self.templates, self.remarks = None, None, {}
        self.others, self.extensions = {}, {}
        self.seen = {}  # name of a building -> hashes of its geometries so far

    def start(self, header, line):
        """Read transform, templates and coordinate reference system of a CityJSON object."""
        _refuse_repeated(self.path, header, line)
        self.transform = read_transform(self.path, line, header.get("transform"))
        self.templates = Templates(self.path, line, header.get("geometry-templates"))
        self._check_version(header.get("version"), line)
        for name in _srs_names(header):
            self.content.srs_names.setdefault(name, line)
        if not isinstance(header.get("metadata", {}), dict):
            named = "its coordinate reference system was read" if self.content.srs_names else "it was not used"
            self._note(f"{self.path} has metadata that is not an object; {named}.")

    def _check_version(self, version, line):
        if version is None:
            self._note(f"{self.path} gives no CityJSON version.")
            return
        text = clean_name(str(version))[:20]
        if not VERSION.fullmatch(text):
            old = "convert it to 2.0, for example with cjio's upgrade"
            cure = old if OLD.match(text) else "give CityJSON 1.0 to 2.0"
            raise InputError(self.path, f"line {line}: unsupported CityJSON version {text!r}", cure)
        if self.transform is None and not text.startswith("1.0"):
            self._note(f"{self.path} has no transform; its vertices were read as real coordinates.")

    def add(self, text, line, report_share=ignore_share):
        """Read the buildings among the objects of one JSON text."""
        _refuse_repeated(self.path, text, line)
        objects = text.get("CityObjects", {})
        if not isinstance(objects, dict):
            raise InputError(self.path, f"line {line}: CityObjects is not a JSON object", "export the file again")
        transform = self.transform
        if text["type"] == "CityJSONFeature" and "transform" in text:
            transform = read_transform(self.path, line, text["transform"]) or transform
            self._note(f"{self.path} has features with their own transform; it was applied.")
        vertices, whole = read_vertices(self.path, line, text.get("vertices"), transform)
        if transform is not None and not whole:
            self._note(f"{self.path} has a transform, but vertices that are not integers; it was applied.")
        for name in getattr(objects, "names", ()):
            self.content.skip(AGAIN, clean_name(name))
        self._add_objects(objects, Shapes(self.content, vertices, self.templates, self.remarks), line, report_share)

    def _add_objects(self, objects, shapes, line, report_share):
        families, content = find_families(objects), self.content
        for reason, name in families.skipped:
            content.skip(reason, clean_name(name))
        for name in families.orphans:
            shapes.remark(ORPHANS, clean_name(name))
        for own, found in ((self.others, families.others), (self.extensions, families.extensions)):
            for kind, count in found.items():
                own[kind] = own.get(kind, 0) + count
        first, first_building, first_part = len(content.polygons), len(content.buildings), content.part_count
        content.buildings += [clean_name(name) for name in families.buildings]
        building = {name: first_building + k for k, name in enumerate(families.buildings)}
        part = {name: first_part + k + 1 for k, name in enumerate(families.parts)} | {None: 0}
        content.part_count += len(families.parts)
        reliefs, plants = set(families.reliefs), set(families.plants)
        for number, (name, one) in enumerate(objects.items()):
            if number % OBJECTS_AT_ONCE == 0:
                report_share(READ + (DRAWN - READ) * number / len(objects))
            if name in families.owner:
                kind = one["type"] if one["type"] in ("BuildingInstallation", "BuildingConstructiveElement") else ""
                place = building[families.owner[name]], part[families.part[name]]
                collect_shapes(one, Owner(clean_name(name), *place, kind, line), shapes)
                one.pop("geometry", None)  # frees memory
            elif name in plants:
                collect_json_tree(one, name, shapes, line)
                one.pop("geometry", None)
            elif name in reliefs:
                collect_json_relief(one, name, shapes.vertices, content)
                one.pop("geometry", None)
        self._drop_duplicates(first, first_building, line)

    def _drop_duplicates(self, first, first_building, line):
        """Drop exact duplicates of earlier buildings; number other buildings of the same name."""
        content, drawn = self.content, {}
        for polygon in content.polygons[first:]:
            drawn.setdefault(polygon.building, []).append(polygon)
        gone = set()
        for building in range(first_building, len(content.buildings)):
            name = content.buildings[building]
            shape = _shape_of(drawn.get(building, ()))
            earlier = self.seen.setdefault(name, set())
            if shape in earlier:
                gone.add(building)
                content.skip(TWICE, name)
            elif earlier:
                words = f"{self.path}, line {line}: another building has the name of an earlier one, number added"
                content.buildings[building] = self._number(name, len(earlier) + 1)
                self._note(f"{words}: {content.buildings[building]}")
            earlier.add(shape)
        if gone:
            self._drop(gone, first, first_building)

    def _number(self, name, count):
        while f"{name}~{count}" in self.seen:
            count += 1
        self.seen[f"{name}~{count}"] = set()
        return f"{name}~{count}"

    def _drop(self, gone, first, first_building):
        content = self.content
        kept = [b for b in range(first_building, len(content.buildings)) if b not in gone]
        number = {building: first_building + k for k, building in enumerate(kept)}
        polygons = [polygon for polygon in content.polygons[first:] if polygon.building in number]
        for polygon in polygons:
            polygon.building = number[polygon.building]
        content.polygons[first:] = polygons
        content.buildings[first_building:] = [content.buildings[b] for b in kept]

    def _note(self, words):
        if words not in self.content.notes:
            self.content.notes.append(words)

    def finish(self):
        """Write the notes, and raise an error if the file has no usable buildings."""
        content = self.content
        for kind, count in sorted(self.extensions.items())[:MOST_TYPES]:
            content.notes.append(f"{count} {clean_name(kind)} (extension type) read as buildings.")
        for kind, count in sorted(self.others.items())[:MOST_TYPES]:
            content.notes.append(f"{count} {clean_name(kind)} left out: not a building.")
        for words, names in self.remarks.items():
            named = [name[:SHORT] for name in dict.fromkeys(names)]
            more = " …" if len(named) > MOST_NAMED else ""
            content.notes.append(f"{len(names)} {words}: {', '.join(named[:MOST_NAMED])}{more}")
        if not content.buildings and not content.trees:
            raise InputError(self.path, f"contains no buildings{self._met()}", "give a file with buildings")
        if not content.polygons and content.skipped:
            reason, names = max(content.skipped.items(), key=lambda item: len(item[1]))
            problem = f"no building has usable geometry ({reason}: {len(names)}, for example {names[0]!r})"
            raise InputError(self.path, problem, "correct or export the file again")

    def _met(self):
        """What the file contains instead, in brackets."""
        met = [f"{count} {clean_name(kind)[:40]}" for kind, count in sorted(self.others.items())]
        met += [f"{self.content.relief.count()} terrain triangles"] if self.content.relief.count() else []
        met += [f"{reason}: {len(names)}" for reason, names in self.content.skipped.items()]
        return f" ({', '.join(met[:MOST_NAMED])}{' …' if len(met) > MOST_NAMED else ''})" if met else ""


def _shape_of(polygons):
    """Hash of a building's geometry: equal only if all points are equal."""
    rings = [ring for polygon in polygons for ring in polygon.rings]
    lods = tuple((polygon.lod, len(polygon.rings)) for polygon in polygons)
    return hash((lods, tuple(map(len, rings)), np.concatenate(rings).tobytes() if rings else b""))


def _refuse_repeated(path, text, line):
    important = ("type", "CityObjects", "vertices", "transform", "metadata", "geometry-templates")
    twice = [name for name in important if name in getattr(text, "names", ())]
    if twice:
        raise InputError(path, f"line {line}: {twice[0]} is given twice", "keep one of the two")


def _srs_names(header):
    """Spellings of the coordinate reference system: as in 1.0 and later, and as in earlier drafts.

    Metadata is an object; some producers wrap it into a list.
    """
    metadata = header.get("metadata")
    wrapped = metadata if isinstance(metadata, list) else [metadata]
    for members in (*(one for one in wrapped if isinstance(one, dict)), header):
        yield from _spellings(members.get("referenceSystem"))
        crs = members.get("crs")
        yield from _spellings(crs.get("epsg") if isinstance(crs, dict) else crs)


def _spellings(value):
    if isinstance(value, str) and value.strip():
        yield clean_name(value)
    elif type(value) is int and 0 < value < 10**6:
        yield f"EPSG:{value}"
