"""Command line options: from the settings that `Request` declares, and for single commands."""

import argparse
from itertools import chain

from ..results.exports import EXPORTS
from ..settings.errors import InputError
from ..settings.request import declared_settings, option_of

TITLES = {
    "city": "the city",
    "surfaces": "the surfaces that count",
    "weather": "the weather",
    "electricity": "the modules, and the area that counts",
    "light": "the light",
    "sky": "the sky",
    "effects": "the effects",
    "run": "the run",
}
SWITCH = {"on": True, "off": False}


def add_options(parser, *groups, hidden=()):
    """Add the options of some groups of settings to a parser.

    Parameters
    ----------
    parser : argparse.ArgumentParser
    *groups : str
        Names of groups: city, surfaces, weather, electricity, light, sky, effects, run.
    hidden : tuple of str
        Settings that the help does not list, since they are refused.
    """
    for group in groups:
        place = parser.add_argument_group(TITLES[group])
        for name, default, details in declared_settings(group):
            if details.option != "":
                unit = f"[{details.unit}] " if details.unit else ""
                shown = ("off", "on")[default] if details.kind == "switch" else default
                stated = (
                    details.kind not in ("flag", "names", "pairs", "shares") and default is not None
                )
                words = (unit + details.words + (f" ({shown})" if stated else "")).replace(
                    "%", "%%"
                )
                words = argparse.SUPPRESS if name in hidden else words
                # What is not given, method, preset and the defaults tell.
                place.add_argument(
                    option_of(name),
                    dest=name,
                    help=words,
                    default=argparse.SUPPRESS,
                    **_argument_of_setting(details),
                )


def _argument_of_setting(details):
    """Keywords of `add_argument` for a setting: dict."""
    many = {"nargs": "+", "action": "extend", "metavar": details.metavar}
    share = _keyed(float, "KEY=SHARE")  # several in one text: facade=0.6,roof=0.8
    shapes = {
        "flag": {"action": "store_true"},
        "switch": {"choices": tuple(SWITCH), "metavar": "on|off"},
        "choice": {"choices": tuple(details.choices)},
        "texts": many,
        "names": many,
        "pairs": many | {"type": _keyed(SWITCH.__getitem__, "KEY=on or KEY=off")},
        "shares": many
        | {"type": lambda text: [share(part) for part in filter(None, text.split(","))]},
        "place": {"nargs": 2, "type": float, "metavar": ("LATITUDE", "LONGITUDE")},
    }
    kind = {"number": float, "integer": int}.get(details.kind, str)
    plain = {
        "type": _or_none(kind, details.none) if details.none else kind,
        "metavar": details.metavar,
    }
    return shapes.get(details.kind, plain)


def _or_none(kind, word):
    """A type for `add_argument` in which a word means None."""

    def parse(text):
        return None if text == word else kind(text)

    parse.__name__ = kind.__name__  # for argparse's message: "invalid float value"
    return parse


def _keyed(read, words):
    """A type for `add_argument`: KEY=VALUE → (key, read(value)); `words` say what is expected."""

    def parse(text):
        try:
            key, value = text.rsplit("=", 1)
            return key.strip(), read(value)
        except (KeyError, ValueError):
            raise argparse.ArgumentTypeError(f"{text!r} is not {words}") from None

    return parse


def _two_numbers(text):
    """Of "3,-4": (3.0, -4.0)."""
    first, second = map(float, text.split(","))
    return first, second


def join_pairs(option, pairs):
    """Values by key: dict of a list of (str, value).

    Raises
    ------
    InputError
        A key has two different values.
    """
    values = {}
    for key, value in pairs:
        if values.setdefault(key, value) != value:
            first, second = (
                ("off", "on")[one] if isinstance(one, bool) else one for one in (values[key], value)
            )
            raise InputError(
                option, f"{key} is given as {first} and as {second}", "give each key once"
            )
    return values


def settings_of_options(options):
    """Settings that were given as options, by name: dict.

    Raises
    ------
    InputError
        A key has two different values.
    """
    given = {}
    for name, _, details in declared_settings():
        if hasattr(options, name):
            value = getattr(options, name)
            if details.kind == "switch":
                value = SWITCH[value]
            elif details.kind in ("pairs", "shares"):
                value = join_pairs(
                    option_of(name), value if details.kind == "pairs" else chain(*value)
                )
            given[name] = value
    return given


def add_cluster(parser, *, tiles=False):
    """Add `--cluster`, and for a city `--tile`."""
    place = parser.add_argument_group("many machines")
    words = (
        "work in tasks: local:N workers here, tcp://HOST:PORT of a Dask scheduler, or serial: this "
        "process"
    )
    place.add_argument("--cluster", metavar="WORD", help=words)
    if tiles:
        place.add_argument(
            "--tile",
            type=float,
            metavar="M",
            help="[m] side of the tiles that --cluster traces (1000)",
        )


def add_city(parser):
    """Input files, and options for reading them."""
    parser.add_argument(
        "city",
        nargs="+",
        metavar="CITY",
        help="CityGML, CityJSON, OBJ or GeoJSON files, or folders of them",
    )
    add_options(parser, "city", "surfaces")


def add_output(parser, *, exports=False, detailed=False):
    """Options for the output folder, for files that are written when they are asked for, and for
    what is printed.
    """
    output = parser.add_argument_group("the results")
    output.add_argument("--out", required=True, metavar="DIR", help="folder to write")
    output.add_argument(
        "--overwrite", action="store_true", help="replace results in a folder that is not empty"
    )
    output.add_argument("--quiet", action="store_true", help="print errors only")
    if detailed:
        output.add_argument(
            "--verbose", action="store_true", help="print why each effect is simulated or not"
        )
        output.add_argument(
            "--json", action="store_true", help="print summary.json on standard output"
        )
    for name, export in EXPORTS.items() if exports else ():
        listed = {"action": "append_const", "dest": "exports", "const": name, "default": []}
        output.add_argument(f"--{name}", help=f"write {export.file}: {export.words}", **listed)


def add_world(parser):
    """Add the options of `citypv world` to a parser: environments and mixes of them, way of the
    sun, distance and range of places, years, most surfaces, what stands at sea, and pictures.
    """
    # Options of `citypv world`: traced cities first, then the places, years and pictures.
    words = "transfer.nc or result folder of simulate --suns sky-grid:N, NAME=PATH, or unshaded"
    parser.add_argument("environment", nargs="+", metavar="ENVIRONMENT", help=words)
    place = parser.add_argument_group("the world")
    degrees = {"nargs": 2, "type": float}
    place.add_argument(
        "--way",
        choices=("exact", "paper"),
        help="sun of each place, or of Greenwich, shifted (exact)",
    )
    place.add_argument(
        "--mix", metavar="NAME=SHARE,…", help="weighted mean of environments as a further one"
    )
    place.add_argument(
        "--step", type=float, metavar="D", help="[°] distance of places (3; files: all points)"
    )
    place.add_argument(
        "--latitudes", metavar=("SOUTH", "NORTH"), help="[°] range (-60 90; files: all)", **degrees
    )
    place.add_argument(
        "--longitudes", metavar=("WEST", "EAST"), help="[°] range (-180 180; files: all)", **degrees
    )
    place.add_argument(
        "--years",
        nargs="+",
        type=int,
        default=[],
        action="extend",
        metavar="Y",
        help="averaged (all)",
    )
    words = "merge surfaces of similar light, to at most N per environment"
    place.add_argument("--surfaces", type=int, metavar="N", help=words)
    place.add_argument(
        "--off-land", choices=("blank", "climate", "clear-sky"), default="blank", help="at sea"
    )
    place.add_argument(
        "--pictures", choices=("on", "off"), default="on", help="draw maps and figures (on)"
    )


def add_change(parser):
    """What `citypv variant` changes."""
    place = parser.add_argument_group("the change")
    several = {"nargs": "+", "action": "extend", "default": []}
    place.add_argument(
        "--add",
        metavar="FILE",
        help="buildings or trees, in the base's reference system",
        **several,
    )
    place.add_argument(
        "--local", action="store_true", help="files are in metres from the base's local origin"
    )
    place.add_argument("--remove", metavar="ID", help="buildings, or trees", **several)
    two, one = _keyed(_two_numbers, "ID=NUMBER,NUMBER"), _keyed(float, "ID=NUMBER")
    place.add_argument(
        "--move", metavar="ID=EAST,NORTH", type=two, help="[m] to true east and north", **several
    )
    words = "[m] by which all of a building above its foot goes up, or down"
    place.add_argument("--raise", metavar="ID=M", dest="raised", type=one, help=words, **several)
    words = "albedo of all surfaces of a building"
    place.add_argument("--albedo-of", metavar="ID=A", type=one, help=words, **several)
