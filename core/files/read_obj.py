"""Read OBJ: faces as they are drawn, objects or groups as buildings, else what hangs together."""

from collections import Counter

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..city.polygon import FileContent, Polygon
from ..errors import InputError
from ..progress import untold
from .parse_obj import parse_obj
from .read_mtl import SHORT, read_libraries

WELD = 1e-3  # [units of the file] corners this close to each other are one
TOUCH = 1e-2  # [units of the file] seen from above, a piece this close to a face lies on it
MOST_NAMED = 5  # in a note
PARSED = 0.5  # share of the time that goes into the statements
FACES_AT_ONCE = 4096  # between two reports
ABOVE = 0.5  # share of a piece's faces that lie above or below another piece of the same building


def read_obj(path, up="z", tell=untold):
    """Every face of an OBJ file, before any choice.

    Each ``o`` is a building. Where there is none, each name of ``g`` is one; where there is none of either, faces
    that share corners are one, together with what stands on them. ``usemtl`` names the material of the faces that
    follow; colours are those of the library beside the file.

    Parameters
    ----------
    path : path-like
    up : {'z', 'y'}
        Axis that points to the sky. With y, north is -z.
    tell : callable, optional
        As of `open_input`, with the share of the work.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        The file cannot be read, or has no faces.
    """
    parts = parse_obj(path, lambda share: tell(PARSED * share))
    if not parts.faces:
        raise InputError(path, "no faces in it", "give an OBJ file of buildings")
    vertices = parts.vertices if up == "z" else parts.vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    content = FileContent(path)
    building = _buildings(parts, vertices, content)
    rows = zip(parts.faces, parts.lines, building, parts.materials, strict=True)
    for place, (face, line, number, material) in enumerate(rows):
        if place % FACES_AT_ONCE == 0:
            tell(PARSED + (1 - PARSED) * place / len(parts.faces))
        if len(face) < 3:
            content.skip("fewer than three points", f"line {line}")
        else:
            ring = _closed(vertices[face])
            polygon = Polygon("", int(number), 0, "", "", "surface", [ring], line, material=material)
            content.polygons.append(polygon)
    _note(parts, content)
    _colour(parts, content)
    return content


def _closed(ring):
    """A face is a ring that OBJ never closes; here it ends where it begins, so that none counts as mended."""
    return np.concatenate([ring, ring[:1]])


def _buildings(parts, vertices, content):
    """Building of each face (f,), and their names."""
    if len(parts.object_names) > 1:
        used, building = np.unique(parts.objects, return_inverse=True)
        content.buildings = _unique([parts.object_names[k] for k in used], content)
    elif any(parts.groups):
        number = {name: k for k, name in enumerate(dict.fromkeys(parts.groups))}
        building = np.array([number[name] for name in parts.groups])
        content.buildings = list(number)
    else:
        building = _pieces(parts.faces, vertices)
        content.buildings = [f"part_{k + 1}" for k in range(building.max() + 1)]
        content.notes.append(f"{content.path} names no objects: {len(content.buildings)} connected parts as buildings.")
    return building.reshape(-1)


def _unique(names, content):
    """Names of objects; one that comes again is another building, with a number added."""
    seen, unique = Counter(), []
    for name in names:
        seen[name] += 1
        unique.append(f"{name}~{seen[name]}" if name and seen[name] > 1 else name)
    again = [name for name, plain in zip(unique, names, strict=True) if name != plain]
    if again:
        content.notes.append(f"{len(again)} objects bear the name of an earlier one, number added: {again[0]} …")
    return unique


def _pieces(faces, vertices):
    """Faces that share corners, or that lie above one another: number of the piece of each face, (f,)."""
    _, place = np.unique(np.round(vertices / WELD).astype(np.int64), axis=0, return_inverse=True)
    count = np.array([len(face) for face in faces])
    owner = np.repeat(np.arange(len(faces)), count)
    corner = len(faces) + place.reshape(-1)[np.concatenate(faces).astype(np.int64)]
    piece = _components(owner, corner, len(faces) + len(vertices))[: len(faces)]
    full = count > 2
    if piece.max() == 0 or not full.any():
        return np.unique(piece, return_inverse=True)[1]
    below, above = _stacked([faces[k] for k in np.flatnonzero(full)], vertices, piece[full])
    joined = _components(below, above, piece.max() + 1)[piece]
    # Pieces are numbered in the order of the file.
    _, first, number = np.unique(joined, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[number.reshape(-1)]


def _components(one, other, size):
    graph = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(size, size))
    return connected_components(graph, directed=False)[1]


def _stacked(faces, vertices, piece):
    """Pairs of pieces of which one lies, seen from above, for the most part on the other."""
    shapes = np.array([shapely.Polygon(vertices[face, :2]) for face in faces], dtype=object)
    middles = shapely.points(np.array([vertices[face, :2].mean(axis=0) for face in faces]))
    tree = shapely.STRtree(shapely.make_valid(shapes))
    face, on = tree.query(middles, "dwithin", distance=TOUCH)
    other = piece[face] != piece[on]
    pairs = np.unique(np.column_stack([face, piece[on]])[other], axis=0)  # each face counts once per other piece
    pairs, faces_on = np.unique(np.column_stack([piece[pairs[:, 0]], pairs[:, 1]]), axis=0, return_counts=True)
    mostly = faces_on >= ABOVE * np.bincount(piece)[pairs[:, 0]]
    return pairs[mostly].T


def _note(parts, content):
    for keyword, count in sorted(parts.left_out.items()):
        content.notes.append(f"{count} lines {keyword} of {content.path} left out: no faces.")
    if parts.comment_crs:
        words = f"{content.path}, {parts.comment_crs} is a comment, and not believed"
        content.notes.append(f"{words}: give --latitude, --longitude and --unit.")


def _colour(parts, content):
    """Take the colours of the materials in use, and say what was found."""
    used = [name for name in dict.fromkeys(parts.materials) if name]
    if parts.unnamed:
        content.notes.append(f"{parts.unnamed} lines usemtl of {content.path} name no material: faces have none then.")
    if not used:
        return
    told = read_libraries(content.path, parts.libraries, content.notes)
    content.colours = {name: told.get(name) for name in used}
    faces = sum(map(bool, parts.materials))
    coloured = sum(colour is not None for colour in content.colours.values())
    names = ", ".join(name[:SHORT] for name in used[:MOST_NAMED]) + (" …" if len(used) > MOST_NAMED else "")
    words = f"{content.path} names {len(used)} materials for {faces} of {len(parts.faces)} faces: {names}"
    asked = "where --materials (in Blender Albedo from: Materials) asks for them"
    content.notes.append(f"{words}. {coloured} have a diffuse colour. Names and colours tell albedos {asked}.")
