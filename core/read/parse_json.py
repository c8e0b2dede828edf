"""Read one or more JSON texts from a file with bounded memory; errors give line and column."""

import itertools
import json
import re

from ..settings.errors import InputError
from ..settings.progress import silent
from .open_input import CUT, Budget, open_input

CHUNK = 2**22  # bytes
READ = 0.2  # share of the time spent reading and decoding one text
WORDS = [b"CityJSON", *("CityJSON".encode(encoding) for encoding in ("utf-16-le", "utf-16-be"))]
SPACE = re.compile(r"[ \t\n\r\x1e]*")


class _Repeated(dict):
    """A JSON object with duplicate names; the last value counts."""

    names = ()


def _to_object(pairs):
    """A dict that records its duplicate names."""
    members = dict(pairs)
    if len(members) < len(pairs):
        members, seen = _Repeated(members), set()
        members.names = tuple(
            dict.fromkeys(name for name, _ in pairs if name in seen or seen.add(name))
        )
    return members


DECODER = json.JSONDecoder(object_pairs_hook=_to_object)


def iterate_json(path, notes, report_share=silent):
    """Yield each JSON text of a file and the line it begins on.

    A file with one text per line is read line by line; any other is read into memory as a whole.

    Parameters
    ----------
    path : path-like
        Plain or gzip-compressed; UTF-8, UTF-16 or UTF-32.
    notes : list of str
        A note is appended if bytes had to be replaced.
    report_share : callable, optional
        As in `open_input`; for a file of one text it ends at `READ`, and the caller continues from
        there.

    Yields
    ------
    value : dict, list, …
        NaN and Infinity, which JSON does not allow, are read as such.
    line : int

    Raises
    ------
    InputError
        Not JSON, truncated, nested too deeply, or too large for memory.
    """
    part = READ
    with open_input(path, lambda share: report_share(part * share)) as stream:
        first = _read(path, stream, lines=True)
        # The text on the first line, if that line is exactly one text.
        text = (
            _decode(path, first, notes).strip()
            if json.detect_encoding(first[:4]).startswith("utf-8")
            else ""
        )
        try:
            alone = DECODER.decode(text) if text.endswith("}") else None
        except (ValueError, RecursionError):
            alone = None  # told with line and column when the whole file is read
        if alone is None:
            yield from _iterate_texts(path, _decode(path, _read(path, stream, before=first), notes))
            return
        yield alone, 1
        part = 1.0  # line by line: what is read is also processed
        for number in itertools.count(2):
            line = _read(path, stream, lines=True)
            if not line:
                return
            yield from _iterate_texts(path, _decode(path, line, notes), number)


def speaks_of_cityjson(path):
    """Whether the word CityJSON occurs in a file; also true if it cannot be opened, so that the
    reader reports why.
    """
    before = b""
    try:
        with open_input(path) as stream:
            for piece in iter(lambda: stream.read(CHUNK), b""):
                if any(word in before + piece for word in WORDS):
                    return True
                before = piece[-64:]
    except InputError:
        return True
    return False


def _read(path, stream, before=b"", lines=False):
    """What was read before and the rest of a stream, or of its line; an error if it is too large
    for memory.
    """
    cure = "split it into tiles, or write it as CityJSONSeq, which is read line by line"
    budget, pieces = Budget(path, "holds a JSON text", cure), [before]
    read = stream.readline if lines else stream.read
    while pieces[-1] or len(pieces) == 1:
        # Python takes at most two bytes for a character, and more for an item, a list and an
        # object.
        budget.spend(
            2 * len(pieces[-1])
            + sum(
                weight * pieces[-1].count(sign)
                for sign, weight in ((b",", 32), (b"[", 64), (b"{", 200))
            )
        )
        if lines and pieces[-1].endswith(b"\n"):
            break
        pieces.append(read(CHUNK))
    return b"".join(pieces)


def _decode(path, data, notes):
    encoding = json.detect_encoding(data[:4])
    try:
        return data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        if not encoding.startswith("utf-8"):
            raise InputError(
                path, f"byte {error.start}: not valid {encoding} text", "save it as UTF-8"
            ) from error
        notes.append(f"{path} contains bytes that are not UTF-8; they were read as \ufffd.")
        return data.decode("utf-8", errors="replace").removeprefix("\ufeff")


def _iterate_texts(path, text, line=1):
    """Yield the JSON texts in a string, with the line in the file where each begins."""
    place = SPACE.match(text).end()
    if place == len(text) and line == 1:
        raise InputError(path, "line 1: nothing but whitespace", CUT)
    line += text.count("\n", 0, place)
    while place < len(text):
        try:
            value, end = DECODER.raw_decode(text, place)
        except (ValueError, RecursionError) as error:
            raise _explain(path, text, (place, line), error) from None
        yield value, line
        following = SPACE.match(text, end).end()
        line += text.count("\n", place, following)
        place = following


def _explain(path, text, start, error):
    """InputError for an error of the decoder in the text that starts at (place, line)."""
    place, line = start
    if isinstance(error, json.JSONDecodeError):
        where = f"line {line + text.count(chr(10), place, error.pos)}, column {error.colno}"
        if not text[:64].lstrip().startswith(("{", "[")):
            return InputError(path, f"{where}: this is not JSON", "give a CityJSON file")
        return InputError(path, f"{where}: invalid JSON ({error.msg})", CUT)
    # Python limits the depth of lists, and integers to some thousand digits.
    problem = (
        "lists nested too deeply"
        if isinstance(error, RecursionError)
        else "a number with thousands of digits"
    )
    return InputError(path, f"line {line}: {problem}", CUT)
