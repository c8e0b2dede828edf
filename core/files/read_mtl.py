"""Read the material libraries of an OBJ file: only the diffuse colour of each material.

Libraries are optional: problems with one become notes, and its colours stay unknown.
"""

import re
from pathlib import Path

from ..settings.errors import InputError
from .limits import clean_name
from .open_input import open_input

LARGEST = 2**24  # bytes of a decompressed library; a material takes some hundred
MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
ELSEWHERE = re.compile(r"[/\\:\0]")  # characters that lead to another folder or device
SHORT = 60  # characters of a name in a note
MOST_LIBRARIES = 16  # per OBJ file; one is usual


def read_libraries(path, statements, notes):
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
        for name in name_libraries(folder, text):
            lines.setdefault(name, line)
    if len(lines) > MOST_LIBRARIES:
        notes.append(f"{path} names {len(lines)} files with mtllib; only the first {MOST_LIBRARIES} were read.")
    colours = {}
    for name, line in list(lines.items())[:MOST_LIBRARIES]:
        library, refusal = find_library(folder, name)
        try:
            found = read_mtl(library, notes) if library else {}
        except InputError as error:
            found, refusal = {}, error.problem
        if refusal:
            words = f"{path}, line {line}: mtllib {clean_name(name)[:SHORT]}: {refusal}"
            notes.append(f"{words}; its materials get no colours.")
        colours = found | colours  # the first definition of a material counts
    return colours


def name_libraries(folder, text):
    """File names in a statement: all of it if there is such a file (names may contain spaces), else each word."""
    return [text] if find_library(folder, text)[0] else text.split() or [""]


def find_library(folder, name):
    """Path of a file in a folder, or None and the reason."""
    name = name.removeprefix("./")
    if not name:
        return None, "no file name given"
    if ELSEWHERE.search(name) or name in (".", ".."):
        return None, "only files in the folder of the OBJ file are read"
    try:
        found = (folder / name).is_file()
    except (OSError, ValueError):  # not a valid file name on this system
        found = False
    return (folder / name, "") if found else (None, "no such file in the folder of the OBJ file")


def read_mtl(path, notes):
    """Diffuse colours of one library: dict of name to (3,) tuple of float or None, as in `read_libraries`.

    Raises
    ------
    InputError
        The file cannot be read, or is too large.
    """
    with open_input(path) as stream:
        data = stream.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise InputError(path, f"larger than {LARGEST // 2**20} MiB", "give a smaller library")
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
        words = f"{path}: {len(wrong)} materials have an invalid Kd (not a colour from 0 to 1) and get no colour"
        notes.append(f"{words}: {name[:SHORT]!r}, line {line}{' …' if len(wrong) > 1 else '.'}")
    return {name: None if name in textured else colour for name, colour in colours.items() if name}


def read_colour(words):
    """Three numbers from 0 to 1, or one for all three; None for anything else, such as CIE XYZ and spectra."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    values = values * 3 if len(values) == 1 else values
    return tuple(values) if len(values) == 3 and all(0 <= value <= 1 for value in values) else None
