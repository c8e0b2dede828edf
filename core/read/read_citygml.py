"""Read CityGML 1.0, 2.0 and 3.0: buildings with parts, holes, references and levels of detail; terrain."""

from collections import Counter

from ..city.city import FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .collect_polygons import collect_polygons, resolve_references
from .collect_trees import PLANTS, collect_tree, finish_trees
from .parse_xml import UndeclaredPrefixError, iterate_elements, read_root
from .read_relief import BAD_TRIANGLE, GmlRelief

MEMBERS = ("cityObjectMember", "featureMember", "member")
RELIEFS = ("ReliefFeature", "TINRelief", "RasterRelief", "MassPointRelief", "BreaklineRelief")
IN_RELIEF = [f"{{*}}{name}" for name in RELIEFS]
MOST_UNDECLARED = 16  # prefixes; a file with more is not accepted


def read_citygml(path, report_share=silent):
    """Read all polygons of one CityGML file, at all levels of detail.

    A namespace prefix that the file uses without declaring it (such as that of an extension) is declared on the fly,
    with a note. `report_share` is as in `open_input`.

    Returns
    -------
    FileContent
    """
    declared = []
    while True:
        try:
            content = _read_declared(path, declared, report_share)
        except UndeclaredPrefixError as error:
            if error.prefix in declared or len(declared) == MOST_UNDECLARED:
                raise
            declared.append(error.prefix)
        else:
            words = "{} uses the prefix {!r} without declaring it; a declaration was added."
            content.notes += [words.format(path, prefix) for prefix in declared]
            return content


def _read_declared(path, declared, report_share):
    root, namespaces = read_root(path, declared)
    if "opengis.net/citygml" not in " ".join([root, *filter(None, namespaces.values())]):
        name = root.rpartition("}")[2]
        raise InputError(path, f"line 1: <{name}> is not CityGML", "give a CityGML, CityJSON or OBJ file")
    content, others = FileContent(path), Counter()
    content.plants = FileContent(path, srs_names=content.srs_names)
    relief, before = GmlRelief(content.relief), 0  # terrain triangles before the current member
    tags = ("Building", "Envelope", "appearanceMember", "Triangle", *PLANTS, *MEMBERS)
    for element in iterate_elements(path, tags, declared, report_share, {"Triangle": "TINRelief"}):
        name = element.tag.rpartition("}")[2]
        if name == "Building":
            collect_polygons(element, content)
        elif name == "Triangle":
            problem = relief.add(element)
            if problem:
                content.skip(f"{BAD_TRIANGLE} ({problem})", f"line {element.sourceline}")
        elif name in PLANTS:
            collect_tree(element, content)
        elif name == "Envelope" and element.get("srsName"):  # of a relief, or of the buildings
            of_relief = next(element.iterancestors(*IN_RELIEF), None) is not None
            names = content.relief.srs_names if of_relief else content.srs_names
            names.setdefault(element.get("srsName"), element.sourceline)
        elif name in MEMBERS:
            known = {"Building", *PLANTS, *(RELIEFS if content.relief.count() > before else ())}
            before = content.relief.count()
            for child in element.iterchildren("*"):
                other = child.tag.rpartition("}")[2]
                others[other] += other not in known
    for name, count in sorted(others.items()):
        why = "no triangles" if name in RELIEFS else "not a building"
        content.notes += [f"{count} {name} left out: {why}."] if count else []
    if not content.buildings and not content.trees:
        cure = "give a file with buildings" + (", and this one with --terrain" if content.relief.count() else "")
        raise InputError(path, "contains no buildings", cure)
    content.srs_names = content.srs_names or dict(content.relief.srs_names)
    resolve_references(content)
    finish_trees(content)
    return content
