"""The meshes that a city is made of: its own, or objects of the user, and whether they were edited since.

Where a city was taken from objects of the user, its own object carries the results and is hidden; the colours are shown
on the user's objects (`picture.colour_user_meshes`).
"""

import hashlib

import numpy as np

from ..core.city.city import whole_of_cell
from ..core.settings.errors import InputError
from .attributes import PREFIX, read_array, read_corners, read_face_attribute, write_face_attribute

TAKEN = PREFIX + "taken"  # of the city: number -> object of the user
BUILDINGS = PREFIX + "taken_buildings"  # name of the building that each is; "" if it shows no faces of its own
SEEN = PREFIX + "seen"  # whether the city is the one to be seen
STAND_IN = PREFIX + "stand_in"
OBJECT, FACE = "source_object", "source_face"  # face attributes of the city
METRES = PREFIX + "metres"  # of one unit of Blender's scene
SHAPE, EDITED = PREFIX + "shape", PREFIX + "edited"  # properties of the city
BESIDE, ADDED = (
    PREFIX + "beside",
    PREFIX + "added",
)  # objects that were beside it, and what came or went since, in words
OF_CITY = (TAKEN, BUILDINGS, SEEN, METRES, SHAPE, EDITED, BESIDE, ADDED)  # what a city has that replaces another one
PLAIN = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")


def is_in_place(city):
    """Whether a city was taken from objects of the user."""
    return city is not None and TAKEN in city


def is_seen(city):
    """Whether a city is to be seen, by itself or on the objects it was taken from."""
    return bool(city.get(SEEN, True)) if is_in_place(city) else city.visible_get()


def put_in_place(city, site):
    """Move a city and its ground from the scene's origin to the objects it was taken from; hide the city."""
    for item in filter(None, (city, city.get(PREFIX + "ground"))):
        item.location = [value / city[METRES] for value in site.origin]
        item.scale = (1 / city[METRES],) * 3
    city.hide_set(True)
    city.hide_render = True


def list_taken(city):
    """Objects that a city was taken from and that still exist: list of (number, object, building)."""
    if not is_in_place(city):
        return []
    there = {item for scene in city.users_scene for item in scene.objects}
    return [(int(number), item, city[BUILDINGS][int(number)]) for number, item in city[TAKEN].items() if item in there]


def write_sources(city, surface_id):
    """Write to the city's faces which face of which object they are: -1 where they are none of an own mesh.

    Parameters
    ----------
    city : bpy.types.Object
    surface_id : list of str
        Ids of the surfaces, "building/face", cells and racks included.
    """
    number = {name: place for place, name in enumerate(city[BUILDINGS]) if name}
    sources = np.full((len(surface_id), 2), -1, np.int32)  # object, face
    for row, name in enumerate(surface_id):
        building, _, face = whole_of_cell(name).rpartition("/")
        if building in number and face.isdigit():
            sources[row] = number[building], int(face)
    own = sources[read_face_attribute(city.data, "surface")]
    write_face_attribute(city.data, OBJECT, own[:, 0])
    write_face_attribute(city.data, FACE, own[:, 1])


def is_single(mesh):
    """Whether one object only uses a mesh."""
    return mesh.users - mesh.use_fake_user == 1


def remember_shape(city):
    """Store on a city the shape of the meshes that it is made of."""
    city[SHAPE], city[EDITED] = describe_shape(city), False


def remember_beside(city):
    """Store on a city which objects are seen beside it: they are not part of it, and what comes later is an edit."""
    city[BESIDE], city[ADDED] = list_beside(city), ""


def list_beside(city):
    """Names of the meshes that are seen in the scenes of a city, but are neither part of it nor made by CityPV."""
    own, names = {item for _, item, _ in list_taken(city)}, set()
    for scene in city.users_scene:
        for item in scene.objects:
            solid = (item.type == "MESH" and len(item.data.polygons)) or item.instance_collection is not None
            if solid and PREFIX + "part" not in item and item not in own:
                names |= {item.name} if item.visible_get(view_layer=scene.view_layers[0]) else set()
    return sorted(names)


def describe_added(city):
    """What came beside a city or left it since it was imported or taken, in words; "" if nothing."""
    added = sorted(set(list_beside(city)) - set(city[BESIDE])) if BESIDE in city else []
    if added:
        return (
            f"{added[0]}{f' and {len(added) - 1} more' if len(added) > 1 else ''} came beside it and is not part of it"
        )
    return "an object that it was taken from is gone" if len(list_taken(city)) < len(city.get(BUILDINGS, ())) else ""


def describe_edit(city):
    """What makes a city another one than what is seen, and the cure, in words: (str, str); "" if nothing."""
    if city is None or not (city.get(ADDED) or city.get(EDITED)):
        return "", ""
    if is_in_place(city):
        return city.get(ADDED) or "an object that it was taken from was edited", "undo that, or take the meshes again"
    if city.get(ADDED):
        return city[ADDED], "add it to the city, hide it, or import the city again"
    return "its mesh was edited", "undo that, or import the city again"


def check_unedited(city):
    """Refuse to compute on another geometry than what is seen.

    Raises
    ------
    InputError
        The city was edited, or an object came beside it.
    """
    problem, cure = describe_edit(city)
    if problem:
        raise InputError(city.name, problem, cure)


def describe_shape(city):
    """Digest of vertices, faces, places and modifiers of a city's mesh, or of the objects that it was taken from."""
    taken, digest = is_in_place(city), hashlib.sha256()
    for item in [own for _, own, _ in list_taken(city)] if taken else [city]:
        # A mesh of the city itself may be moved, but not turned: that is another city for the sun.
        digest.update(np.array(item.matrix_world if taken else item.matrix_world.to_3x3()).tobytes())
        if item.type == "MESH":
            digest.update(read_array(item.data.vertices, "co", 3).tobytes())
            digest.update(read_corners(item.data).tobytes())
        for modifier in item.modifiers if taken else ():
            plain = [p.identifier for p in modifier.bl_rna.properties if p.type in PLAIN and not p.is_readonly]
            kept = [name for name in plain if name not in ("show_expanded", "is_active")]
            digest.update(repr([str(getattr(modifier, name)) for name in kept]).encode())
    return digest.hexdigest()
