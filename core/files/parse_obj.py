"""Parse an OBJ file: vertices, polygons with any number of corners, and the object, group and material of each."""

import codecs
import io
from dataclasses import dataclass, field

import numpy as np

from ..settings.errors import InputError
from ..settings.progress import ignore_share
from .limits import LARGEST_COORDINATE, clean_name
from .open_input import open_input

LONGEST_LINE = 2**20  # characters
MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
FREE_FORMS = {"l", "p", "curv", "curv2", "surf", "call", "csh"}
SILENT = {"", "vn", "vt", "vp", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "usemap"}
CUT = "the file is truncated or damaged: download or export it again"


@dataclass
class ObjParts:
    """Contents of an OBJ file, in input order. `faces` are its `f` statements."""

    vertices: np.ndarray  # (v, 3) float64, as in the file
    faces: list = field(default_factory=list)  # of (k,) int64 into vertices
    lines: list = field(default_factory=list)  # of each face
    objects: list = field(default_factory=list)  # of each face: number of its `o` statement, 0 before the first
    groups: list = field(default_factory=list)  # of each face: name of its `g` statement, "" if none
    materials: list = field(default_factory=list)  # of each face: name of its `usemtl` statement, "" if none
    object_names: list = field(default_factory=list)
    libraries: list = field(default_factory=list)  # (line, text) of each `mtllib` statement
    unnamed: int = 0  # `usemtl` statements without a name
    left_out: dict = field(default_factory=dict)  # keyword -> number of lines
    comment_crs: str = ""  # a comment line that mentions EPSG


def parse_obj(path, report_share=ignore_share):
    """Read the statements of an OBJ file.

    Parameters
    ----------
    path : path-like
        Plain or gzip-compressed; UTF-8, UTF-16 or another text encoding.
    report_share : callable, optional
        As in `open_input`.

    Returns
    -------
    ObjParts

    Raises
    ------
    InputError
        Not text, a line that cannot be parsed, a coordinate that is not finite, a vertex index out of range.
    """
    parts, vertices, faces = ObjParts(np.empty((0, 3)), object_names=[""]), [], []
    number, group, material = 0, "", ""
    for line, words in _statements(path, report_share):
        keyword = words[0]
        if keyword == "v":
            vertices.append(_vertex(path, line, words))
        elif keyword == "f":
            faces.append(_corners(path, line, words, len(vertices)))
            parts.lines.append(line)
            parts.objects.append(number)
            parts.groups.append(group)
            parts.materials.append(material)
        elif keyword == "o":
            parts.object_names.append(" ".join(words[1:]))
            number = len(parts.object_names) - 1
        elif keyword == "g":
            group = " ".join(words[1:])
        elif keyword == "usemtl":
            material = clean_name(" ".join(words[1:]))
            parts.unnamed += not material
        elif keyword == "mtllib":
            parts.libraries.append((line, " ".join(words[1:])))
        elif keyword[0] == "#":
            if "epsg" in " ".join(words).lower() and not parts.comment_crs:
                parts.comment_crs = f"line {line}: {' '.join(words)[:80]!r}"
        elif keyword in FREE_FORMS or keyword not in SILENT:
            known = keyword if keyword in FREE_FORMS else "(unknown)"
            parts.left_out[known] = parts.left_out.get(known, 0) + 1
    parts.vertices = np.array(vertices, float).reshape(-1, 3)
    parts.faces = _resolve(path, faces, parts.lines, len(vertices))
    return parts


def _statements(path, report_share):
    """Line number and words of every statement; a trailing backslash continues on the next line."""
    with open_input(path, report_share) as stream:
        start = stream.peek(2)[:2] if hasattr(stream, "peek") else b""
        text = io.TextIOWrapper(stream, MARKS.get(start, "utf-8-sig"), errors="replace")
        number, pending, length = 0, [], 0
        for raw in iter(lambda: text.readline(LONGEST_LINE), ""):
            number += 1
            length += len(raw)
            if length >= LONGEST_LINE:
                raise InputError(path, f"line {number}: longer than {LONGEST_LINE:,} characters", CUT)
            if "\0" in raw:
                raise InputError(path, f"line {number}: this is not text", "give an OBJ file")
            words = raw.split()
            if words and words[-1].endswith("\\"):
                pending += [*words[:-1], words[-1][:-1]]
                continue
            words = [word for word in (*pending, *words) if word]
            pending, length = [], 0
            if words:
                yield number, words


def _vertex(path, line, words):
    try:
        values = [float(word) for word in words[1:4]]
    except ValueError:
        values = []
    if len(values) != 3:
        raise InputError(path, f"line {line}: vertex without three numbers", CUT)
    if not all(abs(value) <= LARGEST_COORDINATE for value in values):  # also true for NaN
        problem = f"line {line}: a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        raise InputError(path, problem, "correct or remove this vertex")
    return values


def _corners(path, line, words, count):
    """Vertex indices of an `f` statement from 0; negative indices in the file count back from the latest vertex."""
    try:
        corners = [int(word.partition("/")[0]) for word in words[1:]]
    except ValueError:
        raise InputError(path, f"line {line}: polygon with vertex indices that are not integers", CUT) from None
    if 0 in corners or any(corner < -count for corner in corners):
        raise InputError(path, f"line {line}: polygon with a vertex index before the first vertex", CUT)
    return [corner - 1 if corner > 0 else count + corner for corner in corners]


def _resolve(path, faces, lines, count):
    for face, line in zip(faces, lines, strict=True):
        if face and max(face) >= count:
            problem = f"line {line}: polygon refers to vertex {max(face) + 1}, the file has {count}"
            raise InputError(path, problem, CUT)
    return [np.array(face, np.int64) for face in faces]
