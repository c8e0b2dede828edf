"""The commands about several states of a city: options of `citypv variant` and `citypv compare`, and what they run."""

import argparse
import sys

from .add_options import Gather, add_exports, add_output, join_pairs, list_exports, make_log


def add_states(commands):
    """Commands about several states of a city."""
    variant = commands.add_parser("variant", help="an edited city, from a run of simulate --editable, in seconds")
    variant.add_argument("base", metavar="BASE", help="result folder")
    add_change(variant)
    add_output(variant)
    add_exports(variant)
    variant.set_defaults(run=run_variant)
    compare = commands.add_parser("compare", help="who gains and who loses between two results of a city")
    for name in ("before", "after"):
        compare.add_argument(name, metavar=name.upper(), help="result folder of one state of a city")
    add_output(compare)
    compare.set_defaults(run=run_compare)


def add_change(parser):
    """What `citypv variant` changes."""
    place = parser.add_argument_group("the change")
    several = {"nargs": "+", "action": Gather, "default": []}
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


def run_variant(options):
    """`citypv variant`."""
    from .variant import Wish, make_variant
    from .write_run import Output

    move, raised, albedo_of = (
        join_pairs(option, getattr(options, name))
        for option, name in (("--move", "move"), ("--raise", "raised"), ("--albedo-of", "albedo_of"))
    )
    wish = Wish(options.add, options.remove, move, raised, albedo_of, options.local)
    output = Output(overwrite=options.overwrite, exports=list_exports(options))
    make_variant(options.base, options.out, wish, output=output, log=make_log(options))


def run_compare(options):
    """`citypv compare`."""
    from .compare import compare, describe_comparison

    found = compare(options.before, options.after, options.out, overwrite=options.overwrite)
    if not options.quiet:
        print("\n".join([*describe_comparison(found), f"Written to {options.out}"]), file=sys.stderr)
