"""Objects of the user that a city consists of, those beside it, and which of them a scene has."""

import bpy

from ..city.keys import Key
from ..city.source_objects import COLLECTION, is_in_place, list_taken

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


def part_sessions(cities):
    """Give cities that were duplicated or appended keys of their own: results of one are not those
    of the other.

    Parameters
    ----------
    cities : list of bpy.types.Object
        In the order in which they came; two do not share a file with traced light either.
    """
    for key in (Key.SESSION, Key.TRANSFER_FILE):
        seen = set()
        for city in cities:
            if city.get(key) and city[key] in seen:
                del city[key]
            seen.add(city.get(key))


def find_objects(uids):
    """Objects of the open file by their `session_uid`, which undo keeps: dict; those that are gone
    are left out.

    Work that goes on between two calls of Blender keeps these numbers: undo, deleting and opening a
    file free objects.
    """
    wanted = set(uids)
    return {item.session_uid: item for item in bpy.data.objects if item.session_uid in wanted}


def site_of(item):
    """Origin of the mesh of a city, and the direction of its axes, in the system of its files:
    core.city.scene.Site.
    """
    origin = [float(value) for value in item[Key.ORIGIN]]
    from ...core.city.site import Site

    return Site(None, None, 0.0, float(item.get(Key.CONVERGENCE, 0.0)), None, origin)


def put_in_place(city, site):
    """Move a city with its ground from the scene's origin to the objects it was taken from; hide
    the city.
    """
    city.location = [value / city[Key.METRES] for value in site.origin]
    city.scale = (1 / city[Key.METRES],) * 3
    city.hide_set(True)
    city.hide_render = city.hide_select = True
