"""What a city consists of as it is seen: its own mesh, objects of the user that are part of it, buildings left out.

Each change of these is an edit: the results are those of the city seen as long as its design is the one they were
computed for.
"""

import hashlib
import uuid
from collections import Counter

import bpy
import numpy as np

from ..core.city.city import whole_of_cell
from ..core.settings.errors import InputError
from .attributes import PREFIX, read_array, read_corners, read_face_attribute, write_face_attribute
from .in_place import (
    ADDED,
    BESIDE,
    BUILDINGS,
    FACE,
    IDENTITY,
    MASK,
    OBJECT,
    OF_OBJECTS,
    OWNER,
    TAKEN,
    TAKEN_FROM,
    WEARERS,
    is_in_place,
    is_seen,
    list_beside,
    list_taken,
)
from .run_step import redraw_panels
from .session import find_session

# Properties of a city.
LINEAGE = PREFIX + "lineage"  # names the polygons of the files, with what was edited in the city's own mesh
REMOVED = PREFIX + "removed"  # ids of buildings of the files that are left out, one per line
MESH, RESHAPED = PREFIX + "shape", PREFIX + "edited"  # digest of its own mesh, and whether that is another one now
GROUND, RELAID = PREFIX + "ground_shape", PREFIX + "ground_edited"  # the same of its ground
FAMILY, VARIANT = PREFIX + "family", PREFIX + "variant"  # shared by all variants; what this one is called
DESIGN, REDESIGNED = PREFIX + "design", PREFIX + "redesigned"  # the same of all else that it consists of
OF_CITY = (*OF_OBJECTS, IDENTITY, FAMILY, VARIANT, LINEAGE, REMOVED, DESIGN, REDESIGNED, RESHAPED)
# Properties of an object of the user.
PUT_AWAY = PREFIX + "put_away"  # hidden with its variant
BUILDING = PREFIX + "building_id"  # what its building is called, where not as the object
POLYGONS = PREFIX + "polygons"  # ids of the polygons that it was made of; a face attribute has their numbers
ORIGINAL = PREFIX + "original"  # digest of the shape in which it was made of a building of the files
POLYGON = "polygon"
COLLECTION = "CityPV"  # what is put into it joins the city that is seen


def begin_design(city, earlier=None):
    """Note on a new city what it consists of; what was added to an `earlier` one of the same files is an edit of it."""
    city[IDENTITY] = city.get(IDENTITY) or earlier or uuid.uuid4().hex
    city[LINEAGE] = uuid.uuid4().hex
    city[REMOVED] = "\n".join(sorted({item[BUILDING] for item in list_members(city) if ORIGINAL in item}))
    remember_design(city, describe_design(city, seen=None if is_in_place(city) else {}))


def remember_design(city, design):
    """Store on a city of what design its results are, with the shape of its own mesh and of its ground."""
    city[MESH], city[RESHAPED] = describe_mesh(city), False
    city[GROUND], city[RELAID] = describe_ground(city), False
    city[DESIGN], city[REDESIGNED] = design, design != describe_design(city)


def note_edits(city, *, own=True):
    """Note on a city that is seen whether its results are of it; `own`: its own mesh or its ground may have changed."""
    if city is None or DESIGN not in city or not is_seen(city):
        return
    # Objects in the collection CityPV are part of a city of files; those in that of a city of meshes, of this one.
    groups = [scene.collection.children.get(COLLECTION) for scene in city.users_scene]
    taken = {item for _, item, _ in list_taken(city)}
    for group in filter(None, [city.get(TAKEN_FROM)] if is_in_place(city) else groups):
        for item in set(group.all_objects) - taken:
            if PREFIX + "part" not in item and OWNER not in item and item.type in ("MESH", "EMPTY"):
                item[OWNER] = city[IDENTITY]
    # What was put beside it since it was imported or taken, and is not part of it.
    added = sorted(set(list_beside(city)) - set(city[BESIDE])) if BESIDE in city else []
    more = f" and {len(added) - 1} more are" if len(added) > 1 else " is"
    note_change(city, ADDED, f"{added[0]}{more} not part of the city" if added else "")
    if any(item.mode == "EDIT" for item in filter(None, (city, city.get(PREFIX + "ground"), *list_members(city)))):
        return
    if own:
        note_change(city, RESHAPED, describe_mesh(city) != city[MESH])
        now, laid = describe_ground(city), city.get(GROUND)
        note_change(city, RELAID, bool(now and laid and now not in laid))
    note_change(city, REDESIGNED, describe_design(city) != city[DESIGN])


def note_change(city, key, value):
    """Store on a city what was edited, where that is news; panels and legend tell it."""
    if value != city.get(key, type(value)()):
        city[key] = value
        redraw_panels(bpy.context, views=True)


def has_edits(city):
    """Whether a city is seen in another shape than its results are of."""
    return bool(city.get(RESHAPED) or city.get(REDESIGNED))


def list_members(city):
    """Objects of the user that are part of a city, seen or not, by name: those it was taken from, and those added."""
    identity, scenes = city.get(IDENTITY), city.users_scene
    added = {item for scene in scenes for item in scene.objects if identity and item.get(OWNER) == identity}
    taken = {item for _, item, _ in list_taken(city)} if is_in_place(city) else set()
    return sorted(added | taken, key=lambda item: item.name)


def list_seen(city):
    """Of these, those that are seen, with the names of their buildings: dict of object to str."""
    layer, names = city.users_scene[0].view_layers[0] if city.users_scene else None, {}
    for item in list_members(city):
        if not item.visible_get(view_layer=layer):
            continue
        name = item.get(BUILDING, item.name)
        names[item] = item.name if name in names.values() else name  # a copy of it is another building
    return names


def describe_design(city, lineage=None, seen=None):
    """Digest of all that a city consists of: polygons of the files, objects of the user, buildings left out: str.

    Parameters
    ----------
    city : bpy.types.Object
    lineage : str, optional
        Of its polygons; by default that which it has.
    seen : dict, optional
        Of `list_seen`.
    """
    digest = hashlib.sha256((lineage or city.get(LINEAGE, "")).encode())
    seen = list_seen(city) if seen is None else seen
    originals = originals_of(city, seen)
    for item, name in seen.items():
        if name not in originals:
            digest.update(name.encode() + describe_object(city, item))
    digest.update(repr(sorted(removed_of(city) - originals)).encode())
    return digest.hexdigest()


def describe_edited(city):
    """Digest of a city as it is seen at the moment, with what was edited in its own mesh: str."""
    return describe_design(city, next_lineage(city) if city.get(RESHAPED) else None)


def removed_of(city):
    """Ids of the buildings of the files that are left out: set of str."""
    return set(filter(None, city.get(REMOVED, "").split("\n")))


def originals_of(city, seen):
    """Ids of the buildings that are objects of their own, and as in the files: set of str."""
    pairs = [(item, name) for item, name in seen.items() if item.get(BUILDING) == name]
    return {name for item, name in pairs if item.get(ORIGINAL) == describe_object(city, item).hex()}


def describe_object(city, item):
    """Digest of an object's place and shape: bytes. The place is relative to a city of files."""
    digest, matrix = hashlib.sha256(), np.array(item.matrix_world)
    if not is_in_place(city):
        matrix[:3, 3] -= np.array(city.location)
    digest.update(matrix.tobytes())
    digest.update(describe_shape(city, item))
    for part in item.instance_collection.all_objects if item.instance_collection else ():
        digest.update(np.array(part.matrix_world).tobytes() + describe_shape(city, part))
    return digest.digest()


def describe_shape(city, item):
    """Mesh of an object beside a city after the user's modifiers, wherever it stands: bytes."""
    if item.type != "MESH":
        return b""
    if own_modifiers(item) and city.users_scene:
        item = item.evaluated_get(city.users_scene[0].view_layers[0].depsgraph)
    return read_array(item.data.vertices, "co", 3).tobytes() + read_corners(item.data).tobytes()


def own_modifiers(item):
    """Modifiers that the user gave to an object: list of bpy.types.Modifier."""
    return [modifier for modifier in item.modifiers if modifier.name != MASK]


def next_lineage(city):
    """Name of the polygons of a city with what was edited in its own mesh: str."""
    return hashlib.sha256((city.get(LINEAGE, "") + describe_mesh(city)).encode()).hexdigest()


def describe_mesh(city):
    """Digest of a city's own mesh; it may be moved, but not turned: that is another city for the sun."""
    digest = hashlib.sha256()
    if not is_in_place(city):
        digest.update(np.array(city.matrix_world.to_3x3()).tobytes() + describe_shape(city, city))
    return digest.hexdigest()


def describe_ground(city):
    """Digest of a city's ground as it lies below the city: str; "" without one in the scene: then no other is seen."""
    ground = city.get(PREFIX + "ground")
    if ground is None or not ground.users_scene:
        return ""
    place = np.array(ground.matrix_basis).round(4)
    return hashlib.sha256(place.tobytes() + describe_shape(city, ground)).hexdigest()


def name_faces(item, building):
    """Ids of the surfaces that the faces of an object are: list of str.

    Those that it had in the files, where it was made of a building of them.
    """
    names = [f"{building}/{face}" for face in range(len(item.data.polygons))]
    numbers = read_face_attribute(item.data, POLYGON)
    if numbers is None or item.get(BUILDING) != building or len(numbers) != len(names):
        return names
    kept, count = item.get(POLYGONS, "").split("\n"), Counter()
    for face, number in enumerate(numbers.tolist()):
        if 0 <= number < len(kept):
            count[number] += 1
            names[face] = kept[number] + (f"~{count[number]}" if count[number] > 1 else "")
    return names


def remember_wearers(city, taken):
    """Store on a city which objects show it: a list of (object, building), "" for those without faces of their own."""
    city[TAKEN if is_in_place(city) else WEARERS] = {str(place): item for place, (item, _) in enumerate(taken)}
    city[BUILDINGS] = [name for _, name in taken]


def write_sources(city, surface_id):
    """Write to the city's faces which face of which object they are: -1 where they are none of an own mesh.

    Parameters
    ----------
    city : bpy.types.Object
    surface_id : list of str
        Ids of the surfaces, cells and racks included.
    """
    place = {}
    for number, item, building in list_taken(city):
        if building:
            place |= {name: (number, face) for face, name in enumerate(name_faces(item, building))}
    sources = np.array([place.get(whole_of_cell(name), (-1, -1)) for name in surface_id], np.int32).reshape(-1, 2)
    own = sources[read_face_attribute(city.data, "surface")]
    write_face_attribute(city.data, OBJECT, own[:, 0])
    write_face_attribute(city.data, FACE, own[:, 1])


def describe_edit(city):
    """What makes a city another one than what is seen, and the cure, in words: (str, str); "" if nothing."""
    if city.get(ADDED):
        return city[ADDED], "add it to the city, or hide it"
    if city.get(RELAID):
        return "its ground was edited", "undo that, or classify again, which lays it anew (other terrain: a file)"
    cure = "press Update" if can_update(city) else "classify and trace the city again"
    if city.get(RESHAPED):
        return "its mesh was edited", cure
    return ("objects of it were edited", cure) if city.get(REDESIGNED) else ("", "")


def can_update(city):
    """Whether a city has light that can be edited, so that only the edit has to be traced."""
    return getattr(find_session(city), "base", None) is not None


def hinders_update(city):
    """Whether something has to be done about a city before it can be updated: to what is beside it, or its ground."""
    return bool(city.get(ADDED) or city.get(RELAID))


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
