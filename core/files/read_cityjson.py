"""Read CityJSON 1.0, 1.1 and 2.0, as one text or as a sequence of features: buildings with parts and installations.

CityJSON: Ledoux et al. (2019), doi:10.1186/s40965-019-0064-0.
"""

import re
from pathlib import Path

import numpy as np

from ..city.polygon import FileContent
from ..errors import InputError
from ..progress import untold
from .collect_shapes import Owner, Shapes, collect_shapes
from .find_families import find_families
from .limits import clean_name
from .parse_json import READ, iterate_json
from .place_templates import Templates
from .read_vertices import read_transform, read_vertices

VERSION = re.compile(r"[12]\.\d+(\.\d+)?")
OLD = re.compile(r"0\.\d")
MOST_NAMED = 5  # in a note
SHORT = 60  # characters of a name in a note
MOST_TYPES = 30  # each with a note of its own
DRAWN = 0.8  # share of the time when the last object of one text is drawn
OBJECTS_AT_ONCE = 64  # between two reports
TWICE = "building given twice in the file"
ORPHANS = "parts or installations have no building above them; they stand as buildings"
AGAIN = "city object whose name comes again later in the file"


def read_cityjson(path, tell=untold):
    """Every polygon of the buildings of one CityJSON file, all levels of detail, before any choice.

    Parameters
    ----------
    path : path-like
        ``.json`` or ``.jsonl``, whichever of the two it holds; gzip is welcome.
    tell : callable, optional
        As of `open_input`, with the share of the work.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        The file is missing, cut, not CityJSON, without buildings, or none of them has a shape that can be used.
    """
    path = Path(path)
    content = FileContent(path)
    reading = _Reading(path, content)
    for value, line in iterate_json(path, content.notes, tell):
        kind = value.get("type") if isinstance(value, dict) else None
        if kind == "CityJSON":
            reading.start(value, line)
        elif kind != "CityJSONFeature":
            word = clean_name(str(kind))[:60]
            raise InputError(path, f"line {line}: JSON, but no CityJSON (type {word!r})", "give a CityJSON file")
        elif reading.templates is None:
            cure = "give the head of the sequence, of type CityJSON, as its first line"
            raise InputError(path, f"line {line}: a CityJSONFeature before any head", cure)
        reading.add(value, line, tell if kind == "CityJSON" else untold)
    reading.finish()
    return content


class _Reading:
    """One file while it is read."""

    def __init__(self, path, content):
        self.path, self.content = path, content
        self.transform, self.templates, self.remarks = None, None, {}
        self.others, self.extensions = {}, {}
        self.seen = {}  # name of a building -> hashes of the shapes it came with

    def start(self, header, line):
        """Take transform, templates and coordinate reference system from a CityJSON object."""
        _refuse_repeated(self.path, header, line)
        self.transform = read_transform(self.path, line, header.get("transform"))
        self.templates = Templates(self.path, line, header.get("geometry-templates"))
        self._check_version(header.get("version"), line)
        for name in _srs_names(header):
            self.content.srs_names.setdefault(name, line)

    def _check_version(self, version, line):
        if version is None:
            self._note(f"{self.path} names no version of CityJSON.")
            return
        text = clean_name(str(version))[:20]
        if not VERSION.fullmatch(text):
            old = "bring it to 2.0, for example with cjio's upgrade"
            cure = old if OLD.match(text) else "give CityJSON 1.0 to 2.0"
            raise InputError(self.path, f"line {line}: CityJSON of version {text!r}", cure)
        if self.transform is None and not text.startswith("1.0"):
            self._note(f"{self.path} has no transform; its vertices were read as coordinates.")

    def add(self, text, line, tell=untold):
        """Take the buildings from the objects of one JSON text."""
        _refuse_repeated(self.path, text, line)
        objects = text.get("CityObjects", {})
        if not isinstance(objects, dict):
            raise InputError(self.path, f"line {line}: CityObjects is no JSON object", "export the file again")
        transform = self.transform
        if text["type"] == "CityJSONFeature" and "transform" in text:
            transform = read_transform(self.path, line, text["transform"]) or transform
            self._note(f"{self.path} has features with a transform of their own; it was applied.")
        vertices, whole = read_vertices(self.path, line, text.get("vertices"), transform)
        if transform is not None and not whole:
            self._note(f"{self.path} has a transform and yet vertices that are not whole numbers; it was applied.")
        for name in getattr(objects, "names", ()):
            self.content.skip(AGAIN, clean_name(name))
        self._add_objects(objects, Shapes(self.content, vertices, self.templates, self.remarks), line, tell)

    def _add_objects(self, objects, shapes, line, tell):
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
        for number, (name, one) in enumerate(objects.items()):
            if number % OBJECTS_AT_ONCE == 0:
                tell(READ + (DRAWN - READ) * number / len(objects))
            if name in families.owner:
                kind = one["type"] if one["type"] in ("BuildingInstallation", "BuildingConstructiveElement") else ""
                place = building[families.owner[name]], part[families.part[name]]
                collect_shapes(one, Owner(clean_name(name), *place, kind, line), shapes)
                one.pop("geometry", None)  # what was taken makes room for what comes
        self._tell_repeated(first, first_building, line)

    def _tell_repeated(self, first, first_building, line):
        """Leave out a building that came before point for point; give another of the same name a number."""
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
                words = f"{self.path}, line {line}: another building bears the name of an earlier one, number added"
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
        """Say what was met, and refuse a file that gives nothing."""
        content = self.content
        for kind, count in sorted(self.extensions.items())[:MOST_TYPES]:
            content.notes.append(f"{count} {clean_name(kind)} read as buildings: a type of an extension.")
        for kind, count in sorted(self.others.items())[:MOST_TYPES]:
            content.notes.append(f"{count} {clean_name(kind)} left out: no building.")
        for words, names in self.remarks.items():
            named = [name[:SHORT] for name in dict.fromkeys(names)]
            more = " …" if len(named) > MOST_NAMED else ""
            content.notes.append(f"{len(names)} {words}: {', '.join(named[:MOST_NAMED])}{more}")
        if not content.buildings:
            raise InputError(self.path, f"no buildings in it{self._met()}", "give a file that holds buildings")
        if not content.polygons and content.skipped:
            reason, names = max(content.skipped.items(), key=lambda item: len(item[1]))
            problem = f"no building has a shape that can be used ({reason}: {len(names)}, as {names[0]!r})"
            raise InputError(self.path, problem, "correct or export the file again")

    def _met(self):
        """What there is instead, in brackets."""
        met = [f"{count} {clean_name(kind)[:40]}" for kind, count in sorted(self.others.items())]
        met += [f"{reason}: {len(names)}" for reason, names in self.content.skipped.items()]
        return f" ({', '.join(met[:MOST_NAMED])}{' …' if len(met) > MOST_NAMED else ''})" if met else ""


def _shape_of(polygons):
    """A number that two buildings share only where they are drawn point for point alike."""
    rings = [ring for polygon in polygons for ring in polygon.rings]
    lods = tuple((polygon.lod, len(polygon.rings)) for polygon in polygons)
    return hash((lods, tuple(map(len, rings)), np.concatenate(rings).tobytes() if rings else b""))


def _refuse_repeated(path, text, line):
    important = ("type", "CityObjects", "vertices", "transform", "metadata", "geometry-templates")
    twice = [name for name in important if name in getattr(text, "names", ())]
    if twice:
        raise InputError(path, f"line {line}: {twice[0]} is given twice", "keep one of the two")


def _srs_names(header):
    """Spellings of the coordinate reference system: that of 1.0 and later, and the code of earlier drafts."""
    metadata = header.get("metadata")
    for members in (metadata if isinstance(metadata, dict) else {}, header):
        yield from _spellings(members.get("referenceSystem"))
        crs = members.get("crs")
        yield from _spellings(crs.get("epsg") if isinstance(crs, dict) else crs)


def _spellings(value):
    if isinstance(value, str) and value.strip():
        yield clean_name(value)
    elif type(value) is int and 0 < value < 10**6:
        yield f"EPSG:{value}"
