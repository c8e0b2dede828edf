"""Objects of the user that show a city: those that it was taken from, or that were added to a city
of files.

Where a city was taken from objects of the user, its own object carries the results and is hidden;
the colours are shown on the user's objects (`picture.colour_user_meshes`). A city of files hides
only the faces that they show.
"""

from .keys import Key

COLLECTION = "CityPV"  # what is put into it joins the city that is seen
SOURCE = ("source_object", "source_face")  # face attributes of the city: number, its face


def is_in_place(city):
    """Whether a city was taken from objects of the user."""
    return city is not None and Key.TAKEN in city


def is_seen(city):
    """Whether a city is to be seen, by itself or on the objects it was taken from."""
    return bool(city.get(Key.SEEN, True)) if is_in_place(city) else city.visible_get()


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


def is_single(mesh):
    """Whether one object only uses a mesh."""
    return mesh.users - mesh.use_fake_user == 1
