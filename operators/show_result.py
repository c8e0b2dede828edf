"""Show a result: the panel's choice *Show*, the colours of the faces and the view say the same."""

from contextlib import contextmanager

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .colour_faces import colour_faces, show_exact_colours
from .compare_results import follow_scale
from .in_place import is_in_place
from .read_materials import remember_materials
from .select_faces import leave_edit_mode
from .session import find_city, find_session
from .show_city import give_back_shading, keep_shading, show_city
from .wear_colours import describe_stand_ins, take_off_colours, wear_colours

STAND_INS = PREFIX + "stand_ins"  # what the panel says of objects that have no faces of their own

_state = {"quiet": False}


def show_result(context, city, ground, attribute):
    """Choose a result in the panel, colour the faces by it, and show them.

    Parameters
    ----------
    context : bpy.types.Context
    city, ground : bpy.types.Object or None
    attribute : str
        Name without prefix.

    Returns
    -------
    ColourScale

    Raises
    ------
    InputError
        The faces do not have this result.
    """
    settings = context.scene.citypv
    # Ends that were given for another result mean nothing for this one.
    own = not settings.auto_range and city.get(PREFIX + "colour_attribute") == attribute
    ends = {"low": settings.low, "high": settings.high} if own else {}
    if own and not settings.low < settings.high:
        raise InputError("Range", f"{settings.low:g} to {settings.high:g} is empty", "give a Low below High")
    scale = colour_faces(city, ground, attribute, **ends, colour_map=settings.colour_map)
    with _without_updates():
        settings.attribute = attribute
        if not own and not scale.classes:
            settings.low, settings.high = scale.low, scale.high
    show_colours(context, city)
    follow_scale(context.scene, scale)
    return scale


def show_colours(context, city):
    """Show the colours of a city, or the shape and the user's own materials where *Colours* is off."""
    wanted = context.scene.citypv.show_colours
    if is_in_place(city):
        hidden = wear_colours(city) if wanted else take_off_colours(city)
        city[STAND_INS] = describe_stand_ins(hidden)
    if wanted:
        keep_shading(context.scene)
        show_exact_colours(context.scene)
        show_city()
    else:
        give_back_shading(context.scene)


def follow_switch(settings, context):
    """Show or take off the colours when the switch *Colours* changes."""
    city, _ = find_city(context.scene)
    if _state["quiet"] or city is None or city.get(PREFIX + "colour_attribute") is None:
        return
    leave_edit_mode(context)
    show_colours(context, city)


def follow_choice(settings, context):
    """Colour the faces anew when a setting of *Colour* changes (`update` of its properties).

    Where the city has no such result, or the range is empty, nothing changes: the panel says why.
    """
    city, ground = find_city(context.scene)
    if _state["quiet"] or city is None or not has_result(city, settings.attribute):
        return
    same = city.get(PREFIX + "colour_attribute") == settings.attribute
    if same and not settings.auto_range and not settings.low < settings.high:
        return
    leave_edit_mode(context)
    session = find_session(city)
    if session is not None and session.city is not None:
        remember_materials(city, ground, session)
    show_result(context, city, ground, settings.attribute)


def has_result(city, attribute):
    """Whether the faces of a city have a result."""
    return PREFIX + attribute in city.data.attributes


@contextmanager
def _without_updates():
    # What is set here is coloured already.
    _state["quiet"] = True
    try:
        yield
    finally:
        _state["quiet"] = False
