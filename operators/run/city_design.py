"""What a city consists of as it is seen: its own mesh, objects of the user that are part of it,
buildings left out.

Each change of these is an edit: the results belong to the city seen as long as its design is the
one they were computed for.
"""

import hashlib
import uuid
from dataclasses import dataclass

import bpy

from ..city.keys import Key
from ..city.run_step import redraw_panels
from ..city.source_objects import is_in_place, is_seen, list_taken
from .members import (
    OF_OBJECTS,
    groups_of,
    is_solid,
    join_city,
    list_beside,
    list_members,
    list_seen,
)
from .shapes import describe_ground, describe_mesh, describe_object

# Of a city.
OF_CITY = (
    *OF_OBJECTS,
    Key.IDENTITY,
    Key.FAMILY,
    Key.VARIANT,
    Key.LINEAGE,
    Key.REMOVED,
    Key.DESIGN,
    Key.REDESIGNED,
    Key.EDITED,
)
# (`session_uid`, place of its city) of objects -> digest, until they are edited
_known = {}
# `session_uid` of a city -> `_Parts` as it is seen, as long as all of these are in `_known`
_parts = {}
# `session_uid` of a city -> its design, and `_state_of` it when it was seen as its results are
_at_results = {}


@dataclass
class _Parts:
    """All that is seen of a city, and what stands beside it."""

    names: dict  # key of `_known` -> (name of the building, of `_read_original`, name)
    results: dict | None  # of `_state_of`, which its results are of; None where that is not known
    edited: set  # keys of what differs from it
    taken: set  # `session_uid` of the objects that it was taken from, seen or not
    beside: set  # of `list_beside`
    design: tuple = ()  # what it was asked for with, and its digest, until a part is another one


def begin_design(city, earlier=None):
    """Note on a new city what it consists of; what was added to an `earlier` one of the same files
    is an edit of it.
    """
    city[Key.IDENTITY] = city.get(Key.IDENTITY) or earlier or uuid.uuid4().hex
    city[Key.LINEAGE] = uuid.uuid4().hex
    city[Key.REMOVED] = "\n".join(
        sorted({item[Key.BUILDING_ID] for item in list_members(city) if Key.ORIGINAL in item})
    )
    remember_design(city, describe_design(city, seen=None if is_in_place(city) else {}))


def remember_design(city, design):
    """Store on a city of what design its results are, with the shape of its own mesh and of its
    ground.
    """
    city[Key.SHAPE], city[Key.EDITED] = describe_mesh(city), False
    city[Key.GROUND_SHAPE], city[Key.GROUND_EDITED] = describe_ground(city), False
    city[Key.DESIGN], city[Key.REDESIGNED] = design, design != describe_design(city)


def note_edits(city, *, own=True):
    """Note on a city that is seen whether its results are of it; `own`: its own mesh or its ground
    may have changed.
    """
    # The panel warns where a city was edited since its results were computed: what it looks like
    # now is held against what they were made from.
    if city is None:
        return
    _parts.pop(city.session_uid, None)
    # A city without a design to compare with, or out of sight, is not looked at.
    if Key.DESIGN not in city or not is_seen(city):
        return
    taken = {item for _, item, _ in list_taken(city)}
    # Objects that came into the city's collections join it, and what else stands beside it is
    # noted.
    for group in groups_of(city):
        for item in set(group.all_objects) - taken:
            join_city(city, item)
    beside = set(list_beside(city, taken))
    _note_beside(city, beside)
    members = list_members(city, taken)
    # In edit mode nothing is final, and nothing more is noted until it ends.
    if any(item.mode == "EDIT" for item in filter(None, (city, city.get(Key.GROUND), *members))):
        return
    # Its own mesh and ground first, where they may have changed; then all objects that make it up:
    # where their design is another than the results', the city counts as edited.
    if own:
        _note_own(city)
    seen, place = list_seen(city, members), _place_of(city)
    design = describe_design(city, seen=seen, known=_known)
    _note_change(city, Key.REDESIGNED, design != city[Key.DESIGN])
    # Its parts are kept, so that `note_changed` can look at single objects; not where it has
    # instances of collections.
    if not any(item.instance_collection for item in seen):
        names = {
            (item.session_uid, place): (name, _read_original(item, name), item.name)
            for item, name in seen.items()
        }
        compared = _compare_with_results(city, names, design)
        taken = {item.session_uid for item in (city.get(Key.TAKEN) or {}).values() if item}
        _parts[city.session_uid] = _Parts(names, *compared, taken, beside)


def _note_own(city):
    """Note whether a city's own mesh or its ground were edited."""
    _note_change(city, Key.EDITED, describe_mesh(city) != city[Key.SHAPE])
    now, laid = describe_ground(city), city.get(Key.GROUND_SHAPE)
    _note_change(city, Key.GROUND_EDITED, bool(now and laid and now not in laid))


def _note_beside(city, beside):
    """Note what was put beside a city since it was imported or taken, and is not part of it."""
    added = sorted(beside - set(city[Key.BESIDE])) if Key.BESIDE in city else []
    more = f" and {len(added) - 1} more are" if len(added) > 1 else " is"
    _note_change(city, Key.ADDED, f"{added[0]}{more} not part of the city" if added else "")


def _compare_with_results(city, names, design):
    """Which of the parts that are seen of a city differ from those its results are of: `results`
    and `edited` of _Parts.

    Nothing is known where it was never seen as its results are, nor where objects are buildings
    of the files: such a one is none of the design as long as it is as in the files.
    """
    if any(original for _, original, _ in names.values()):
        return None, set()
    state = _state_of(city, names)
    if design == city[Key.DESIGN]:
        _at_results[city.session_uid] = design, state
    known, results = _at_results.get(city.session_uid, ("", None))
    if known != city[Key.DESIGN]:
        return None, set()
    keys = state.keys() | results.keys()
    return results, {key for key in keys if state.get(key) != results.get(key)}


def _state_of(city, names):
    """Name and digest of each part of a city, and what it consists of beside them: dict."""
    return {"": _made_of(city)} | {key: (name, _known[key]) for key, (name, *_) in names.items()}


def _made_of(city):
    """What a city consists of beside objects: tuple of two str."""
    return city.get(Key.LINEAGE, ""), city.get(Key.REMOVED, "")


def note_changed(city, touched, before, now):
    """Note edits of single objects: as `note_edits`, without looking at all others.

    Parameters
    ----------
    city : bpy.types.Object
    touched : set of bpy.types.ID
        Moved, or with another shape.
    before, now : dict
        Of `arrangement_of`, before it was called last, and now, which gets what joins the city.

    Returns
    -------
    bool
        Whether that was enough.
    """
    # A city that is not seen has no edits, and what is known of its parts is forgotten.
    if not is_seen(city):
        _parts.pop(city.session_uid, None)
        return True
    # A city of files that was moved or edited itself is looked at as a whole; of a city of meshes
    # all objects but its ground are the user's.
    objects = [one for one in touched if one.id_type == "OBJECT"]
    parts, own = _parts.get(city.session_uid), {city, city.get(Key.GROUND)} & set(objects)
    if parts is None or (own and not is_in_place(city)):
        return False
    # What is known of its parts must be of the results that it has now, else it is looked at as a
    # whole.
    known, results = _at_results.get(city.session_uid, ("", None))
    if parts.results is not None and (parts.results is not results or known != city[Key.DESIGN]):
        return False
    # First what came, went or was renamed, then what was moved or reshaped.
    if now is not before and not _note_arranged(city, parts, before, now):
        return False
    if own:
        _note_own(city)
    # Each touched object is described again and held against what the results were made from; in
    # edit mode nothing is final.
    place = _place_of(city)
    for item in objects:
        if item.mode != "EDIT" and (key := (item.session_uid, place)) in parts.names:
            _note_part(city, parts, key, item)
    edited = bool(parts.edited)
    if parts.results is None:
        edited = describe_edited(city) != city[Key.DESIGN]
    _note_change(city, Key.REDESIGNED, edited)
    return True


def taken_parts(cities):
    """Objects that cities were taken from, seen or not, as far as known: set of `session_uid`."""
    parts = (_parts.get(city.session_uid) for city in cities)
    return set().union(*(one.taken for one in parts if one is not None))


def _note_arranged(city, parts, before, now):
    """Note on the parts of a city which objects came, went, were renamed, hidden or shown.

    Returns whether that was enough; False: the city has to be looked at as a whole.
    """
    # Objects that are described differently than before, or are gone; without any there is nothing
    # to note.
    changed = {uid for uid, told in now.items() if before.get(uid) != told}
    there, place = {uid: bpy.data.objects.get(now[uid][0]) for uid in changed}, _place_of(city)
    changed |= before.keys() - now.keys()
    if not changed:
        return True
    # What is more than an object of one scene is looked at as a whole: objects of CityPV,
    # instances, buildings of files, and names that two of them have.
    special = Key.PART, Key.BUILDING_ID
    if (
        parts.results is None
        or len(city.users_scene) > 1
        or any(item is None or item.session_uid != uid for uid, item in there.items())
        or any(item.instance_collection for item in there.values())
        or any(key in item for item in there.values() for key in special)
    ):
        return False
    groups = groups_of(city)
    for uid in changed:
        key, name = (uid, place), before[uid][0] if uid in before else ""
        if uid not in there:
            # An object that was neither part of the city nor beside it may have been its ground.
            if key not in parts.names and name not in parts.beside:
                return False
            parts.beside.discard(name)
            _note_part(city, parts, key, None)
            continue
        # An object that came or changed: does it belong to the city, is it seen, or does it stand
        # beside?
        item = there[uid]
        # What came into the city's collections joins it.
        if uid not in parts.taken and any(item in group.all_objects.values() for group in groups):
            join_city(city, item)
            now[uid] = (*now[uid][:2], item.get(Key.OWNER), now[uid][3])
        own = uid in parts.taken or item.get(Key.OWNER) == city[Key.IDENTITY]
        seen = now[uid][1]
        # A name that another part has, too, needs a look at the whole.
        if own and seen and _is_taken(parts, item.name, key):
            return False
        parts.beside.discard(name)
        if seen and not own and is_solid(item):
            parts.beside.add(item.name)
        _note_part(city, parts, key, item if own and seen else None)
    _note_beside(city, parts.beside)
    return True


def _is_taken(parts, name, own):
    """Whether another part of a city than the one with this key has a name."""
    return any(key != own and name in (names[0], names[2]) for key, names in parts.names.items())


def _note_part(city, parts, key, item):
    """Note what an object is now that is part of a city; None: it is seen no longer."""
    parts.design = ()
    now = None
    if item is None:
        parts.names.pop(key, None)
    else:
        _known[key] = describe_object(city, item)
        if key not in parts.names or parts.names[key][2] != item.name:
            parts.names[key] = item.name, "", item.name
        now = parts.names[key][0], _known[key]
    same = parts.results is not None and parts.results.get(key) == now
    (parts.edited.discard if same else parts.edited.add)(key)


def _note_change(city, key, value):
    """Store on a city what was edited, where that is news; panels and legend tell it."""
    if value != city.get(key, type(value)()):
        city[key] = value
        redraw_panels(bpy.context, views=True)


def has_edits(city):
    """Whether a city is seen in another shape than its results are of."""
    return bool(city.get(Key.EDITED) or city.get(Key.REDESIGNED))


def describe_design(city, lineage=None, seen=None, *, known=None):
    """Digest of all that a city consists of: polygons of the files, objects of the user, buildings
    left out: str.

    Parameters
    ----------
    city : bpy.types.Object
    lineage : str, optional
        Of its polygons; by default that which it has.
    seen : dict, optional
        Of `list_seen`.
    known : dict, optional
        Digests of objects that were not edited since, of `describe_object`; gets the others.
    """
    parts, place = [], _place_of(city)
    for item, name in (list_seen(city) if seen is None else seen).items():
        key = item.session_uid, place
        if known is None or item.instance_collection or key not in known:
            described = describe_object(city, item)
        else:
            described = known[key]
        if known is not None:
            known[key] = described
        parts.append((name, described, _read_original(item, name)))
    return _digest_parts(city, lineage, parts)


def _place_of(city):
    """Place that its objects are described from: tuple; empty for a city of meshes."""
    return () if is_in_place(city) else tuple(city.location)


def _read_original(item, name):
    """Digest that an object had as a building of the files: str; "" if it is called otherwise, or
    none of them.
    """
    return item.get(Key.ORIGINAL, "") if item.get(Key.BUILDING_ID) == name else ""


def _digest_parts(city, lineage, parts):
    """Digest of a city from its parts, a list of (name, bytes of `describe_object`, str of
    `_read_original`): str.
    """
    digest = hashlib.sha256((lineage or city.get(Key.LINEAGE, "")).encode())
    originals = {
        name for name, described, original in parts if original and original == described.hex()
    }
    for name, described, _ in parts:
        if name not in originals:
            digest.update(name.encode() + described)
    digest.update(repr(sorted(removed_of(city) - originals)).encode())
    return digest.hexdigest()


def describe_edited(city):
    """Digest of a city as it is seen at the moment, with what was edited in its own mesh: str."""
    parts = _parts.get(city.session_uid)
    if parts is None or city.get(Key.EDITED):
        lineage = next_lineage(city) if city.get(Key.EDITED) else None
        return describe_design(city, lineage, known=_known)
    # Put together anew only after one of its parts changed: the panel and a timer ask often.
    if parts.design[:-1] != _made_of(city):
        ordered = sorted(parts.names.items(), key=lambda part: part[1][2])
        every = [(name, _known[key], original) for key, (name, original, _) in ordered]
        parts.design = *_made_of(city), _digest_parts(city, None, every)
    return parts.design[-1]


def forget_edited(touched=None):
    """Forget the digests of the objects that were touched, given as a set of them and their data;
    without, of all.
    """
    if touched is None:
        _known.clear()
        _parts.clear()
        return
    uids = {touched_item.session_uid for touched_item in touched}
    data = {touched_item.session_uid for touched_item in touched if touched_item.id_type == "MESH"}
    if data:
        uids |= {
            item.session_uid
            for item in bpy.data.objects
            if item.data and item.data.session_uid in data
        }
    for key in [key for key in _known if key[0] in uids]:
        del _known[key]
    there = {item.session_uid for item in bpy.data.objects}
    for city in _at_results.keys() - there:
        del _at_results[city]
    whole = {city for city, parts in _parts.items() if parts.names.keys() <= _known.keys()}
    for city in _parts.keys() - (whole & there):
        del _parts[city]


def removed_of(city):
    """Ids of the buildings of the files that are left out: set of str."""
    return set(filter(None, city.get(Key.REMOVED, "").split("\n")))


def originals_of(city, seen):
    """Ids of the buildings that are objects of their own, and as in the files: set of str."""
    pairs = [(item, name) for item, name in seen.items() if item.get(Key.BUILDING_ID) == name]
    return {
        name for item, name in pairs if item.get(Key.ORIGINAL) == describe_object(city, item).hex()
    }


def next_lineage(city):
    """Name of the polygons of a city with what was edited in its own mesh: str."""
    return hashlib.sha256((city.get(Key.LINEAGE, "") + describe_mesh(city)).encode()).hexdigest()


def hinders_update(city):
    """Whether something has to be done about a city before it can be updated: to what is beside it,
    or its ground.
    """
    return bool(city.get(Key.ADDED) or city.get(Key.GROUND_EDITED))
