"""Read OBJ: objects or groups as buildings, or connected parts if the file has neither."""

import re

import numpy as np

from ..city.city import FileContent, Polygon, number_names
from ..city.connected_pieces import number_pieces
from ..city.polygons import measure_polygons
from ..settings.errors import InputError, list_some
from ..settings.progress import silent
from .parse_obj import parse_obj, read_libraries, turn_up

# Names that objects or their materials have where a file holds more than buildings, with the
# suffixes of 3dfier.
GROUND = (
    r"(?i)(terrain|tinrelief|relief|dtm|landuse|roads?|railway|water|waterbody|forest"
    r"|vegetation|plantcover)"
)
OTHERS = re.compile(GROUND + r"(wall|floor)?(?![a-z])")


def read_obj(path, up="z", report_share=silent, *, parsed=0.5):
    """Read all polygons (`f` statements) of an OBJ file.

    Each ``o`` is a building. Without any, each name of ``g`` is one; without either, or where one
    name holds all, polygons that share vertices form one, together with what stands on them, unless
    that is ground. ``usemtl`` names the material of the polygons that follow; colours come from the
    material library in the same folder.

    Parameters
    ----------
    path : path-like
    up : {'z', 'y', 'auto'}
        Vertical axis. With y, north is -z; auto: z, but where its floors lie across y.
    report_share : callable, optional
        As in `open_input`, with the share of the work done.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        The file cannot be read, or has no polygons.
    """
    # Statements first, then which way is up.
    # `parsed`: share of the time spent parsing statements.
    parts = parse_obj(path, "z" if up == "auto" else up, lambda share: report_share(parsed * share))
    if not parts.faces:
        raise InputError(path, "contains no polygons", "give an OBJ file of buildings")
    content = FileContent(path)
    if up == "auto":
        up, content.notes = _judge_up(parts.vertices, parts.faces)
        parts.vertices = turn_up(parts.vertices, up)
    content.up = up
    # Buildings by object, group, or by vertices that faces share.
    building = _buildings(parts, content)
    rows = zip(parts.faces, parts.lines, building, parts.materials, strict=True)
    for place, (face, line, number, material) in enumerate(rows):
        if place % 4096 == 0:
            report_share(parsed + (1 - parsed) * place / len(parts.faces))
        # Faces of fewer than three points are left out and reported.
        if len(face) < 3:
            content.skip("fewer than three points", f"line {line}")
        else:
            # OBJ never repeats the first point; an open ring would count as repaired.
            ring = parts.vertices[[*face, face[0]]]
            polygon = Polygon(
                "", int(number), 0, "", ("",), "surface", [ring], line, material=material
            )
            content.polygons.append(polygon)
    # What was left out, and what only a comment says, is told.
    for keyword, count in sorted(parts.left_out.items()):
        content.notes.append(f"{count} lines {keyword} of {path} left out: not polygons.")
    if parts.comment_crs:
        words = f"{path}, {parts.comment_crs} is only a comment and was not used"
        content.notes.append(f"{words}: give --latitude, --longitude and --unit.")
    # Objects that are no buildings by their names are noted, and colours of materials are read.
    _note_others(parts, building, content)
    _colour(parts, content)
    return content


def _buildings(parts, content):
    """Building of each polygon, (f,); names are stored in the content."""
    used, building = np.unique(parts.objects, return_inverse=True)
    groups = list(dict.fromkeys(parts.groups))
    if len(used) > 1:
        content.buildings = [parts.object_names[k] for k in used]
    elif len(parts.object_names) == 1 and len(groups) > 1:
        building, content.buildings = number_names(parts.groups), groups
    else:
        # One name for all, or none, tells nothing of a city: what hangs together is a building.
        name = parts.object_names[used[0]] or groups[0]
        building = number_pieces(parts.faces, parts.vertices)
        count = building.max() + 1
        content.buildings = (
            [f"{name or 'part'}_{k + 1}" for k in range(count)] if count > 1 or not name else [name]
        )
        if count > 1 or not name:
            why = f"one name, {name!r}, for all" if name else "no objects or groups"
            content.notes.append(
                f"{content.path} has {why}: {count} connected parts read as buildings."
            )
    return building.reshape(-1)


def _note_others(parts, building, content):
    """Note objects that are no buildings by all of their materials or, without any, by
    their name.
    """
    called = {}
    for number, material in zip(building.tolist(), parts.materials, strict=True):
        called.setdefault(number, {}).setdefault(material)
    called = {
        number: [name or content.buildings[number] for name in names]
        for number, names in called.items()
    }
    others = {number: names for number, names in called.items() if all(map(OTHERS.match, names))}
    if not others or len(others) == len(called):
        return
    named = list_some(list(dict.fromkeys(name for other in others.values() for name in other)), 5)
    words = (
        f"{len(others)} of {len(called)} objects of {content.path} are no buildings by their names "
        f"({named})"
    )
    cure = "Remove them, or give terrain in a file of its own with --terrain."
    content.notes.append(
        f"{words}, but read as such: their level faces count as flat roofs. {cure}"
    )


def _colour(parts, content):
    """Read the colours of the materials in use, and note what was found."""
    used = [name for name in dict.fromkeys(parts.materials) if name]
    if parts.unnamed:
        words = f"{parts.unnamed} usemtl lines of {content.path} name no material"
        content.notes.append(f"{words}; their polygons get none.")
    if not used:
        return
    colours = read_libraries(content.path, parts.libraries, content.notes)
    content.colours = {name: colours.get(name) for name in used}
    faces = sum(map(bool, parts.materials))
    coloured = sum(colour is not None for colour in content.colours.values())
    words = f"{content.path} has {len(used)} materials on {faces} of {len(parts.faces)} polygons"
    words += f": {list_some(used, 5)}"
    asked = (
        "Albedos are taken from names and colours with --materials (in Blender Albedo from: "
        "Materials)."
    )
    content.notes.append(f"{words}. {coloured} have a diffuse colour. {asked}")


def _judge_up(vertices, faces):
    """The upward axis of a mesh, and a hint where that is likely but not sure.

    Floors are level and roofs often are not. So of the areas that face straight along the upward
    axis those on one side are larger, while the two sides of a house have the same.

    Parameters
    ----------
    vertices : array, (v, 3) float64
    faces : list of (k,) int

    Returns
    -------
    up : {'z', 'y'}
    notes : list of str
    """
    shaped = [face for face in faces if len(face) > 2]
    if not shaped:
        return "z", []
    starts = np.cumsum([0, *map(len, shaped)])
    area, normal = measure_polygons(
        vertices[np.concatenate(shaped)], starts, np.arange(len(starts))
    )
    # Area that faces up and down each axis: together, and how much the two differ.
    ends = [[area[sign * normal[:, axis] > 0.999].sum() for sign in (1, -1)] for axis in (1, 2)]
    (level_y, lean_y), (level_z, lean_z) = ((sum(two), abs(two[0] - two[1])) for two in ends)
    least = 0.01 * area.sum()
    # Across y the two sides differ, as with floors; across z they are the same, as with walls.
    floors = level_y > least and lean_y > 0.5 * level_y
    if floors and level_z > least and lean_z < 0.1 * level_z:
        words = "The file's y axis was taken to point up: floors lie across it, and walls across z."
        return "y", [f"{words} --up z takes z."]
    if level_y > 0.1 * area.sum() and level_z < 1e-3 * level_y and len(faces) > 5:
        return "z", ["No surface is level. If the file's y axis points up, give --up y."]
    return "z", []
