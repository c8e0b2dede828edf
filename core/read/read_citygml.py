"""Read CityGML 1.0, 2.0 and 3.0: buildings with parts, holes, references and levels of detail;
terrain.
"""

import re
from collections import Counter

import numpy as np

from ..city.city import Extent, FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .collect_polygons import collect_polygons, name_element, read_numbers, resolve_references
from .collect_trees import PLANTS, collect_tree, finish_trees
from .lifetimes import GONE, is_terminated, leave_out_demolished, note_demolitions, read_ends
from .open_input import open_input
from .parse_xml import UndeclaredPrefixError, iterate_elements, read_root
from .read_relief import BAD_TRIANGLE, GmlRelief

MEMBERS = ("cityObjectMember", "featureMember", "member")
RELIEFS = ("ReliefFeature", "TINRelief", "RasterRelief", "MassPointRelief", "BreaklineRelief")
CITYGML = "opengis.net/citygml"  # in the namespaces of the standard


def read_citygml(path, report_share=silent):
    """Read all polygons of one CityGML file, at all levels of detail.

    A namespace prefix that the file uses without declaring it (such as an extension's) is declared
    on the fly, with a note. `report_share` is as in `open_input`.

    Returns
    -------
    FileContent
    """
    declared = []
    while True:
        try:
            content = _read_declared(path, declared, report_share)
        except UndeclaredPrefixError as error:
            # A file with more than 16 undeclared prefixes is not accepted.
            if error.prefix in declared or len(declared) == 16:
                raise
            declared.append(error.prefix)
        else:
            words = "{} uses the prefix {!r} without declaring it; a declaration was added."
            content.notes += [words.format(path, prefix) for prefix in declared]
            return content


def _read_declared(path, declared, report_share):
    # All polygons, trees and terrain of one file, as a FileContent. Each prefix in `declared`,
    # which the file uses without declaring it, is declared while it is read.
    # Refused unless the root, or a declaration early in the file, is of a CityGML namespace.
    root, namespaces = read_root(path, declared)
    if CITYGML not in " ".join([root, *filter(None, namespaces.values())]) and not _is_named_later(
        path
    ):
        name = root.rpartition("}")[2]
        raise InputError(
            path, f"line 1: <{name}> is not CityGML", "give a CityGML, CityJSON or OBJ file"
        )
    # Elements one by one, so that the file is never whole in memory: buildings, terrain, plants,
    # envelopes, and other members, which are counted.
    content, others, extended = FileContent(path), Counter(), Counter()
    content.plants = FileContent(path, srs_names=content.srs_names)
    enveloped = {}  # systems that envelopes name: they count where no geometry names one
    relief, before = GmlRelief(content.relief), 0  # terrain triangles before the current member
    tags = ("Building", "Envelope", "appearanceMember", "Triangle", *PLANTS, *MEMBERS)
    for element in iterate_elements(path, tags, declared, report_share, {"Triangle": "TINRelief"}):
        name = element.tag.rpartition("}")[2]
        # Buildings and plants whose record has ended, and bad triangles, are left out and reported.
        if name == "Building":
            _collect_building(element, content)
        elif name == "Triangle":
            problem = relief.add(element)
            if problem:
                content.skip(f"{BAD_TRIANGLE} ({problem})", f"line {element.sourceline}")
        elif name in PLANTS and is_terminated(read_ends(element)):
            content.skip(GONE, name_element(element) or f"line {element.sourceline}")
        elif name in PLANTS:
            collect_tree(element, content)
        elif name == "Envelope":
            _collect_extent(element, content, enveloped)
        elif name in MEMBERS:
            # A member with terrain counts as known only if it gave triangles; what is not known is
            # counted, but buildings of extensions are read.
            known = {"Building", *PLANTS, *(RELIEFS if content.relief.count() > before else ())}
            before = content.relief.count()
            _read_member(element, content, known, (extended, others))
    # What was taken from extensions and what was left out is told; a file with neither buildings
    # nor trees is refused, with what it holds instead.
    for name, count in sorted(extended.items()):
        content.notes.append(f"{count} {name} (of an extension) read as buildings.")
    for name, count in sorted(others.items()):
        why = "no triangles" if name in RELIEFS else "not a building"
        content.notes += [f"{count} {name} left out: {why}."] if count else []
    if not content.buildings and not content.trees:
        cure = "give a file with buildings" + (
            ", and this one with --terrain" if content.relief.count() else ""
        )
        left_out = {reason: len(names) for reason, names in content.skipped.items()}
        held = {**others, "terrain triangles": content.relief.count(), **left_out}
        words = ", ".join([f"{count} {name}" for name, count in sorted(held.items()) if count][:5])
        raise InputError(path, f"contains no buildings{f' (but {words})' if words else ''}", cure)
    # Where no geometry names a coordinate reference system, the envelopes' counts, else the
    # terrain's.
    content.srs_names = content.srs_names or enveloped or dict(content.relief.srs_names)
    # Only now all ids are known: references are followed, what was demolished is left out, and each
    # tree gets the polygons of its best level.
    resolve_references(content)
    leave_out_demolished(content)
    finish_trees(content)
    return content


def _collect_building(element, content):
    """Read a building, unless its record has ended."""
    ends = read_ends(element)
    if is_terminated(ends):
        content.skip(GONE, name_element(element) or f"line {element.sourceline}")
        return
    collect_polygons(element, content)
    note_demolitions({(len(content.buildings) - 1, 0): ends}, content)


def _read_member(element, content, known, counts):
    """Read the buildings of extensions in a member, and count them and what else is not known, by
    name.
    """
    extended, others = counts
    for child in element.iterchildren("*"):
        name = child.tag.rpartition("}")[2]
        if _is_own_building(child):
            _collect_building(child, content)
            extended[name] += 1
        else:
            others[name] += name not in known


def _is_named_later(path):
    """Whether a namespace of CityGML is declared after the root element, as on the members of a
    generic collection.
    """
    with open_input(path) as stream:
        return CITYGML.encode() in stream.read(2**20)


def _is_own_building(element):
    """Whether an element of an extension is a subclass of Building: it has what the standard gives
    to buildings.
    """
    if CITYGML in element.tag:
        return False
    return any(re.search(CITYGML + r"/building/", child.tag) for child in element.iterchildren("*"))


def _collect_extent(element, content, enveloped):
    """Add an envelope, of a relief, of the file or of a building, and the system that it names."""
    srs_name, of_relief = (
        element.get("srsName", ""),
        next(element.iterancestors(*[f"{{*}}{name}" for name in RELIEFS]), None) is not None,
    )
    if srs_name:
        (content.relief.srs_names if of_relief else enveloped).setdefault(
            srs_name, element.sourceline
        )
    corners = [
        read_numbers(element.iterfind(f"{{*}}{name}")) for name in ("lowerCorner", "upperCorner")
    ]
    sound = all(
        numbers is not None and len(numbers) > 1 and np.isfinite(numbers).all()
        for numbers in corners
    )
    if sound and not of_relief:
        extent = Extent(
            srs_name, element.get("axisLabels", ""), *(numbers[:2] for numbers in corners)
        )
        content.extents.append(extent)
