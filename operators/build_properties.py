"""Properties of Blender's panel from the settings that `core.request.Request` declares."""

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.settings.request import declared_settings
from .find_module import suggest_modules

SEARCHES = {"Module": suggest_modules}  # title of a text -> its suggestions
LARGEST = 2**31 - 1  # Blender keeps whole numbers in 32 bits
AUTO = "auto_"  # + setting: switch of one that may be left to the program
START = 3  # number that the user begins with
UNSET = -1  # stands for None in whole numbers that may be left to the program, as Blender has no None


def build_properties():
    """Properties of all settings that have a title, by the names of the settings: dict."""
    declared = [(name, default, details) for name, default, details in declared_settings() if details.title]
    switches = {AUTO + name: build_switch(name, details) for name, _, details in declared if left_to_program(details)}
    return {name: build_property(default, details) for name, default, details in declared} | switches


def build_switch(name, details):
    """Property that leaves a setting to the program: on while its number is UNSET."""

    def leave(settings, left):
        setattr(settings, name, UNSET if left else START)

    return BoolProperty(
        name="Automatic",
        description=_sentence(details.words),
        get=lambda settings: getattr(settings, name) == UNSET,
        set=leave,
    )


def build_property(default, details):
    """Property of one setting.

    Parameters
    ----------
    default : object
    details : core.settings.Setting

    Returns
    -------
    bpy.props._PropertyDeferred
    """
    unit = f" [{details.unit}]" if details.unit and details.subtype == "NONE" else ""
    named = {"name": details.title, "description": _sentence(details.words) + unit}
    if details.kind == "choice":
        items = [(value, name_choice(value), words) for value, words in details.choices.items()]
        return EnumProperty(**named, items=items, default=default)
    if details.kind in ("switch", "flag"):
        return BoolProperty(**named, default=default)
    if details.kind == "text":
        search = SEARCHES.get(details.title)
        more = {"search": search, "search_options": {"SUGGESTION"}} if search else {}
        return StringProperty(**named, default=default or "", **more)
    named |= {"default": default} | ({"min": details.least} if details.least is not None else {})
    named |= {"max": details.most} if details.most is not None else {}
    if left_to_program(details):
        named |= {"default": UNSET if default is None else default, "min": UNSET}
        named["description"] += f" ({UNSET}: {details.none})"
    if details.kind == "integer":
        return IntProperty(**{**named, "max": int(named.get("max", LARGEST)), "min": int(named.get("min", -LARGEST))})
    lowest = {"min": details.above + 10**-3} if details.above is not None else {}
    precision = 1 if details.unit in ("%", "km") else 3
    return FloatProperty(**named, **lowest, subtype=details.subtype, precision=precision)


def name_choice(value):
    """Choice as the panel shows it; units and axes stay as they are."""
    return value.replace("-", " ").capitalize() if len(value) > 2 else value


def left_to_program(details):
    """Whether a setting is a whole number or, with a word such as `auto`, None."""
    return details.kind == "integer" and bool(details.none)


def read_properties(settings):
    """Values of these properties, by the names of the settings: dict."""
    found = {name: (getattr(settings, name), details) for name, _, details in declared_settings() if details.title}
    return {
        name: None if left_to_program(details) and value == UNSET else value for name, (value, details) in found.items()
    }


def settings_of_panel(panel):
    """Names of the settings that a panel shows without changes: list of str."""
    return [name for name, _, details in declared_settings() if details.panel == panel]


def _sentence(words):
    return words[0].upper() + words[1:]
