"""Objects of the user that show a city: those that it was taken from, or that were added to a city
of files.

Where a city was taken from objects of the user, its own object carries the results and is hidden;
the colours are shown on the user's objects (`picture.colour_user_meshes`). A city of files hides
only the faces that they show.
"""

import numpy as np

from .attributes import read_face_attribute
from .keys import Key

MASK = "CityPV mask"  # modifier and vertex group of a city: faces that objects show
WORN_COLOURS = "CityPV colours"  # modifier of such an object: shows them in pictures
COLLECTION = "CityPV"  # what is put into it joins the city that is seen
OBJECT, FACE = "source_object", "source_face"  # face attributes of the city
# What a city has that replaces another one, of these and of all.
OF_OBJECTS = (
    Key.AGAINST,
    Key.TAKEN,
    Key.TAKEN_FROM,
    Key.TAKEN_BUILDINGS,
    Key.WEARERS,
    Key.SEEN,
    Key.METRES,
    Key.BESIDE,
    Key.ADDED,
)


def is_in_place(city):
    """Whether a city was taken from objects of the user."""
    return city is not None and Key.TAKEN in city


def is_seen(city):
    """Whether a city is to be seen, by itself or on the objects it was taken from."""
    return bool(city.get(Key.SEEN, True)) if is_in_place(city) else city.visible_get()


def put_in_place(city, site):
    """Move a city with its ground from the scene's origin to the objects it was taken from; hide
    the city.
    """
    city.location = [value / city[Key.METRES] for value in site.origin]
    city.scale = (1 / city[Key.METRES],) * 3
    city.hide_set(True)
    city.hide_render = city.hide_select = True


def list_taken(city):
    """Objects that show a city and still exist: list of (number, object, building)."""
    there = {item for scene in city.users_scene for item in scene.objects}
    numbers, names = (
        city.get(Key.TAKEN) or city.get(Key.WEARERS) or {},
        list(city.get(Key.TAKEN_BUILDINGS, ())),
    )
    return [
        (int(number), item, names[int(number)]) for number, item in numbers.items() if item in there
    ]


def list_worn(city):
    """Which faces of a city objects show: list of (object, building, (k,) int of the city, (k,) int
    of the object).
    """
    numbers, shown = (read_face_attribute(city.data, name) for name in (OBJECT, FACE))
    order, worn = np.argsort(numbers, kind="stable"), []
    for number, item, building in list_taken(city):
        first, end = np.searchsorted(numbers, [number, number + 1], sorter=order)
        faces = order[first:end]
        worn.append((item, building, faces, shown[faces]))
    return worn


def is_single(mesh):
    """Whether one object only uses a mesh."""
    return mesh.users - mesh.use_fake_user == 1


def list_beside(city, taken=None):
    """Names of the meshes that are seen in the scenes of a city, but are neither part of it (it was
    taken from `taken`, a set, where that is known) nor made by CityPV.
    """
    if not is_in_place(city):
        taken = set()
    elif taken is None:
        taken = {item for _, item, _ in list_taken(city)}
    seen = {
        item
        for one in city.users_scene
        for item in one.objects
        if item.visible_get(view_layer=one.view_layers[0])
    }
    others = [
        item
        for item in seen - taken
        if Key.PART not in item and item.get(Key.OWNER, "") != city.get(Key.IDENTITY)
    ]
    return sorted(item.name for item in others if is_solid(item))


def is_solid(item):
    """Whether an object has faces that would shade a city, or is an instance of some."""
    return bool(item.instance_collection or (item.type == "MESH" and len(item.data.polygons)))


def list_members(city, taken=None):
    """Objects of the user that are part of a city, seen or not, by name: those it was taken from
    (`taken`, a set of them, where it is known), and those added.
    """
    identity, scenes = city.get(Key.IDENTITY), city.users_scene
    added = {
        item
        for scene in scenes
        for item in scene.objects
        if identity and item.get(Key.OWNER) == identity
    }
    if not is_in_place(city):
        taken = set()
    elif taken is None:
        taken = {item for _, item, _ in list_taken(city)}
    return sorted(added | taken, key=lambda item: item.name)


def list_seen(city, members=None):
    """Of these (`members`, where they are known), those that are seen, with the names of their
    buildings: dict of object to str.
    """
    layer, names, used = city.users_scene[0].view_layers[0] if city.users_scene else None, {}, set()
    for item in list_members(city) if members is None else members:
        if not item.visible_get(view_layer=layer):
            continue
        name = item.get(Key.BUILDING_ID, item.name)
        names[item] = item.name if name in used else name  # a copy of it is another building
        used.add(names[item])
    return names


def groups_of(city):
    """Collections whose objects are all part of a city: list of bpy.types.Collection.

    Of a city of files it is the collection CityPV, of a city of meshes the one it was taken from.
    """
    groups = [scene.collection.children.get(COLLECTION) for scene in city.users_scene]
    return list(filter(None, [city.get(Key.TAKEN_FROM)] if is_in_place(city) else groups))


def join_city(city, item):
    """Make an object of such a collection part of the city, if it is none of CityPV's own."""
    if Key.PART not in item and Key.OWNER not in item and item.type in ("MESH", "EMPTY"):
        item[Key.OWNER] = city[Key.IDENTITY]


def arrangement_of(scene, cities, taken=frozenset()):
    """What of a Blender scene may change which objects its cities consist of, and is not told by
    itself.

    Parameters
    ----------
    scene : bpy.types.Scene
    cities : list of bpy.types.Object
        Of the scene.
    taken : set of int
        `session_uid` of objects that a city was taken from, as far as known: they are part of it.

    Returns
    -------
    dict
        `session_uid` of each object -> its name, whether it is seen, which city it joined, and
        whether it is in a collection that one takes from. Equal ones mean that nothing came, went,
        was renamed, hidden or shown.
    """
    layer, items = scene.view_layers[0], scene.objects.values()
    groups = [scene.collection.children.get(COLLECTION)]
    groups += [city.get(Key.TAKEN_FROM) for city in cities]
    joined = set().union(*(group.all_objects.keys() for group in filter(None, groups)))
    names, uids = scene.objects.keys(), [item.session_uid for item in items]
    told = zip(
        names,
        [item.visible_get(view_layer=layer) for item in items],
        [
            None if uid in taken else item.get(Key.OWNER)
            for uid, item in zip(uids, items, strict=True)
        ],
        [name in joined for name in names],
        strict=True,
    )
    return dict(zip(uids, told, strict=True))
