"""Read one or more JSON texts from a file with bounded memory; errors give line and column."""

import gc
import itertools
import json
import re
from contextlib import contextmanager
from pathlib import Path

from ..settings.errors import InputError
from ..settings.progress import ignore_share
from .open_input import open_input

CUT = "the file is truncated or damaged: download or export it again"
CHUNK = 2**22  # bytes
# [bytes] upper bound of Python's memory for an item, a list and an object.
WEIGHTS = ((b",", 32), (b"[", 64), (b"{", 200))
TEXT_WEIGHT = 2
FREE_MEMORY = 3 * 2**28  # [bytes]
MOST_GAIN = 64  # bytes of memory per byte of the file; a city model takes 12
MOST_BLANK = 100_000  # lines
READ = 0.2  # share of the time spent reading and decoding one text
TOKENS = re.compile(r'"(?:[^"\\]|\\.)*"?|NaN|-?Infinity', re.DOTALL)
WORDS = [b"CityJSON", *("CityJSON".encode(encoding) for encoding in ("utf-16-le", "utf-16-be"))]
SPACE = re.compile(r"[ \t\n\r\x1e]*")


class Repeated(dict):
    """A JSON object with duplicate names; the last value counts."""

    names = ()


class _Pace:
    """Scale progress: reading takes only a part of the time, the rest goes into building polygons."""

    def __init__(self, report_share):
        self._report_share, self.part = report_share, READ

    def __call__(self, share):
        self._report_share(self.part * share)


class _NoNumberError(ValueError):
    """NaN or Infinity, which JSON does not allow."""


@contextmanager
def _uncollected():
    """Pause cyclic garbage collection while a tree without cycles grows: it takes a third of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _to_object(pairs):
    """A dict that records its duplicate names."""
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    repeated, seen = Repeated(found), set()
    repeated.names = tuple(dict.fromkeys(name for name, _ in pairs if name in seen or seen.add(name)))
    return repeated


def _refuse_constant(name):
    raise _NoNumberError(name)


DECODER = json.JSONDecoder(object_pairs_hook=_to_object, parse_constant=_refuse_constant)


def iterate_json(path, notes, report_share=ignore_share):
    """Yield each JSON text of a file and the line it begins on.

    A file with one text per line is read line by line; any other is read into memory as a whole.

    Parameters
    ----------
    path : path-like
        Plain or gzip-compressed; UTF-8, UTF-16 or UTF-32.
    notes : list of str
        A note is appended if bytes had to be replaced.
    report_share : callable, optional
        As in `open_input`; for a file of one text it ends at `READ`, and the caller continues from there.

    Yields
    ------
    value : dict, list, …
    line : int

    Raises
    ------
    InputError
        Not JSON, truncated, nested too deeply, contains NaN, or too large for memory.
    """
    pace = _Pace(report_share)
    with open_input(path, pace) as stream:
        budget = FREE_MEMORY + MOST_GAIN * Path(path).stat().st_size
        first = _read_line(path, stream, budget)
        encoding = json.detect_encoding(first[:4])
        found = _decode_alone(path, first, notes) if encoding.startswith("utf-8") else None
        if found is None:
            yield from _iterate_texts(path, _read_text(path, stream, budget, first, notes))
            return
        yield found, 1
        pace.part = 1.0  # line by line: what is read is also processed
        yield from _iterate_lines(path, stream, budget, notes)


def speaks_of_cityjson(path):
    """Whether the word CityJSON occurs in a file; also true if it cannot be opened, so that the reader reports why."""
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


def _iterate_lines(path, stream, budget, notes):
    """Yield the JSON texts of all lines but the first, and their numbers."""
    blank = 0
    for number in itertools.count(2):
        line = _read_line(path, stream, budget)
        if not line:
            return
        if line.isspace():
            blank += 1
            if blank > MOST_BLANK:
                raise InputError(path, f"line {number}: more than {MOST_BLANK:,} blank lines", CUT)
        else:
            yield from _iterate_texts(path, _decode(path, line, "utf-8", notes), number)


def _decode_alone(path, line, notes):
    """The JSON text on the first line, or None if that line is not exactly one text."""
    try:
        text = _decode(path, line, "utf-8", []).strip()
        with _uncollected():
            value = DECODER.decode(text) if text.endswith("}") else None
    except (ValueError, RecursionError):
        return None  # reported with line and column when the whole file is read
    if value is not None:
        _decode(path, line, "utf-8", notes)
    return value


def _read_line(path, stream, budget):
    """The next line as bytes; an error if it is too large for memory."""
    pieces = []
    for piece in iter(lambda: stream.readline(CHUNK), b""):
        pieces.append(piece)
        budget = _pay(path, budget, piece)
        if piece.endswith(b"\n"):
            break
    return b"".join(pieces)


def _read_text(path, stream, budget, first, notes):
    """The whole text of a file whose first line was already read."""
    pieces, budget = [first], _pay(path, budget, first)
    for piece in iter(lambda: stream.read(CHUNK), b""):
        pieces.append(piece)
        budget = _pay(path, budget, piece)
    data = b"".join(pieces)
    pieces.clear()
    return _decode(path, data, json.detect_encoding(data[:4]), notes)


def _pay(path, budget, piece):
    budget -= TEXT_WEIGHT * len(piece) + sum(weight * piece.count(sign) for sign, weight in WEIGHTS)
    if budget < 0:
        cure = "split it into tiles, or write it as CityJSONSeq, which is read line by line"
        raise InputError(path, "one JSON text that is too large for memory", cure)
    return budget


def _decode(path, data, encoding, notes):
    try:
        return data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        if not encoding.startswith("utf-8"):
            raise InputError(path, f"byte {error.start}: not valid {encoding} text", "save it as UTF-8") from error
        words = f"{path} contains bytes that are not UTF-8; they were read as \ufffd."
        if words not in notes:
            notes.append(words)
        return data.decode("utf-8", errors="replace").removeprefix("\ufeff")


def _iterate_texts(path, text, first_line=1):
    """Yield the JSON texts in a string, with the line in the file where each begins."""
    place, line = SPACE.match(text).end(), first_line
    line += text.count("\n", 0, place)
    if place == len(text) and first_line == 1:
        raise InputError(path, "line 1: nothing but whitespace", CUT)
    while place < len(text):
        try:
            with _uncollected():
                value, end = DECODER.raw_decode(text, place)
        except _NoNumberError as error:
            found = next(token for token in TOKENS.finditer(text, place) if token.group()[0] != '"')
            row = line + text.count("\n", place, found.start())
            raise InputError(
                path, f"line {row}: {error} is not a number", "correct or remove the object it belongs to"
            ) from None
        except json.JSONDecodeError as error:
            raise _syntax_error(path, text, error, first_line) from None
        except RecursionError:
            raise InputError(path, f"line {line}: lists nested too deeply", CUT) from None
        except ValueError:  # Python limits integers to some thousand digits
            raise InputError(path, f"line {line}: a number with thousands of digits", CUT) from None
        yield value, line
        following = SPACE.match(text, end).end()
        line += text.count("\n", place, following)
        place = following


def _syntax_error(path, text, error, first_line):
    line = first_line + error.lineno - 1
    if not text[:64].lstrip().startswith(("{", "[")):
        return InputError(path, f"line {line}, column {error.colno}: this is not JSON", "give a CityJSON file")
    return InputError(path, f"line {line}, column {error.colno}: invalid JSON ({error.msg})", CUT)
