"""Declaration of a setting: default, unit, range and help text in one place."""

from dataclasses import dataclass, field
from functools import partial

from .errors import InputError


@dataclass(frozen=True)
class Setting:
    """Option name, help text and valid values of one setting."""

    # city, surfaces, weather, electricity, light, effects or run: selects the commands that have it
    group: str
    words: str  # help text, for --help and tooltips
    # text, texts, names, number, integer, choice, switch (on|off), flag, pairs (KEY=on|off …),
    # shares, place
    kind: str = ""  # "": as the field's type and choices tell
    # label in Blender's panel; "": the field's name where `panel` is given, else it is not shown
    # there
    title: str = ""
    unit: str = ""
    option: str | None = None  # on the command line; None: the field's name; "": no option
    metavar: str | None = None  # in --help; None: by unit
    choices: dict | tuple = ()  # values; value -> help text of those that Blender shows
    least: float | None = None  # smallest value
    most: float | None = None  # largest value
    above: float | None = None  # exclusive lower bound
    none: str = ""  # word for None on the command line, if users may give it
    # panel of Blender's sidebar that shows it: import, classify, trace, sampling, energy; "": none
    panel: str = ""


def setting(default, words, *, group, **details):
    """A field of Request: its default, and the further fields of `Setting`."""
    metadata = {"setting": Setting(group, words, **details)}
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


of_city, of_weather, of_light, of_electricity, of_run = (
    partial(setting, group=group) for group in ("city", "weather", "light", "electricity", "run")
)


def check_number(option, value, details):
    """Raise an error if a number is out of range, or not an integer where one is needed."""
    whole = details.kind == "integer"
    words = "a whole number" if whole else "a number"
    if details.above is not None:
        words += f" above {details.above:g}"
    elif details.least is not None:
        least, most = details.least, details.most
        words += f" of at least {least:g}" if most is None else f" from {least:g} to {most:g}"
    unit = f" [{details.unit}]" if details.unit else ""
    cure = f"give {words}{unit}{f', or {details.none}' if details.none else ''}"
    if whole and not float(value).is_integer():
        raise InputError(option, f"{value} is not a whole number", cure)
    # Compared so that NaN fails too.
    inside = (details.least is None or value >= details.least) and (
        details.most is None or value <= details.most
    )
    if not (inside and (details.above is None or value > details.above)):
        raise InputError(option, f"{value} is out of range", cure)


def check_place(option, place):
    """Refuse two numbers that are no latitude and longitude."""
    for noun, value, most in zip(("latitude", "longitude"), place, (90, 180), strict=True):
        if not abs(value) <= most:  # also true for NaN
            raise InputError(
                option,
                f"a {noun} of {value} is out of range",
                f"give degrees from -{most} to {most}",
            )
