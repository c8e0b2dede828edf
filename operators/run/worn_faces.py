"""The face and the object of the user that show a surface of a city: names of faces, and the
objects it is shown by.
"""

from collections import Counter

import numpy as np

from ...core.city.city import whole_of_cell
from ..city.attributes import read_face_attribute, write_face_attribute
from ..city.keys import Key
from ..city.source_objects import SOURCE, is_in_place, list_taken

POLYGON = "polygon"


def name_faces(item, building):
    """Ids of the surfaces that the faces of an object are: list of str.

    Ids that they had in the files, where it was made of a building of them.
    """
    names = [f"{building}/{face}" for face in range(len(item.data.polygons))]
    numbers = read_face_attribute(item.data, POLYGON)
    if numbers is None or item.get(Key.BUILDING_ID) != building or len(numbers) != len(names):
        return names
    kept, count = item.get(Key.POLYGONS, "").split("\n"), Counter()
    for face, number in enumerate(numbers.tolist()):
        if 0 <= number < len(kept):
            count[number] += 1
            names[face] = kept[number] + (f"~{count[number]}" if count[number] > 1 else "")
    return names


def remember_wearers(city, taken):
    """Store on a city which objects show it: a list of (object, building), "" for those without
    faces of their own.
    """
    city[Key.TAKEN if is_in_place(city) else Key.WEARERS] = {
        str(place): item for place, (item, _) in enumerate(taken)
    }
    city[Key.TAKEN_BUILDINGS] = [name for _, name in taken]


def write_sources(city, surface_id):
    """Write to the city's faces the number of the face and object that they show; -1 where they
    belong to no own mesh.

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
    sources = np.array(
        [place.get(whole_of_cell(name), (-1, -1)) for name in surface_id], np.int32
    ).reshape(-1, 2)
    own = sources[read_face_attribute(city.data, "surface")]
    for name, numbers in zip(SOURCE, own.T, strict=True):
        write_face_attribute(city.data, name, numbers)
