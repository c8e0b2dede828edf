"""Read CityJSON 1.0, 1.1, 2.0 and CityJSONSeq: buildings with their parts, templates and levels of detail.

CityJSON: Ledoux et al. (2019), doi:10.1186/s40965-019-0064-0.
"""

import re

import numpy as np

from ..errors import InputError
from .cityjson_geometry import DEPTHS, NO_SURFACES, SOLIDS, Owner, collect_geometry
from .collect_polygons import LARGEST_COORDINATE
from .parse_json import iterate_documents
from .place_shapes import Anchor
from .polygon import FileContent

PARTS = {"BuildingPart"}
INSTALLATIONS = {"BuildingInstallation", "BuildingConstructiveElement"}
INSIDE = {"BuildingRoom", "BuildingFurniture", "BuildingStorey", "BuildingUnit"}
LOD = re.compile(r"[0-4](\.\d)?")
OLD = re.compile(r"0\.\d")
UNSEEN = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
LONGEST_NAME = 200  # characters
MOST_TYPES = 30  # each with a note of its own


def read_cityjson(path):
    """Every polygon of one CityJSON file, all levels of detail, before any choice.

    Parameters
    ----------
    path : path-like
        One document, or a line for each feature; packed with gzip or not.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        The file is missing, empty, cut, not CityJSON or without buildings, or a coordinate cannot be used.
    """
    reader = None
    for line, document in iterate_documents(path):
        if reader is None:
            reader = _Reader(path, line, document)
        elif not isinstance(document, dict) or document.get("type") != "CityJSONFeature":
            problem = f"line {line}: a CityJSONFeature is expected here"
            raise InputError(path, problem, "give one CityJSON document, or a line for each feature")
        reader.collect(line, document)
    reader.finish()
    return reader.content


class _Reader:
    """What is known of a file while its documents are gone through."""

    def __init__(self, path, line, head):
        self.path, self.content = path, FileContent(path)
        _check_head(path, line, head)
        self.transform = _read_transform(path, head.get("transform"))
        self.buildings, self.others, self.orphans = {}, {}, []
        templates = head.get("geometry-templates")
        templates = templates if isinstance(templates, dict) else {}
        self.templates = templates.get("templates") if isinstance(templates.get("templates"), list) else []
        self.template_vertices = _read_vertices(path, "vertices-templates", templates.get("vertices-templates", []))
        name = _name_of_system(head.get("metadata"))
        if name:
            self.content.srs_names[name] = line

    def collect(self, line, document):
        """Add the polygons of a document."""
        objects = document.get("CityObjects", {})
        if not isinstance(objects, dict):
            raise InputError(self.path, f"line {line}: CityObjects is no object", "give a CityJSON file")
        scale, translate = self.transform
        vertices = _read_vertices(self.path, "vertices", document.get("vertices", []), scale, translate)
        for name, item in objects.items():
            kind = item.get("type") if isinstance(item, dict) else None
            role = _role(kind)
            if role is None:
                other = _clean(str(kind))
                self.others[other] = self.others.get(other, 0) + 1
                continue
            top = _top(name, objects)
            if top is None:
                self.orphans.append(_clean(name))
                top = name
            building = self._number(top)
            self.content.part_count += role == "part"
            owner = Owner(
                _clean(name),
                building,
                self.content.part_count if role == "part" else 0,
                "BuildingInstallation" if role == "installation" else "",
                line,
            )
            self._collect_object(item.get("geometry"), vertices, owner)

    def _number(self, name):
        if name not in self.buildings:
            self.buildings[name] = len(self.content.buildings)
            self.content.buildings.append(_clean(name))
        return self.buildings[name]

    def _collect_object(self, geometries, vertices, owner):
        if geometries is None:
            return
        if not isinstance(geometries, list) or not all(isinstance(one, dict) for one in geometries):
            self.content.skip("geometry that is no list of objects", owner.name)
            return
        best = {}  # LoD -> the geometry that draws the object best; the others draw it again
        for one in geometries:
            lod = _lod(one)
            if _rank(one) > _rank(best.get(lod, {})):
                best[lod] = one
        for one in geometries:
            kind = one.get("type")
            if kind == "GeometryInstance":
                self._set_down(one, vertices, owner)
            elif kind in NO_SURFACES:
                self.content.skip(f"geometry without surfaces ({kind})", owner.name)
            elif kind not in DEPTHS:
                self.content.skip("geometry of an unknown type", owner.name)
            elif (lod := _lod(one)) is None:
                self.content.skip("no level of detail", owner.name)
            else:
                source = "surface" if best[lod] is one else "multisurface"
                self.content.polygons += collect_geometry(one, vertices, owner, self.content, source=source, lod=lod)

    def _set_down(self, instance, vertices, owner):
        """Add the polygons of a template where an instance of it stands."""
        index, places = instance.get("template"), instance.get("boundaries")
        known = type(index) is int and 0 <= index < len(self.templates)
        template = self.templates[index] if known and isinstance(self.templates[index], dict) else {}
        lod = _lod(template)
        placed = isinstance(places, list) and len(places) == 1 and type(places[0]) is int
        placed = placed and 0 <= places[0] < len(vertices)
        matrix = _numbers(instance.get("transformationMatrix", np.eye(4).ravel().tolist()))
        if template.get("type") not in DEPTHS or lod is None or not placed or matrix.shape != (16,):
            self.content.skip("instance without a template, a place or a matrix that can be used", owner.name)
            return
        shape = collect_geometry(template, self.template_vertices, owner, self.content, lod=lod)
        self.content.polygons += Anchor(matrix.reshape(4, 4), vertices[places[0]]).place(shape)

    def finish(self):
        """Say what was left out; refuse a file without buildings."""
        content = self.content
        content.notes += [
            f"{count} {kind} left out: no building." for kind, count in sorted(self.others.items())[:MOST_TYPES]
        ]
        if self.orphans:
            names = ", ".join(self.orphans[:5])
            content.notes.append(
                f"{len(self.orphans)} objects whose parent the file does not hold stand as buildings: {names}."
            )
        if not content.buildings:
            raise InputError(self.path, "no buildings in it", "give a file that holds buildings")


def _check_head(path, line, head):
    kind = head.get("type") if isinstance(head, dict) else None
    if kind != "CityJSON":
        cure = (
            "give the head of the sequence as its first line" if kind == "CityJSONFeature" else "give a CityJSON file"
        )
        raise InputError(path, f"line {line}: JSON, but no CityJSON (type {str(kind)[:40]!r})", cure)
    version = str(head.get("version"))
    if not re.fullmatch(r"[12]\.\d+(\.\d+)?", version):
        cure = "bring it to 2.0, for example with cjio's upgrade" if OLD.match(version) else "give CityJSON 1.0 to 2.0"
        raise InputError(path, f"line {line}: CityJSON of version {version[:20]!r}", cure)


def _read_transform(path, transform):
    """Scale and translation, (3,) float64 each."""
    if transform is None:  # CityJSON 1.0 may leave it out
        return np.ones(3), np.zeros(3)
    transform = transform if isinstance(transform, dict) else {}
    scale, translate = (_numbers(transform.get(key)) for key in ("scale", "translate"))
    if scale.shape != (3,) or translate.shape != (3,):
        raise InputError(path, "transform: scale and translate are not three numbers each", "correct the transform")
    return scale, translate


def _read_vertices(path, name, rows, scale=1.0, translate=0.0):
    """Vertices, (v, 3) float64 in the units of the file's system."""
    vertices = _numbers(rows) if rows else np.empty((0, 3))
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(path, f"{name}: not rows of three numbers", "correct or get the file again")
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = vertices * scale + translate
        bad = ~(np.abs(vertices) <= LARGEST_COORDINATE).all(axis=1)  # also true for NaN
    if bad.any():
        place = f"{name}[{int(np.flatnonzero(bad)[0])}]"
        problem = f"{place}: a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        raise InputError(path, problem, "correct this vertex, or the transform")
    return vertices


def _numbers(rows):
    """Finite numbers of nested lists as an array; an empty one where they are anything else."""
    try:
        array = np.array(rows)
        array = array.astype(float) if array.dtype.kind in "iufO" else np.empty(0)
    except (ValueError, TypeError, OverflowError):
        return np.empty(0)
    return array if np.isfinite(array).all() else np.empty(0)


def _name_of_system(metadata):
    metadata = metadata if isinstance(metadata, dict) else {}
    name = metadata.get("referenceSystem")
    if isinstance(name, str):
        return _clean(name)
    crs = metadata.get("crs")
    epsg = crs.get("epsg") if isinstance(crs, dict) else None
    return f"EPSG:{epsg}" if type(epsg) is int else None


def _clean(name):
    """A name that fits into a line: no control characters, no halves of characters, not too long."""
    return UNSEEN.sub("\N{REPLACEMENT CHARACTER}", name[:LONGEST_NAME])


def _role(kind):
    """What a type of city object is to us: building, part, installation, or None."""
    if not isinstance(kind, str) or kind in INSIDE:
        return None
    if kind in PARTS:
        return "part"
    if kind in INSTALLATIONS:
        return "installation"
    return "building" if kind.lstrip("+").startswith("Building") else None


def _top(name, objects):
    """The building that an object belongs to; None where its parents are not there or go round in a circle."""
    met = set()
    while True:
        if name in met or not isinstance(objects.get(name), dict):
            return None
        met.add(name)
        parents = objects[name].get("parents")
        if not isinstance(parents, list) or not parents or not isinstance(parents[0], str):
            return name
        name = parents[0]


def _lod(geometry):
    """Level of detail as text, None where there is none that means anything."""
    lod = geometry.get("lod")
    if isinstance(lod, bool) or not isinstance(lod, (str, int, float)):
        return None
    text = f"{lod:g}" if isinstance(lod, float) else str(lod).strip()
    return text if LOD.fullmatch(text) else None


def _rank(geometry):
    """Which of two drawings of one object is the better: one with classes, then a solid."""
    return bool(geometry.get("semantics")), geometry.get("type") in SOLIDS, bool(geometry)
