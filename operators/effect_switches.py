"""The switches of the plan of effects: one for each line of `core.effects.table`."""

from bpy.props import EnumProperty

from ..core.effects.table import TABLE

STATES = (
    ("auto", "Auto", "As the plan decides for the city"),
    ("on", "On", "Always"),
    ("off", "Off", "Never"),
)
ELECTRIC = ("aoi", "spectrum", "temperature")  # effects of the step Energy
OF_LIGHT = tuple(key for key in TABLE if key not in ELECTRIC)  # of the step Trace


def name_switch(key):
    """Name of the property that switches an effect."""
    return f"effect_{key.replace('-', '_')}"


def build_switches():
    """Properties that switch the effects, by their names: dict."""
    return {
        name_switch(key): EnumProperty(name=row.title, description=row.words, items=STATES)
        for key, row in TABLE.items()
    }


def read_switches(settings):
    """Effects that the user has switched on or off: dict of str to bool."""
    chosen = {key: getattr(settings, name_switch(key)) for key in TABLE}
    return {key: state == "on" for key, state in chosen.items() if state != "auto"}
