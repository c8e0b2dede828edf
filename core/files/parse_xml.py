"""Stream an XML file element by element; entities and external references are never resolved."""

import io
import re
import textwrap

from lxml import etree

from ..settings.errors import InputError
from ..settings.progress import ignore_share
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
CUT = "the file is truncated or damaged: download or export it again"
LONGEST_MESSAGE = 300  # characters of a parser message; it quotes whole attributes
MOST_TAGS = 2**22  # tags in memory at once; the largest buildings have some ten thousand
HEAD_BYTES = 2**16  # the root element must begin within these
ROOT = re.compile(rb"<[A-Za-z_][^\s<>/]*")
NO_CONTENT = re.compile(rb"<!--.*?-->|<\?.*?\?>", re.DOTALL)
KNOWN_PREFIXES = {
    "gml": "http://www.opengis.net/gml",
    "bldg": "http://www.opengis.net/citygml/building/2.0",
    "core": "http://www.opengis.net/citygml/2.0",
    "xlink": "http://www.w3.org/1999/xlink",
    "xsi": "http://www.w3.org/2001/XMLSchema-instance",
}


class UndeclaredPrefixError(InputError):
    """A name has a namespace prefix that is not declared."""

    def __init__(self, path, line, prefix):
        problem = f"line {line}: the prefix {prefix!r} is not declared"
        super().__init__(path, problem, f'declare it in the first element: xmlns:{prefix}="…"')
        self.line, self.prefix = line, prefix

    def __reduce__(self):
        return type(self), (self.source, self.line, self.prefix)


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
    with open_input(path) as opened:
        stream = _declare(opened, declared)
        try:
            _, root = next(iter(etree.iterparse(stream, events=("start",), **SAFE)))
        except StopIteration:
            raise InputError(path, "line 1: no element found", CUT) from None
        except etree.XMLSyntaxError as error:
            raise _syntax_error(path, error) from error
        info = root.getroottree().docinfo
        if info.internalDTD is not None or info.externalDTD is not None:
            problem = f"line {root.sourceline or 1}: document types (<!DOCTYPE …>) are not accepted"
            raise InputError(path, problem, "remove it and the entities it declares")
        return root.tag, dict(root.nsmap)


def iterate_elements(path, tags, declared=(), report_share=ignore_share, only_in=None):
    """Yield each completed element with one of the tags; it and everything before it is freed afterwards.

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
        Tag -> tag: elements of the first are yielded only inside one of the second; others are left as they are.

    Raises
    ------
    UndeclaredPrefixError, InputError
    """
    wanted = [f"{{*}}{tag}" for tag in tags]
    above = {tag: f"{{*}}{outer}" for tag, outer in (only_in or {}).items()}
    with open_input(path, report_share) as opened:
        stream = _Counted(path, _declare(opened, declared))
        try:
            for _, element in etree.iterparse(stream, events=("end",), tag=wanted, **SAFE):
                outer = above.get(element.tag.rpartition("}")[2]) if above else None
                if outer and next(element.iterancestors(outer), None) is None:
                    continue
                yield element
                _forget(element)
                stream.tags = 0
        except etree.XMLSyntaxError as error:
            raise _syntax_error(path, error) from error


def _declare(stream, prefixes):
    """The same stream with namespace declarations added to its root element."""
    if not prefixes:
        return stream
    head = stream.read(HEAD_BYTES)
    blank = NO_CONTENT.sub(lambda found: b" " * len(found.group()), head)
    root = ROOT.search(blank)
    if root is None:
        return _Joined(head, stream)
    given = "".join(
        f' xmlns:{prefix}="{KNOWN_PREFIXES.get(prefix, "urn:undeclared:" + prefix)}"' for prefix in prefixes
    )
    return _Joined(head[: root.end()] + given.encode() + head[root.end() :], stream)


class _Joined(io.RawIOBase):
    """Bytes already read, followed by those of a stream."""

    def __init__(self, head, stream):
        self._head, self._stream = io.BytesIO(head), stream

    def read(self, size=-1):
        return self._head.read(size) or self._stream.read(size)


class _Counted:
    """A stream that stops with an error if a single building has too many elements for memory."""

    def __init__(self, path, stream):
        self._path, self._stream, self.tags = path, stream, 0

    def read(self, size=-1):
        data = self._stream.read(size)
        self.tags += data.count(b"<")
        if self.tags > MOST_TAGS:
            problem = f"more than {MOST_TAGS:,} tags before the end of a building"
            raise InputError(self._path, problem, "remove what is not a building, or split the building")
        return data


def _forget(element):
    element.clear(keep_tail=False)
    parent = element.getparent()
    while element.getprevious() is not None:
        del parent[0]


def _syntax_error(path, error):
    message = re.sub(r"\s+", " ", (error.msg or "not well formed").split(", line ")[0])
    message = textwrap.shorten(message.replace(", try XML_PARSE_HUGE", ""), LONGEST_MESSAGE, placeholder=" …")
    line = error.lineno or 1
    prefix = re.match(r"Namespace prefix (\S+)", message)
    if error.code == etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE and prefix:
        return UndeclaredPrefixError(path, line, prefix.group(1))
    if "ntity" in message and ("loop" in message or "mplification" in message or "ndeclared" in message):
        return InputError(path, f"line {line}: entities are not accepted ({message})", "write the text out in full")
    if "Resource limit" in message or "too long" in message or "xcessive depth" in message:
        return InputError(path, f"line {line}: too much text or nested too deeply ({message})", CUT)
    if line == 1 and "Start tag expected" in message:
        return InputError(path, "line 1: this is not XML", "give a CityGML file")
    return InputError(path, f"line {line}: invalid XML ({message})", CUT)
