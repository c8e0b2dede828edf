"""Parse an OBJ file: vertices, polygons with any number of corners, and the object, group and
material of each.

Of its material libraries only the diffuse colours are read. Libraries are optional: problems with
one become notes, and its colours stay unknown.
"""

import codecs
import io
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..settings.errors import InputError
from ..settings.progress import silent
from .open_input import CUT, LARGEST_COORDINATE, Budget, clean_name, open_input

ELSEWHERE = re.compile(r"[/\\:\0]")  # characters that lead to another folder or device
SHORT = 60  # characters of a name in a note
FREE_FORMS = {"l", "p", "curv", "curv2", "surf", "call", "csh"}
SILENT = {"", "vn", "vt", "vp", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "usemap"}


@dataclass
class _ObjParts:
    """Contents of an OBJ file, in input order. `faces` are its `f` statements."""

    vertices: np.ndarray  # (v, 3) float64, z up
    faces: list = field(default_factory=list)  # of (k,) int64 into vertices
    lines: list = field(default_factory=list)  # of each face
    # of each face: number of its `o` statement, 0 before the first
    objects: list = field(default_factory=list)
    # of each face: name of its `g` statement, "" if none
    groups: list = field(default_factory=list)
    # of each face: name of its `usemtl` statement, "" if none
    materials: list = field(default_factory=list)
    object_names: list = field(default_factory=list)
    libraries: list = field(default_factory=list)  # (line, text) of each `mtllib` statement
    unnamed: int = 0  # `usemtl` statements without a name
    left_out: dict = field(default_factory=dict)  # keyword -> number of lines
    comment_crs: str = ""  # a comment line that mentions EPSG


def parse_obj(path, up="z", report_share=silent, *, face_bytes=400):
    """Read the statements of an OBJ file.

    Parameters
    ----------
    path : path-like
        Plain or gzip-compressed; UTF-8, UTF-16 or another text encoding.
    up : {'z', 'y'}
        Vertical axis of the file. With y, north is -z.
    report_share : callable, optional
        As in `open_input`.

    Returns
    -------
    ObjParts

    Raises
    ------
    InputError
        Not text, a line that cannot be parsed, a coordinate that is not finite, a vertex index out
        of range, or a mesh that takes more memory than is free.
    """
    parts, vertices, faces = _ObjParts(np.empty((0, 3)), object_names=[""]), [], []
    number, group, material = 0, "", ""
    budget = Budget(path, "holds a mesh", "split it into tiles, and give them all")
    # A statement at a time: vertices, faces with the names that hold for them, names of objects,
    # groups and materials; the first comment about EPSG is kept, and what has no place is counted.
    for line, words in _statements(path, report_share):
        keyword = words[0]
        if keyword == "v":
            # Python takes at most 200 bytes for a vertex.
            budget.spend(200)
            vertices.append(_vertex(path, line, words))
        elif keyword == "f":
            # Python takes at most 400 bytes for a face, and 50 more for a corner.
            budget.spend(face_bytes + 50 * len(words))
            faces.append(_corners(path, line, words, len(vertices)))
            parts.lines.append(line)
            parts.objects.append(number)
            parts.groups.append(group)
            parts.materials.append(material)
        elif keyword == "o":
            budget.spend(face_bytes)
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
    # Upright axis z; then corners are checked, as a face may come before its vertices.
    parts.vertices = turn_up(np.array(vertices, float).reshape(-1, 3), up)
    for face, line in zip(faces, parts.lines, strict=True):
        if face and max(face) >= len(vertices):
            raise InputError(
                path,
                f"line {line}: polygon refers to vertex {max(face) + 1}, the file has "
                f"{len(vertices)}",
                CUT,
            )
    parts.faces = [np.array(face, np.int64) for face in faces]
    return parts


def turn_up(points, up):
    """Points, (v, 3), of a file whose y axis points up, or z: with z up. With y, north is -z."""
    return points if up == "z" else points[:, [0, 2, 1]] * [1.0, -1.0, 1.0]


def _statements(path, report_share, *, longest_line=2**20):
    """Line number and words of every statement of an OBJ file.

    A trailing backslash continues on the next line: the number is of the last one. Lines that are
    too long, or hold a zero byte, are refused.
    """
    with open_input(path, report_share) as stream:
        # UTF-8, or UTF-16 where its first bytes say so.
        start = stream.peek(2)[:2] if hasattr(stream, "peek") else b""
        text = io.TextIOWrapper(
            stream,
            dict.fromkeys((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE), "utf-16").get(
                start, "utf-8-sig"
            ),
            errors="replace",
        )
        number, pending, length = 0, [], 0
        for raw in iter(lambda: text.readline(longest_line), ""):
            number += 1
            length += len(raw)
            if length >= longest_line:
                raise InputError(
                    path, f"line {number}: longer than {longest_line:,} characters", CUT
                )
            if "\0" in raw:
                raise InputError(path, f"line {number}: this is not text", "give an OBJ file")
            # A backslash at the end: the words wait for the next line.
            words = raw.split()
            if words and words[-1].endswith("\\"):
                pending += [*words[:-1], words[-1][:-1]]
                continue
            words = [word for word in (*pending, *words) if word]
            pending, length = [], 0
            if words:
                yield number, words
        if any(pending):
            yield number, [word for word in pending if word]


def _vertex(path, line, words):
    try:
        values = [float(word) for word in words[1:4]]
    except ValueError:
        values = []
    if len(values) != 3 or not all(
        abs(value) <= LARGEST_COORDINATE for value in values
    ):  # also true for NaN
        raise InputError(
            path,
            f"line {line}: vertex without three numbers of at most {LARGEST_COORDINATE:g}",
            "correct or remove this vertex",
        )
    return values


def _corners(path, line, words, count):
    """Vertex indices of an `f` statement from 0; negative indices in the file count back from the
    latest vertex.
    """
    try:
        corners = [int(word.partition("/")[0]) for word in words[1:]]
    except ValueError:
        raise InputError(
            path, f"line {line}: polygon with vertex indices that are not integers", CUT
        ) from None
    if 0 in corners or any(corner < -count for corner in corners):
        raise InputError(
            path, f"line {line}: polygon with a vertex index before the first vertex", CUT
        )
    return [corner - 1 if corner > 0 else count + corner for corner in corners]


def read_libraries(path, statements, notes, *, most_libraries=16):
    """Diffuse colours of the materials of an OBJ file.

    Parameters
    ----------
    path : path-like
        The OBJ file. Its libraries must lie in the same folder.
    statements : list of (int, str)
        Line and text of each ``mtllib``.
    notes : list of str
        Problems are appended.

    Returns
    -------
    dict of str to (3,) tuple of float, or None
        Material name -> linear RGB from 0 to 1; None if it has no colour, or a texture.
    """
    folder, lines = Path(path).parent, {}
    for line, text in statements:
        # All of it if there is such a file (names may contain spaces), else each word.
        for name in [text] if _find_library(folder, text)[0] else text.split() or [""]:
            lines.setdefault(name, line)
    # `most_libraries`: per OBJ file; one is usual.
    if len(lines) > most_libraries:
        notes.append(
            f"{path} names {len(lines)} files with mtllib; only the first {most_libraries} were "
            "read."
        )
    colours = {}
    for name, line in list(lines.items())[:most_libraries]:
        library, refusal = _find_library(folder, name)
        try:
            colours_of_library = _read_mtl(library, notes) if library else {}
        except InputError as error:
            colours_of_library, refusal = {}, error.problem
        if refusal:
            words = f"{path}, line {line}: mtllib {clean_name(name)[:SHORT]}: {refusal}"
            notes.append(f"{words}; its materials get no colours.")
        colours = colours_of_library | colours  # the first definition of a material counts
    return colours


def _find_library(folder, name):
    """Path of a file in a folder, or None and the reason."""
    name = name.removeprefix("./")
    if not name:
        return None, "no file name given"
    if ELSEWHERE.search(name) or name in (".", ".."):
        return None, "only files in the folder of the OBJ file are read"
    try:
        is_there = (folder / name).is_file()
    except (OSError, ValueError):  # not a valid file name on this system
        is_there = False
    return (folder / name, "") if is_there else (None, "no such file in the folder of the OBJ file")


def _read_mtl(path, notes):
    """Diffuse colours of one library: dict of name to (3,) tuple of float or None, as in
    `read_libraries`.

    Raises
    ------
    InputError
        The file cannot be read, or is not text.
    """
    colours, textured, wrong, name = {}, set(), {}, None
    for line, (keyword, *words) in _statements(path, silent):
        if keyword == "newmtl":
            name = clean_name(" ".join(words))
            colours.setdefault(name, None)
        elif keyword == "map_Kd":
            textured.add(name)
        elif keyword == "Kd" and name is not None:
            colours[name] = _read_colour(words)
            if colours[name] is None:
                wrong.setdefault(name, line)
    if wrong:
        name, line = next(iter(wrong.items()))
        words = (
            f"{path}: {len(wrong)} materials have an invalid Kd (not a colour from 0 to 1) and get "
            "no colour"
        )
        notes.append(f"{words}: {name[:SHORT]!r}, line {line}{' …' if len(wrong) > 1 else '.'}")
    return {name: None if name in textured else colour for name, colour in colours.items() if name}


def _read_colour(words):
    """Three numbers from 0 to 1, or one for all three; None for anything else, such as CIE XYZ and
    spectra.
    """
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    values = values * 3 if len(values) == 1 else values
    return tuple(values) if len(values) == 3 and all(0 <= value <= 1 for value in values) else None
