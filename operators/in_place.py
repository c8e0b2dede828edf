"""Cities whose meshes are the user's own: which objects were taken, and which face of them each triangle is of.

The city's object carries the results and is hidden; the colours are shown on the user's objects (`wear_colours`).
"""

import numpy as np

from ..core.city.grid_cells import whole_of_cell
from .attributes import PREFIX
from .write_attributes import read_face_attribute, write_face_attribute

TAKEN = PREFIX + "taken"  # of the city: number -> object of the user
BUILDINGS = PREFIX + "taken_buildings"  # name of the building that each is; "" if it shows no faces of its own
SEEN = PREFIX + "seen"  # whether the city is the one to be seen
STAND_IN = PREFIX + "stand_in"
OBJECT, FACE = "source_object", "source_face"  # face attributes of the city


def is_in_place(city):
    """Whether a city was taken from objects of the user."""
    return city is not None and TAKEN in city


def is_seen(city):
    """Whether a city is to be seen, by itself or on the objects it was taken from."""
    return bool(city.get(SEEN, True)) if is_in_place(city) else city.visible_get()


def mark_taken(city, taken, site, metres):
    """Store on a city the objects that it was taken from, put it where they are, and hide it.

    Parameters
    ----------
    city : bpy.types.Object
        In a view layer.
    taken : list of (bpy.types.Object, str)
        Each with the name of its building, "" where its faces are not those of its mesh.
    site : core.scene.scene.Site
    metres : float
        Of one unit of Blender's scene.
    """
    city[TAKEN] = {str(place): item for place, (item, _) in enumerate(taken)}
    city[BUILDINGS] = [name for _, name in taken]
    city[SEEN] = True
    city[PREFIX + "metres"] = metres
    put_in_place(city, site)


def put_in_place(city, site):
    """Move a city and its ground from the scene's origin to the objects it was taken from; hide the city."""
    metres = city[PREFIX + "metres"]
    for item in filter(None, (city, city.get(PREFIX + "ground"))):
        item.location = [value / metres for value in site.origin]
        item.scale = (1 / metres,) * 3
    city.hide_set(True)
    city.hide_render = True


def inherit_taken(city, earlier):
    """Let a city stand for the same objects as the one that it replaces."""
    for key in (TAKEN, BUILDINGS, SEEN, PREFIX + "metres"):
        city[key] = earlier[key].to_dict() if key == TAKEN else earlier[key]


def list_taken(city):
    """Objects that a city was taken from and that still exist: list of (number, object, building)."""
    if not is_in_place(city):
        return []
    scene_objects = {item for scene in city.users_scene for item in scene.objects}
    pairs = ((int(number), item) for number, item in city[TAKEN].items())
    return [(number, item, city[BUILDINGS][number]) for number, item in pairs if item in scene_objects]


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


def has_own_faces(item, evaluated):
    """Whether the faces of an object are those of its mesh: one user, and no modifier that adds or removes faces."""
    mesh = item.data
    users = mesh.users - mesh.use_fake_user
    same = users == 1 and len(mesh.polygons) == len(evaluated.polygons) and len(mesh.loops) == len(evaluated.loops)
    if not same:
        return False
    before, after = (np.empty(len(mesh.loops), np.int32) for _ in range(2))
    mesh.loops.foreach_get("vertex_index", before)
    evaluated.loops.foreach_get("vertex_index", after)
    return bool((before == after).all())
