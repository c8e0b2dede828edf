"""Properties of Blender's panel from the settings that `core.settings.request.Request` declares,
and switches of effects.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...core.effects.table import TABLE
from ...core.settings.request import Request, declared_settings
from .run_step import Action

LARGEST = 2**31 - 1  # Blender keeps whole numbers in 32 bits
AUTO = "auto_"  # + setting: switch of one that may be left to the program
# stands for None in whole numbers that may be left to the program, as Blender has no None
UNSET = -1
STATES = (
    ("auto", "Auto", "As the plan decides for the city"),
    ("on", "On", "Always"),
    ("off", "Off", "Never"),
)
ELECTRIC = ("aoi", "spectrum", "temperature")  # effects of the step Energy
OF_LIGHT = tuple(key for key in TABLE if key not in ELECTRIC)  # of the step Trace


def _list_titled():
    """Settings that the panel shows: list of (name, default, details)."""
    return [
        (name, default, details) for name, default, details in declared_settings() if details.title
    ]


def settings_of_panel(panel):
    """Names of the settings that a panel shows without changes: list of str."""
    return [name for name, _, details in declared_settings() if details.panel == panel]


def _left_to_program(details):
    """Whether a setting is a whole number or, with a word such as `auto`, None."""
    return details.kind == "integer" and bool(details.none)


def build_properties(follow):
    """Properties of all settings that have a title, by the names of the settings, and switches of
    effects, and of the days that stand for a year: dict.

    `follow` has what is called when a setting changes, by its name.
    """
    properties = {
        "days": IntProperty(
            name="Days",
            description="Number of days, spread over the year",
            default=int(Request.suns.partition(":")[2]),
            min=1,
            max=365,
        )
    }
    for name, default, details in _list_titled():
        more = {"update": follow[name]} if name in follow else {}
        properties[name] = _build_property(default, details, **more)
        if _left_to_program(details):
            properties[AUTO + name] = _build_switch(name, details)
    return properties | {
        name_switch(key): EnumProperty(name=row.title, description=row.words, items=STATES)
        for key, row in TABLE.items()
    }


def _build_switch(name, details):
    """Property that leaves a setting to the program: on while its number is UNSET."""
    # The user begins with 3.
    return BoolProperty(
        name="Automatic",
        description=details.words[0].upper() + details.words[1:],
        get=lambda settings: getattr(settings, name) == UNSET,
        set=lambda settings, left: setattr(settings, name, UNSET if left else 3),
    )


def _build_property(default, details, **more):
    """Property of one setting.

    Parameters
    ----------
    default : object
    details : core.settings.Setting

    Returns
    -------
    bpy.props._PropertyDeferred
    """
    # A setting in Blender's panel: a list, a switch, a text or a number, by the kind of the
    # setting. Words and unit as for the command line.
    words = details.words[0].upper() + details.words[1:]
    subtype = {"m": "DISTANCE", "%": "PERCENTAGE"}.get(details.unit, "NONE")
    unit = f" [{details.unit}]" if details.unit and subtype == "NONE" else ""
    named = {"name": details.title, "description": words + unit, **more}
    if details.kind == "choice":
        # Values of one or two letters, as of units and axes, stay as they are.
        items = [
            (value, value.replace("-", " ").capitalize() if len(value) > 2 else value, words)
            for value, words in details.choices.items()
        ]
        return EnumProperty(**named, items=items, default=default)
    if details.kind in ("switch", "flag"):
        return BoolProperty(**named, default=default)
    if details.kind == "text":
        # The field of the module suggests names of modules that have the words typed.
        search = (
            {"search": _suggest_modules, "search_options": {"SUGGESTION"}}
            if details.title == "Module"
            else {}
        )
        return StringProperty(**named, default=default or "", **search)
    # Numbers with their limits; one that may be left to the program has a value that says so.
    limits = {"min": details.least, "max": details.most}
    named |= {"default": default} | {
        key: limit for key, limit in limits.items() if limit is not None
    }
    if _left_to_program(details):
        named |= {"default": UNSET if default is None else default, "min": UNSET}
        named["description"] += f" ({UNSET}: {details.none})"
    if details.kind == "integer":
        return IntProperty(
            **{
                **named,
                "max": int(named.get("max", LARGEST)),
                "min": int(named.get("min", -LARGEST)),
            }
        )
    # Arrows of a field of hours go in steps of 10 h; a number that must lie above a limit begins
    # 0.001 above it.
    lowest = {"step": 1000} if details.unit == "h" else {}  # [1/100] of an arrow of the field
    lowest |= {"min": details.above + 10**-3} if details.above is not None else {}
    precision = {"%": 1, "km": 1, "h": 0}.get(details.unit, 3)
    return FloatProperty(**named, **lowest, subtype=subtype, precision=precision)


def read_properties(settings):
    """Values of these properties, by the names of the settings, with the effects that are switched
    on or off: dict.
    """
    states = {key: getattr(settings, name_switch(key)) for key in TABLE}
    values = {"effects": {key: state == "on" for key, state in states.items() if state != "auto"}}
    for name, default, details in _list_titled():
        value = getattr(settings, name)
        # Blender keeps numbers in single precision: 11.4 comes back as 11.3999996.
        value = float(f"{value:.6g}") if isinstance(value, float) else value
        if details.kind == "text" and not details.none:
            value = value or default  # what was cleared
        unset = (
            (UNSET,) if _left_to_program(details) else ("", details.none) if details.none else ()
        )
        values[name] = None if value in unset else value
    return values


def name_switch(key):
    """Name of the property that switches an effect."""
    return f"effect_{key.replace('-', '_')}"


def _suggest_modules(settings, context, text):
    """Names of modules that have all words of a text, the Sandia library's first: list of str."""
    from ...core.energy.pv_system import suggest_modules

    return suggest_modules(text)


class FindModule(Action, bpy.types.Operator):
    """Use the module whose name has these words, in pvlib's Sandia or CEC library"""

    bl_idname, bl_label = "citypv.find_module", "Find module"

    text: bpy.props.StringProperty(
        name="Name",
        description="Name or a part of it",
        search=_suggest_modules,
        search_options={"SUGGESTION"},
    )

    def invoke(self, context, event):
        """Ask for the name."""
        return context.window_manager.invoke_props_dialog(self, width=420)

    def act(self, context, city, ground):
        """Set the module."""
        from ...core.energy.pv_system import pick_module

        module = pick_module(self.text)
        context.scene.citypv.module = module.name
        return f"{module.name}: {module.nominal_power:.0f} W, {module.area:.2f} m²"
