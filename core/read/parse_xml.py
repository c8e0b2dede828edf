"""Stream an XML file element by element; entities and external references are never resolved."""

import re
import textwrap
from contextlib import contextmanager

from lxml import etree

from ..settings.errors import InputError
from ..settings.progress import silent
from .open_input import CUT, open_input

SAFE = dict.fromkeys(("resolve_entities", "load_dtd", "dtd_validation", "huge_tree"), False)
SAFE |= dict.fromkeys(("no_network", "remove_comments", "remove_pis"), True)
MOST_TAGS = 2**22  # tags in memory at once; the largest buildings have some ten thousand
ROOT = re.compile(rb"<[A-Za-z_][^\s<>/]*")
KNOWN_PREFIXES = {
    "gml": "http://www.opengis.net/gml",
    "bldg": "http://www.opengis.net/citygml/building/2.0",
    "core": "http://www.opengis.net/citygml/2.0",
    "xlink": "http://www.w3.org/1999/xlink",
    "xsi": "http://www.w3.org/2001/XMLSchema-instance",
}


class UndeclaredPrefixError(InputError):
    """A name has a namespace prefix that is not declared."""

    prefix = ""


def read_root(path, declared=()):
    """Tag and namespaces of the root element.

    Parameters
    ----------
    path : path-like
    declared : collection of str
        Prefixes that the file uses without declaring them; declarations are added.

    Returns
    -------
    str, dict
        Qualified tag, and prefix -> namespace.

    Raises
    ------
    UndeclaredPrefixError
        A prefix that is neither declared in the file nor given here.
    InputError
        Not XML, or XML with a document type (its entities could be a bomb or point to other files).
    """
    with _open_xml(path, declared) as source:
        root = next((root for _, root in etree.iterparse(source, events=("start",), **SAFE)), None)
        if root is None:
            raise InputError(path, "line 1: no element found", CUT)
        info = root.getroottree().docinfo
        if info.internalDTD is not None or info.externalDTD is not None:
            raise InputError(
                path,
                f"line {root.sourceline or 1}: document types (<!DOCTYPE …>) are not accepted",
                "remove it and the entities it declares",
            )
        return root.tag, dict(root.nsmap)


def iterate_elements(path, tags, declared=(), report_share=silent, only_in=None):
    """Yield each completed element with one of the tags; it and everything before it is freed
    afterwards.

    Parameters
    ----------
    path : path-like
    tags : sequence of str
        Local names in any namespace.
    declared : collection of str
        Prefixes that the file uses without declaring them; declarations are added.
    report_share : callable, optional
        As in `open_input`.
    only_in : dict, optional
        Tag -> tag: elements of the first are yielded only inside one of the second; others are left
        as they are.

    Raises
    ------
    UndeclaredPrefixError, InputError
        As of `read_root`, and where a single building has too many elements for memory.
    """
    read_root(path, declared)
    above = {tag: f"{{*}}{outer}" for tag, outer in (only_in or {}).items()}
    with _open_xml(path, declared, report_share) as source:
        for _, element in etree.iterparse(
            source, events=("end",), tag=[f"{{*}}{tag}" for tag in tags], **SAFE
        ):
            outer = above.get(element.tag.rpartition("}")[2]) if above else None
            if outer and next(element.iterancestors(outer), None) is None:
                continue
            yield element
            element.clear(keep_tail=False)
            while element.getprevious() is not None:
                del element.getparent()[0]
            source.tags = 0


@contextmanager
def _open_xml(path, declared, report_share=silent):
    with open_input(path, report_share) as stream:
        try:
            yield _Source(path, stream, declared)
        except etree.XMLSyntaxError as error:
            raise _explain(path, error) from error


class _Source:
    """Bytes of a file, with declarations added to its root element; too many tags before a reset of
    `tags` end it.
    """

    def __init__(self, path, stream, prefixes):
        self._path, self._stream, self.tags = path, stream, 0
        # The root element must begin within the first 64 KB.
        self._head = head = stream.read(2**16) if prefixes else b""
        root = ROOT.search(
            re.sub(rb"(?s)<!--.*?-->|<\?.*?\?>", lambda found: b" " * len(found.group()), head)
        )
        names = (
            f' xmlns:{prefix}="{KNOWN_PREFIXES.get(prefix, "urn:undeclared:" + prefix)}"'
            for prefix in prefixes
        )
        if root is not None:
            self._head = head[: root.end()] + "".join(names).encode() + head[root.end() :]

    def read(self, size=-1):
        data, self._head = self._head or self._stream.read(size), b""
        self.tags += data.count(b"<")
        if self.tags > MOST_TAGS:
            raise InputError(
                self._path,
                f"more than {MOST_TAGS:,} tags before the end of a building",
                "remove what is not a building, or split the building",
            )
        return data


def _explain(path, error):
    """InputError for an error of the parser."""
    message = re.sub(r"\s+", " ", (error.msg or "not well formed").split(", line ")[0])
    # A message quotes whole attributes.
    message = textwrap.shorten(message.replace(", try XML_PARSE_HUGE", ""), 300, placeholder=" …")
    line = error.lineno or 1
    prefix = re.match(r"Namespace prefix (\S+)", message)
    if error.code == etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE and prefix:
        problem = f"line {line}: the prefix {prefix[1]!r} is not declared"
        error_to_raise = UndeclaredPrefixError(
            path, problem, f'declare it in the first element: xmlns:{prefix[1]}="…"'
        )
        error_to_raise.prefix = prefix[1]
        return error_to_raise
    if "Resource limit" in message or "too long" in message or "xcessive depth" in message:
        return InputError(path, f"line {line}: too much text or nested too deeply ({message})", CUT)
    if line == 1 and "Start tag expected" in message:
        return InputError(path, "line 1: this is not XML", "give a CityGML file")
    return InputError(path, f"line {line}: invalid XML ({message})", CUT)
