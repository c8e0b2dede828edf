"""Read the material libraries that an OBJ file names: the diffuse colour of each material, and nothing else.

A library is an addition, never a condition: what is wrong with it becomes a note, and its colours stay unknown.
"""

import re
from pathlib import Path

from ..errors import InputError
from .limits import clean_name
from .open_input import open_input

LARGEST = 2**24  # bytes of a library, unpacked; a material takes some hundred
MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
ELSEWHERE = re.compile(r"[/\\:\0]")  # in a name, leads to another folder or device
SHORT = 60  # characters of a name in a note
MOST_LIBRARIES = 16  # of one OBJ file; one is usual


def read_libraries(path, statements, notes):
    """Diffuse colours of the materials of an OBJ file.

    Parameters
    ----------
    path : path-like
        The OBJ file. Its libraries are looked for beside it, and nowhere else.
    statements : list of (int, str)
        Line and text of each ``mtllib``.
    notes : list of str
        Grows by what could not be read.

    Returns
    -------
    dict of str to (3,) tuple of float, or None
        Linear light from 0 to 1 by the name of the material; None where no colour or a texture is told.
    """
    folder, lines = Path(path).parent, {}
    for line, text in statements:
        for name in name_libraries(folder, text):
            lines.setdefault(name, line)
    if len(lines) > MOST_LIBRARIES:
        notes.append(f"{path} names {len(lines)} files with mtllib; the first {MOST_LIBRARIES} were looked at.")
    colours = {}
    for name, line in list(lines.items())[:MOST_LIBRARIES]:
        library, refusal = find_library(folder, name)
        try:
            found = read_mtl(library, notes) if library else {}
        except InputError as error:
            found, refusal = {}, error.problem
        if refusal:
            words = f"{path}, line {line}: mtllib {clean_name(name)[:SHORT]}: {refusal}"
            notes.append(f"{words}; its materials have no colours.")
        colours = found | colours  # the first that tells of a material counts
    return colours


def name_libraries(folder, text):
    """Names in a statement: all of it where such a file is there, as names may hold blanks; else each word."""
    return [text] if find_library(folder, text)[0] else text.split() or [""]


def find_library(folder, name):
    """The file of that name in a folder, or None and why not."""
    name = name.removeprefix("./")
    if not name:
        return None, "it names no file"
    if ELSEWHERE.search(name) or name in (".", ".."):
        return None, "only a file beside the OBJ file is read"
    try:
        found = (folder / name).is_file()
    except (OSError, ValueError):  # a name that the system does not take
        found = False
    return (folder / name, "") if found else (None, "there is no such file beside it")


def read_mtl(path, notes):
    """Diffuse colours of one library: dict of name to (3,) tuple of float or None, as of `read_libraries`.

    Raises
    ------
    InputError
        It cannot be read, or is larger than any library.
    """
    with open_input(path) as stream:
        data = stream.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise InputError(path, f"larger than {LARGEST // 2**20} MiB", "give a smaller one")
    text = data.decode(MARKS.get(data[:2], "utf-8-sig"), errors="replace")
    colours, textured, wrong, name = {}, set(), {}, None
    for line, row in enumerate(text.split("\n"), start=1):
        keyword, *words = row.split() or [""]
        if keyword == "newmtl":
            name = clean_name(" ".join(words))
            colours.setdefault(name, None)
        elif keyword == "map_Kd":
            textured.add(name)
        elif keyword == "Kd" and name is not None:
            colours[name] = read_colour(words)
            if colours[name] is None:
                wrong.setdefault(name, line)
    if wrong:
        name, line = next(iter(wrong.items()))
        words = f"{path}: {len(wrong)} materials have a Kd that is no colour from 0 to 1, and stay without"
        notes.append(f"{words}: {name[:SHORT]!r}, line {line}{' …' if len(wrong) > 1 else '.'}")
    return {name: None if name in textured else colour for name, colour in colours.items() if name}


def read_colour(words):
    """Three numbers from 0 to 1, or one that stands for all; None for anything else, as CIE XYZ and spectra."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    values = values * 3 if len(values) == 1 else values
    return tuple(values) if len(values) == 3 and all(0 <= value <= 1 for value in values) else None
