"""Read a file of one JSON text or of several, one after the other, with bounded memory and the place of each fault."""

import gc
import itertools
import json
import re
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError
from ..progress import untold
from .open_input import open_input

CUT = "the file is cut or damaged: get it again"
CHUNK = 2**22  # bytes
# [bytes] what Python keeps for an item, a list and an object, at most.
WEIGHTS = ((b",", 32), (b"[", 64), (b"{", 200))
TEXT_WEIGHT = 2
FREE_MEMORY = 3 * 2**28  # [bytes]
MOST_GAIN = 64  # bytes held per byte of the file; a city takes 12
MOST_BLANK = 100_000  # lines
READ = 0.2  # share of the time that one text takes to be read and decoded
TOKENS = re.compile(r'"(?:[^"\\]|\\.)*"?|NaN|-?Infinity', re.DOTALL)
WORDS = [b"CityJSON", *("CityJSON".encode(encoding) for encoding in ("utf-16-le", "utf-16-be"))]
SPACE = re.compile(r"[ \t\n\r\x1e]*")


class Repeated(dict):
    """An object that gives some of its names twice; the last one counts."""

    names = ()


class _Pace:
    """Tells of a part of what is read, as the rest of the time goes into what is made of it."""

    def __init__(self, tell):
        self._tell, self.part = tell, READ

    def __call__(self, share):
        self._tell(self.part * share)


class _NoNumberError(ValueError):
    """NaN or Infinity, which JSON does not know."""


@contextmanager
def _uncollected():
    """Let Python not look for circles in a tree that has none, again and again while it grows: a third of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _to_object(pairs):
    """A dict that remembers which of its names came twice."""
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    repeated, seen = Repeated(found), set()
    repeated.names = tuple(dict.fromkeys(name for name, _ in pairs if name in seen or seen.add(name)))
    return repeated


def _refuse_constant(name):
    raise _NoNumberError(name)


DECODER = json.JSONDecoder(object_pairs_hook=_to_object, parse_constant=_refuse_constant)


def iterate_json(path, notes, tell=untold):
    """Yield each JSON text of a file and the line it begins in.

    A file of one text a line is read line by line; of any other the whole text is taken into memory.

    Parameters
    ----------
    path : path-like
        Packed with gzip or not; UTF-8, UTF-16 or UTF-32.
    notes : list of str
        Grows where bytes had to be replaced.
    tell : callable, optional
        As of `open_input`; of a file of one text it ends at `READ`, and the caller may go on from there.

    Yields
    ------
    value : dict, list, …
    line : int

    Raises
    ------
    InputError
        No JSON, cut, nested too deeply, NaN in it, or more of it than memory should hold.
    """
    pace = _Pace(tell)
    with open_input(path, pace) as stream:
        budget = FREE_MEMORY + MOST_GAIN * Path(path).stat().st_size
        first = _read_line(path, stream, budget)
        encoding = json.detect_encoding(first[:4])
        found = _decode_alone(path, first, notes) if encoding.startswith("utf-8") else None
        if found is None:
            yield from _iterate_texts(path, _read_text(path, stream, budget, first, notes))
            return
        yield found, 1
        pace.part = 1.0  # by lines: what is read is done
        yield from _iterate_lines(path, stream, budget, notes)


def speaks_of_cityjson(path):
    """Whether the word CityJSON stands anywhere in a file; also true of one that cannot be opened, to be told later."""
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
    """The one JSON text that a first line holds, or None where it ends later or more follows in it."""
    try:
        text = _decode(path, line, "utf-8", []).strip()
        with _uncollected():
            value = DECODER.decode(text) if text.endswith("}") else None
    except (ValueError, RecursionError):
        return None  # told with its place when the whole file is read
    if value is not None:
        _decode(path, line, "utf-8", notes)
    return value


def _read_line(path, stream, budget):
    """The next line as bytes; refused where it is longer than memory should hold."""
    pieces = []
    for piece in iter(lambda: stream.readline(CHUNK), b""):
        pieces.append(piece)
        budget = _pay(path, budget, piece)
        if piece.endswith(b"\n"):
            break
    return b"".join(pieces)


def _read_text(path, stream, budget, first, notes):
    """All text of a file whose first line is in hand."""
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
        cure = "cut it into tiles, or write it as CityJSONSeq, which is read line by line"
        raise InputError(path, "more JSON in one piece than memory should hold", cure)
    return budget


def _decode(path, data, encoding, notes):
    try:
        return data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeDecodeError as error:
        if not encoding.startswith("utf-8"):
            raise InputError(path, f"byte {error.start}: this is no {encoding} text", "save it as UTF-8") from error
        words = f"{path} holds bytes that are not UTF-8; they were read as \ufffd."
        if words not in notes:
            notes.append(words)
        return data.decode("utf-8", errors="replace").removeprefix("\ufeff")


def _iterate_texts(path, text, first_line=1):
    """Yield the JSON texts in a string, with the line in the file where each begins."""
    place, line = SPACE.match(text).end(), first_line
    line += text.count("\n", 0, place)
    if place == len(text) and first_line == 1:
        raise InputError(path, "line 1: nothing but blanks", CUT)
    while place < len(text):
        try:
            with _uncollected():
                value, end = DECODER.raw_decode(text, place)
        except _NoNumberError as error:
            found = next(token for token in TOKENS.finditer(text, place) if token.group()[0] != '"')
            row = line + text.count("\n", place, found.start())
            raise InputError(path, f"line {row}: {error} is no number", "correct or remove what it stands in") from None
        except json.JSONDecodeError as error:
            raise _syntax_error(path, text, error, first_line) from None
        except RecursionError:
            raise InputError(path, f"line {line}: lists nested deeper than any city needs", CUT) from None
        except ValueError:  # Python reads no whole number of more than some thousand digits
            raise InputError(path, f"line {line}: a number of thousands of digits", CUT) from None
        yield value, line
        following = SPACE.match(text, end).end()
        line += text.count("\n", place, following)
        place = following


def _syntax_error(path, text, error, first_line):
    line = first_line + error.lineno - 1
    if not text[:64].lstrip().startswith(("{", "[")):
        return InputError(path, f"line {line}, column {error.colno}: this is not JSON", "give a CityJSON file")
    return InputError(path, f"line {line}, column {error.colno}: the JSON breaks off ({error.msg})", CUT)
