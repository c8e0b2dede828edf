"""The one error a user can cause, input that cannot be used, how it and tables write numbers and
names, and checks of arrays that raise it.

Each error names the array, the row and the cure.
"""

import json
import math
import struct
import zipfile
import zlib
from contextlib import contextmanager


class InputError(ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    source : str or path-like
        The file (or option) that is at fault.
    problem : str
        What is wrong and where in it.
    cure : str
        What the user can do about it.
    """

    def __init__(self, source, problem, cure):
        super().__init__(show_signs(f"{source}: {problem}; {cure}"))
        self.source, self.problem, self.cure = str(source), problem, cure

    def __reduce__(self):
        return type(self), (self.source, self.problem, self.cure)

    @staticmethod
    @contextmanager
    def parsing(source, problem, cure):
        """What a parser raises on a damaged file becomes an InputError: for the call of a parser of
        a library, and no more.

        Around code of ours it would take a bug for damage: what that reads of a parsed file it
        checks, and names.

        Parameters
        ----------
        source, cure
            As of `InputError`.
        problem : str
            In front of the parser's own words.
        """
        try:
            yield
        except InputError:
            raise
        except (
            ValueError,
            LookupError,
            TypeError,
            AttributeError,
            ArithmeticError,
            RuntimeError,
            EOFError,
            OSError,
            MemoryError,
            struct.error,
            zipfile.BadZipFile,
            zlib.error,
        ) as error:
            raise InputError.blame(source, problem, error, cure) from error

    @staticmethod
    def blame(source, problem, error, cure):
        """InputError of a file from what was raised on it, in one line."""
        words = " ".join(str(error).replace(str(source), "it").split())[:160]
        return InputError(source, f"{problem} ({type(error).__name__}: {words})", cure)


def build_from(kind, values):
    """An object of a type from the values that a file holds for it, by name.

    Raises
    ------
    ValueError
        Names what is missing or unknown, as in files of another version.
    """
    from inspect import signature

    try:
        signature(kind).bind(**values)
    except TypeError as error:
        raise ValueError(f"{kind.__name__}: {error}") from error
    return kind(**values)


FORMULAS = ("=", "+", "-", "@")  # with which one begins in a spreadsheet


def show_signs(text):
    """Text whose control characters are written as in JSON, \\u001b: a terminal would act on them.
    Lines stay.
    """
    if text.isprintable():
        return text
    return "".join(
        sign if sign.isprintable() or sign == "\n" else json.dumps(sign)[1:-1] for sign in text
    )


def cell_of_id(name):
    """An id as a cell of a table: behind an apostrophe where a spreadsheet would take it for a
    formula to compute.
    """
    return "'" + name if name.lstrip("'")[:1] in FORMULAS and name else name


def id_of_cell(cell):
    """The id of a cell, as of `cell_of_id`; whoever writes a table need not know of the
    apostrophe.
    """
    return cell[1:] if cell[:1] == "'" and cell.lstrip("'")[:1] in FORMULAS else cell


def count_of(number, noun):
    """A number of things in words: 1 surface, 1,200 surfaces."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def show_number(value, digits, *, plus=False):
    """A number with commas between thousands and a true minus; never −0, nor +0 where `plus` is
    asked for.
    """
    value = round(float(value), digits) + 0.0  # −0 + 0 is 0
    return f"{'+' if plus and value > 0 else ''}{value:,.{digits}f}".replace("-", "−")


def show_end(name, most=15):
    """An id, of at most so many characters: those at its end tell one from another."""
    return name if len(name) <= most else f"…{name[1 - most :]}"


def list_some(names, most=3):
    """The first of some ids by their ends, and " …" where there are more."""
    return ", ".join(map(show_end, names[:most])) + (" …" if len(names) > most else "")


def first_true(mask):
    """Index of the first true element of a mask, (n,) bool; None if there is none."""
    import numpy as np

    places = np.flatnonzero(mask)
    return int(places[0]) if len(places) else None


LARGEST = 1e9  # [m] Embree works in float32, which cannot resolve a city beyond this
UNIT = 1e-3  # tolerance of the length of unit vectors
KINDS = {"f": ("fiu", "numbers"), "i": ("iu", "integers"), "b": ("b", "booleans")}


def check_array(name, values, shape, *, kind="f", least=-LARGEST, most=LARGEST, row="row"):
    """Raise an error if an array has the wrong shape or type, or a value that is not finite or out
    of range.

    Parameters
    ----------
    name : str
        Name of the array, for the message.
    values : array_like
    shape : tuple of int or str
        A string means any length.
    kind : {'f', 'i', 'b'}
        Numbers, integers or booleans.
    least, most : float
        Bounds, inclusive.
    row : str or callable
        Name of a row in the message; or `row(index)`, the words for one.

    Returns
    -------
    numpy.ndarray

    Raises
    ------
    InputError
    """
    import numpy as np

    values = np.asarray(values)
    words = f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
    fits = values.ndim == len(shape) and all(
        isinstance(wanted, str) or wanted == found
        for wanted, found in zip(shape, values.shape, strict=True)
    )
    if not fits:
        raise InputError(name, f"shape {values.shape}", f"give an array of shape {words}")
    kinds, noun = KINDS[kind]
    if values.dtype.kind not in kinds:
        raise InputError(name, f"values of type {values.dtype}", f"give {noun}")
    # Compared so that NaN fails too.
    if kind != "b" and values.size and not (values.min() >= least and values.max() <= most):
        first, *column = np.argwhere(~((values >= least) & (values <= most)))[0]
        words, whole = row(first) if callable(row) else f"{row} {first}", values[first]
        # Of a long row, the first value that is out of range.
        told = (
            f"is {whole}"
            if whole.size <= 4
            else f"holds {whole[tuple(column)]} in column {column[0]}"
        )
        raise InputError(name, f"{words} {told}", f"give finite {noun} from {least:g} to {most:g}")
    return values


def check_triangles(vertices, triangles):
    """Check vertices and triangles, since Embree does not.

    Parameters
    ----------
    vertices : (v, 3) float [m]
    triangles : (t, 3) int

    Returns
    -------
    vertices, triangles : numpy.ndarray
    """
    vertices = check_array("vertices", vertices, ("v", 3), row="vertex")
    triangles = check_array(
        "triangles", triangles, ("t", 3), kind="i", most=math.inf, least=-math.inf
    )
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        first = first_true(((triangles < 0) | (triangles >= len(vertices))).any(axis=1))
        raise InputError(
            "triangles",
            f"triangle {first} is {triangles[first]}, but there are {len(vertices)} vertices",
            "check the indices",
        )
    return vertices, triangles


def check_unit(name, values):
    """Raise an error if vectors are not of unit length.

    Parameters
    ----------
    name : str
    values : (n, 3) float
    """
    import numpy as np

    values = check_array(name, values, ("n", 3), least=-1 - UNIT, most=1 + UNIT)
    if (first := first_true(np.abs(np.linalg.norm(values, axis=1) - 1) > UNIT)) is not None:
        raise InputError(name, f"row {first} is {values[first]}", "give unit vectors")
    return values
