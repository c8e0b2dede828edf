"""Command line options: from the settings that `Request` declares, and those of single commands."""

import argparse
import sys

from ..settings.errors import InputError
from ..settings.request import declared_settings, option_of
from .choose_settings import EXPORTS
from .run_log import RunLog

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
# Of these groups, settings that mean nothing for a world.
NOT_FOR_WORLDS = ("series", "monthly", "losses", "inverter", "allow_distance", "weather_point")


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
                place.add_argument(
                    option_of(name),
                    dest=name,
                    help=argparse.SUPPRESS if name in hidden else describe_setting(default, details),
                    default=argparse.SUPPRESS,  # what is not given, method, preset and the defaults tell
                    **argument_of_setting(details),
                )


def argument_of_setting(details):
    """Keywords of `add_argument` for a setting: dict."""
    many = {"nargs": "+", "action": "extend", "metavar": details.metavar}
    shapes = {
        "flag": {"action": "store_true"},
        "switch": {"type": switch, "metavar": "on|off"},
        "choice": {"choices": tuple(details.choices or ())},
        "texts": many,
        "names": many,
        "pairs": many | {"type": pair},
        "shares": many | {"type": shares},
        "place": {"nargs": 2, "type": float, "metavar": ("LATITUDE", "LONGITUDE")},
    }
    if details.kind in shapes:
        return shapes[details.kind]
    kinds = {"number": float, "integer": int, "text": str}
    return {
        "type": or_none(kinds[details.kind], details.none) if details.none else kinds[details.kind],
        "metavar": details.metavar,
    }


def describe_setting(default, details):
    """Help of an option: unit, meaning, default."""
    unit = f"[{details.unit}] " if details.unit else ""
    shown = {True: "on", False: "off"}.get(default, default) if details.kind == "switch" else default
    stated = details.kind not in ("flag", "names", "pairs", "shares") and default is not None
    return (unit + details.words + (f" ({shown})" if stated else "")).replace("%", "%%")


def or_none(kind, word):
    """A type for `add_argument` in which a word means None."""

    def parse(text):
        return None if text == word else kind(text)

    parse.__name__ = kind.__name__  # for argparse's message: "invalid float value"
    return parse


def switch(text):
    """True for on, False for off."""
    if text not in ("on", "off"):
        raise argparse.ArgumentTypeError(f"{text!r} is not on or off")
    return text == "on"


def pair(text):
    """A key and whether it is on."""
    key, _, state = text.partition("=")
    if state not in ("on", "off"):
        raise argparse.ArgumentTypeError(f"{text!r} is not KEY=on or KEY=off")
    return key, state == "on"


def shares(text):
    """Shares by key: "facade=0.6,roof=0.8" -> list of (str, float)."""
    found = []
    for part in filter(None, text.split(",")):
        key, _, share = part.partition("=")
        try:
            found.append((key.strip(), float(share)))
        except ValueError:
            raise argparse.ArgumentTypeError(f"{part!r} is not KEY=SHARE") from None
    return found


def join_pairs(option, pairs):
    """Values by key.

    Parameters
    ----------
    option : str
    pairs : list of (str, value)

    Returns
    -------
    dict

    Raises
    ------
    InputError
        A key has two different values.
    """
    found = {}
    for key, value in pairs:
        if found.setdefault(key, value) != value:
            first, second = (("off", "on")[one] if isinstance(one, bool) else one for one in (found[key], value))
            raise InputError(option, f"{key} is given as {first} and as {second}", "give each key once")
    return found


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
            if details.kind == "shares":
                value = [pair for pairs in value for pair in pairs]
            given[name] = join_pairs(option_of(name), value) if details.kind in ("pairs", "shares") else value
    return given


def add_cluster(parser, *, tiles=False):
    """Add `--cluster`, and for a city `--tile`."""
    place = parser.add_argument_group("many machines")
    place.add_argument(
        "--cluster",
        metavar="WORD",
        help="work in tasks: local:N workers here, tcp://HOST:PORT of a Dask scheduler, or serial: this process",
    )
    if tiles:
        place.add_argument("--tile", type=float, metavar="M", help="[m] side of the tiles that --cluster traces (1000)")


def add_city(parser):
    """Input files, and options for reading them."""
    parser.add_argument("city", nargs="+", metavar="CITY", help="CityGML, CityJSON or OBJ files, or folders of them")
    add_options(parser, "city", "surfaces")


def add_output(parser, *, exports=False):
    """Output options, and those of files that are written when they are asked for."""
    output = parser.add_argument_group("the results")
    output.add_argument("--out", required=True, metavar="DIR", help="folder to write")
    output.add_argument("--overwrite", action="store_true", help="replace results in a folder that is not empty")
    output.add_argument("--quiet", action="store_true", help="print errors only")
    for name, words in EXPORTS.items() if exports else ():
        output.add_argument(f"--{name}", action="store_true", help=f"write {words}")


def add_world(parser):
    """Environments and places."""
    parser.add_argument(
        "environment",
        nargs="+",
        metavar="ENVIRONMENT",
        help="transfer.nc or result folder of simulate --suns sky-grid:N, NAME=PATH, or unshaded",
    )
    place = parser.add_argument_group("the world")
    degrees = {"nargs": 2, "type": float}
    place.add_argument("--way", choices=("exact", "paper"), help="sun of each place, or of Greenwich, shifted (exact)")
    place.add_argument("--mix", metavar="NAME=SHARE,…", help="weighted mean of environments as a further one")
    place.add_argument("--step", type=float, metavar="D", help="[°] distance of places (3; files: all points)")
    place.add_argument("--latitudes", metavar=("SOUTH", "NORTH"), help="[°] range (-60 90; files: all)", **degrees)
    place.add_argument("--longitudes", metavar=("WEST", "EAST"), help="[°] range (-180 180; files: all)", **degrees)
    place.add_argument("--years", nargs="+", type=int, default=[], action="extend", metavar="Y", help="averaged (all)")
    place.add_argument(
        "--surfaces", type=int, metavar="N", help="merge surfaces of similar light, to at most N per environment"
    )
    place.add_argument("--off-land", choices=("blank", "climate", "clear-sky"), default="blank", help="at sea")
    place.add_argument("--pictures", choices=("on", "off"), default="on", help="draw maps and figures (on)")


def add_change(parser):
    """What `citypv variant` changes."""
    place = parser.add_argument_group("the change")
    several = {"nargs": "+", "action": "extend", "default": []}
    place.add_argument("--add", metavar="FILE", help="buildings or trees, in the base's reference system", **several)
    place.add_argument("--local", action="store_true", help="files are in metres from the base's local origin")
    place.add_argument("--remove", metavar="ID", help="buildings, or trees", **several)
    words = "[m] to true east and north"
    place.add_argument("--move", metavar="ID=EAST,NORTH", type=numbers_of_id(2), help=words, **several)
    words = "[m] by which all of a building above its foot goes up, or down"
    place.add_argument("--raise", metavar="ID=M", dest="raised", type=numbers_of_id(1), help=words, **several)
    words = "albedo of all surfaces of a building"
    place.add_argument("--albedo-of", metavar="ID=A", type=numbers_of_id(1), help=words, **several)


def numbers_of_id(count):
    """A type for `add_argument`: ID=NUMBER,… → (id, number) or (id, tuple of numbers)."""

    def parse(text):
        name, _, words = text.rpartition("=")
        try:
            numbers = tuple(map(float, words.split(",")))
        except ValueError:
            numbers = ()
        if not name or len(numbers) != count:
            raise argparse.ArgumentTypeError(f"{text!r} is not ID={','.join(['NUMBER'] * count)}")
        return name, numbers if count > 1 else numbers[0]

    return parse


def list_exports(options):
    """Files that are asked for: tuple of str."""
    return tuple(name for name in EXPORTS if getattr(options, name))


def make_log(options):
    """RunLog to stderr, or one that is silent."""
    return RunLog(None if options.quiet else sys.stderr)
