"""Options that name who does the work: one process, or the workers of a Dask cluster."""

from ..settings.errors import InputError


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


def cluster_of_options(options):
    """What the options ask for: ClusterSettings, or None without `--cluster`.

    Raises
    ------
    InputError
        Tiles without `--cluster`.
    """
    tile = getattr(options, "tile", None)
    if options.cluster is None:
        if tile is not None:
            raise InputError(
                "--tile", "is for cities traced in tiles", "give --cluster local:N or --cluster serial too"
            )
        return None
    from ..cluster.trace_tiles import ClusterSettings

    return ClusterSettings(options.cluster) if tile is None else ClusterSettings(options.cluster, tile)
