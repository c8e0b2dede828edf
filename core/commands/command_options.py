"""The options of each command: arguments that are added to its parser, where it is the one that is
asked for.
"""

from ..results.words import list_languages
from ..settings.presets import NOT_FOR_WORLDS
from .add_options import add_change, add_city, add_cluster, add_options, add_output, add_world


def simulate_options(parser):
    """A whole run."""
    add_city(parser)
    add_output(parser, exports=True, detailed=True)
    add_options(parser, "weather", "electricity", "light", "sky", "effects", "run")
    add_cluster(parser, tiles=True)
    parser.add_argument("--blend", action="store_true", help="write city.blend (needs bpy)")
    parser.add_argument("--preview", action="store_true", help="write preview.png (needs bpy)")


def yield_options(parser):
    """Electricity of an earlier run."""
    parser.add_argument(
        "transfer", metavar="TRANSFER", help="folder of an earlier run, or its transfer.nc"
    )
    add_output(parser, detailed=True)
    add_options(parser, "surfaces", "weather", "electricity", "sky", "effects", "run")


def plot_options(parser):
    """Pictures of results."""
    parser.add_argument(
        "folder", metavar="DIR", help="folder that simulate, yield or world has written"
    )
    _add_words(parser)
    _add_private(parser)
    parser.add_argument("--quiet", action="store_true", help="print errors only")


def site_options(parser):
    """A solar map for the web."""
    parser.add_argument(
        "folder", nargs="+", metavar="DIR", help="folders that simulate or yield has written"
    )
    _add_words(parser)
    _add_private(parser, "the ids of buildings and surfaces, ")
    parser.add_argument(
        "--basemap",
        default="",
        metavar="URL",
        help="address of map tiles below the city, with {z}, {x} and {y}; the page then asks that "
        "server. Name its licence in --attribution",
    )
    add_output(parser)


def world_options(parser):
    """Places all over the world."""
    add_world(parser)
    add_output(parser)
    add_options(parser, "weather", "electricity", "sky", "run", hidden=NOT_FOR_WORLDS)
    add_cluster(parser)


def variant_options(parser):
    """An edited city."""
    parser.add_argument("base", metavar="BASE", help="result folder")
    add_change(parser)
    _add_private(parser)
    add_output(parser, exports=True)


def compare_options(parser):
    """Two results of a city."""
    for name in ("before", "after"):
        parser.add_argument(name, metavar=name.upper(), help="result folder of one state of a city")
    _add_language(parser)
    add_output(parser)


def inspect_options(parser):
    """What is read."""
    add_city(parser)
    _add_json(parser)


def effects_options(parser):
    """What a run simulates."""
    add_city(parser)
    add_options(parser, "weather", "electricity", "light", "sky", "effects", "run")
    _add_json(parser)


def accuracy_options(parser):
    """What errors cost."""
    effects_options(parser)
    parser.add_argument(
        "--plot", metavar="FILE", help="write the curve of error against time as a picture"
    )


def selfcheck_options(parser):
    """Checks of the tracer."""
    _add_json(parser)


def _add_private(parser, more=""):
    words = f"leave out {more}names and addresses of buildings"
    parser.add_argument("--private", action="store_true", help=words)


def _add_json(parser):
    parser.add_argument("--json", action="store_true", help="print as JSON")


def _add_words(parser):
    parser.add_argument("--title", default="", metavar="TEXT", help="heading of the page")
    parser.add_argument(
        "--attribution",
        default="",
        metavar="TEXT",
        help="source and licence of the city model; default: as its files say",
    )
    parser.add_argument(
        "--districts",
        metavar="FILE",
        help="polygons with a name, in place of those of the run: FILE or FILE:COLUMN",
    )
    _add_language(parser)


def _add_language(parser):
    parser.add_argument(
        "--language",
        default="en",
        choices=list_languages(),
        help="language of texts and numbers on the page: %(choices)s; default: %(default)s",
    )
