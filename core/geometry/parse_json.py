"""JSON documents of a file, one after the other, whatever its encoding; what is no JSON is refused with its place."""

import io
import json

from ..errors import InputError
from .open_input import open_input

CUT = "the file is cut or damaged: get it again"


def iterate_documents(path):
    """Yield line and content of each JSON document of a file: one in all, or one in each line.

    Parameters
    ----------
    path : path-like
        Packed with gzip or not; UTF-8, UTF-16 or UTF-32.

    Yields
    ------
    line : int
    document : dict, list, …

    Raises
    ------
    InputError
        No text, no JSON, numbers that are none, or lists nested too deep.
    """
    with open_input(path) as stream:
        packed = io.BufferedReader(stream) if not hasattr(stream, "peek") else stream
        text = io.TextIOWrapper(packed, json.detect_encoding(packed.peek(4)[:4]), newline="\n")
        try:
            yield from _split(path, text)
        except UnicodeDecodeError as error:
            raise InputError(path, f"byte {error.start} of a piece is no text", CUT) from error


def _split(path, text):
    first, line = "", 0
    while not first.strip():
        first, line = text.readline(), line + 1
        if not first:
            raise InputError(path, f"line {line}: nothing but blanks", CUT)
    if not _is_whole(path, first, line):
        yield line, _parse(path, first + text.read(), line)
        return
    yield line, _parse(path, first, line)
    for number, row in enumerate(text, line + 1):
        if row.strip():
            yield number, _parse(path, row, number)


def _is_whole(path, row, line):
    """Whether a first line is a document of its own; the others then are, too."""
    try:
        _parse(path, row, line)
    except InputError:
        return False
    return True


def _parse(path, text, line):
    def refuse(word):
        raise InputError(path, f"line {line}: {word} is no number of JSON", "correct it")

    try:
        return json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        place = f"line {line + error.lineno - 1}, column {error.colno}"
        raise InputError(path, f"{place}: the JSON breaks off ({error.msg})", CUT) from error
    except RecursionError as error:
        raise InputError(path, f"line {line}: lists nested deeper than a city needs", CUT) from error
    except InputError:
        raise
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(path, f"line {line}: a number of too many digits", "correct it") from error
