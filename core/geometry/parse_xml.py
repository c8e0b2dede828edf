"""Stream an XML file element by element, without ever following what it points to."""

import re

from lxml import etree

from ..errors import InputError
from .open_input import open_input

SAFE = {
    "resolve_entities": False,
    "no_network": True,
    "load_dtd": False,
    "dtd_validation": False,
    "huge_tree": False,
    "remove_comments": True,
    "remove_pis": True,
}
CUT = "the file is cut or damaged: get it again"


def read_root(path):
    """Tag and namespaces of the root element.

    Returns
    -------
    str, dict
        Qualified tag, and prefix -> namespace.

    Raises
    ------
    InputError
        Not XML, or XML with a document type (its entities could be a bomb or reach outside).
    """
    with open_input(path) as stream:
        try:
            _, root = next(iter(etree.iterparse(stream, events=("start",), **SAFE)))
        except StopIteration:
            raise InputError(path, "line 1: no element found", CUT) from None
        except etree.XMLSyntaxError as error:
            raise _syntax_error(path, error) from error
        info = root.getroottree().docinfo
        if info.internalDTD is not None or info.externalDTD is not None:
            problem = f"line {root.sourceline or 1}: a document type (<!DOCTYPE …>) is not accepted"
            raise InputError(path, problem, "remove it and the entities it declares")
        return root.tag, dict(root.nsmap)


def iterate_elements(path, tags):
    """Yield each element that ends and has one of the tags; what lies before it is forgotten afterwards.

    Parameters
    ----------
    path : path-like
    tags : sequence of str
        Local names in any namespace.
    """
    wanted = [f"{{*}}{tag}" for tag in tags]
    with open_input(path) as stream:
        try:
            for _, element in etree.iterparse(stream, events=("end",), tag=wanted, **SAFE):
                yield element
                _forget(element)
        except etree.XMLSyntaxError as error:
            raise _syntax_error(path, error) from error


def _forget(element):
    element.clear(keep_tail=False)
    parent = element.getparent()
    while element.getprevious() is not None:
        del parent[0]


def _syntax_error(path, error):
    message = re.sub(r"\s+", " ", (error.msg or "not well formed").split(", line ")[0])
    message = message.replace(", try XML_PARSE_HUGE", "").strip()
    line = error.lineno or 1
    if "ntity" in message and ("loop" in message or "mplification" in message or "ndeclared" in message):
        return InputError(path, f"line {line}: entities are not accepted ({message})", "write the text out in full")
    if "Resource limit" in message or "too long" in message or "xcessive depth" in message:
        return InputError(path, f"line {line}: more text or depth than a city needs ({message})", CUT)
    if line == 1 and "Start tag expected" in message:
        return InputError(path, "line 1: this is not XML", "give a CityGML file")
    return InputError(path, f"line {line}: the XML breaks off ({message})", CUT)
