"""The switches of the plan of effects: one for each line of `core.effects.table`."""

from pathlib import Path

from bpy.props import EnumProperty

from ..core import effects
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
        name_switch(key): EnumProperty(name=name_effect(key), description=describe_effect(key), items=STATES)
        for key in TABLE
    }


def name_effect(key):
    """Title of an effect."""
    return key.replace("-", " ").capitalize() if key != "aoi" else "Incidence angle"


def describe_effect(key):
    """What an effect is: the first sentence of its file, which is not imported for this."""
    path = Path(effects.__path__[0], f"{key.replace('-', '_')}.py")
    with path.open(encoding="utf-8") as file:
        sentence = file.readline()
    return sentence.strip().strip('"').partition(": ")[2].rstrip(".").capitalize()


def read_switches(settings):
    """Effects that the user has switched on or off: dict of str to bool."""
    chosen = {key: getattr(settings, name_switch(key)) for key in TABLE}
    return {key: state == "on" for key, state in chosen.items() if state != "auto"}
