"""Read CityGML 1.0, 2.0 and 3.0: buildings with parts, holes, references and levels of detail."""

from ..city.polygon import FileContent
from ..errors import InputError
from ..progress import ignore_share
from .collect_polygons import collect_polygons
from .parse_xml import UndeclaredPrefixError, iterate_elements, read_root
from .place_shapes import place_shapes
from .resolve_references import resolve_references

MEMBERS = ("cityObjectMember", "featureMember", "member")
MOST_UNDECLARED = 16  # prefixes; a file with more is not accepted


def read_content(path, tell=ignore_share):
    """Read all polygons of one CityGML file, at all levels of detail.

    A namespace prefix that the file uses without declaring it (such as that of an extension) is declared on the fly,
    with a note. `tell` is as in `open_input`.

    Returns
    -------
    FileContent
    """
    declared = []
    while True:
        try:
            content = _read_declared(path, declared, tell)
        except UndeclaredPrefixError as error:
            if error.prefix in declared or len(declared) == MOST_UNDECLARED:
                raise
            declared.append(error.prefix)
        else:
            words = "{} uses the prefix {!r} without declaring it; a declaration was added."
            content.notes += [words.format(path, prefix) for prefix in declared]
            return content


def _read_declared(path, declared, tell):
    root, namespaces = read_root(path, declared)
    if "opengis.net/citygml" not in " ".join([root, *filter(None, namespaces.values())]):
        name = root.rpartition("}")[2]
        raise InputError(path, f"line 1: <{name}> is not CityGML", "give a CityGML, CityJSON or OBJ file")
    content, kinds, others = FileContent(path), {}, {}
    for element in iterate_elements(path, ("Building", "Envelope", "appearanceMember", *MEMBERS), declared, tell):
        name = element.tag.rpartition("}")[2]
        if name == "Building":
            collect_polygons(element, content, kinds)
        elif name == "Envelope":
            if element.get("srsName"):
                content.srs_names.setdefault(element.get("srsName"), element.sourceline)
        elif name in MEMBERS:
            for child in element.iterchildren("*"):
                other = child.tag.rpartition("}")[2]
                others[other] = others.get(other, 0) + (other != "Building")
    content.notes += [f"{count} {name} left out: not a building." for name, count in sorted(others.items()) if count]
    if not content.buildings:
        raise InputError(path, "contains no buildings", "give a file with buildings")
    resolve_references(content)
    place_shapes(content)
    return content
