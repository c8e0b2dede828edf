"""What the marks on a city say of its edits, and which cure the panel names."""

from ...core.settings.errors import InputError
from .keys import Key
from .session import Session


def describe_edit(city):
    """What makes a city another one than what is seen, and the cure, in words: (str, str); "" if
    nothing.
    """
    if city.get(Key.ADDED):
        return city[Key.ADDED], "add it to the city, or hide it"
    if city.get(Key.GROUND_EDITED):
        return (
            "its ground was edited",
            "undo that, or classify again, which lays it anew (other terrain: a file)",
        )
    cure = "press Update" if Session.can_update(city) else "classify and trace the city again"
    if Session.is_from_file(city):
        cure = "press Import and trace again, which goes on from its files"
    if city.get(Key.EDITED):
        return "its mesh was edited", cure
    return ("objects of it were edited", cure) if city.get(Key.REDESIGNED) else ("", "")


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
