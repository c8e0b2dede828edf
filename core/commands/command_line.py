"""The command line: `citypv`, `python -m citypv` and `blender --command citypv` are this program.

Exit status: 0 success; 2 wrong arguments or invalid input; 130 interrupted, whether or not partial
results could be kept; 1 any other failure.
"""

import argparse
import importlib.util
import json
import signal
import sys
import threading
import traceback
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path

from ..run.run_log import RunLog, print_output
from ..settings.errors import InputError, show_signs
from ..settings.memory import GB, check_memory
from ..settings.progress import CancelledError, TerminalProgress
from ..settings.version import __version__
from . import command_options
from .add_options import join_pairs, settings_of_options
from .choose_settings import cluster_settings, request_of_settings


class _OneLineParser(argparse.ArgumentParser):
    """A parser that reports errors in one line."""

    def parse_known_args(self, args=None, namespace=None):
        """Refuse unknown arguments in the name of their command, so that its help is named."""
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def error(self, message):
        """Exit with status 2."""
        hint = (
            "give it before options of several values, such as --weather; "
            if "required: CITY" in message
            else ""
        )
        self.exit(2, f"{self.prog}: error: {message}; {hint}see {self.prog} --help\n")


def main(arguments=None, draw=None):
    """Run the command line.

    Parameters
    ----------
    arguments : list of str, optional
        Arguments without the program name; by default the process's own.
    draw : callable, optional
        `draw(folder, scene, transfer, energy, note, pictures)`: drawing by Blender, for `--blend`
        and `--preview`.

    Returns
    -------
    int
        Exit status: 0 done, 1 a failure of the program, 2 arguments or input that cannot be used,
        130 interrupted.
    """
    # UTF-8 in files and pipes, as JSON has to be; "?" for what a terminal cannot show.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(
            stream, "reconfigure"
        ):  # a program around this one may have put another there, or none
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="replace")
    given = _join_offset(sys.argv[1:] if arguments is None else arguments)
    parser = build_parser(next((word for word in given if word in COMMANDS), ""))
    # Without arguments the help is printed; arguments that cannot be parsed, and --help, end here.
    if not given:
        parser.print_help(sys.stderr)
        return 2
    try:
        options = parser.parse_args(given)
    except SystemExit as stop:
        return stop.code or 0
    # SIGTERM is treated like Ctrl-C, so that no partial output remains. Only the main thread can.
    main_thread = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, signal.default_int_handler) if main_thread else None
    try:
        # A machine without memory for the libraries of formats, numbers and light is told so. A
        # time budget begins with the log: before anything large is imported or compiled.
        check_memory(_name_input(options), "a run of any size", 4e8, "give it more memory")
        options.draw, options.log = (
            draw,
            RunLog(
                None if getattr(options, "quiet", False) else sys.stderr,
                verbose=getattr(options, "verbose", False),
            ),
        )
        return options.run(options) or 0
    except InputError as error:
        return _print_error(str(error), 2)
    except (KeyboardInterrupt, CancelledError) as stop:
        moment = " before the first suns were finished" if isinstance(stop, CancelledError) else ""
        return _print_error(f"interrupted{moment}; no results were written", 130)
    except Exception as error:
        return _print_error(_describe_failure(error, options), 1)
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _describe_failure(error, options):
    """What ended the run, in one line; after its traceback where nobody foresaw it."""
    if isinstance(error, MemoryError):
        return _describe_memory(options)
    if isinstance(error, ModuleNotFoundError) and error.name.split(".")[0] != "citypv":
        return f"the Python package {error.name} is missing; see docs/guide/install.md"
    if isinstance(error, OSError):
        return f"{error.filename or 'system'}: {error.strerror or error}"
    traceback.print_exc()
    return "internal error; please report the lines above"


def _describe_memory(options):
    """Say in one line that the memory is gone, and for which files."""
    from ..results.write_summary import peak_memory

    used = peak_memory()
    words = "needs more memory than there is" + (f": {used / GB:.1f} GB were taken" if used else "")
    return f"{_name_input(options)}: {words}; give it more memory, or a part of the city"


def _name_input(options):
    """What a command was given to read, for messages."""
    names = ("city", "folder", "transfer", "base")
    given = next((getattr(options, name) for name in names if hasattr(options, name)), "")
    return ", ".join(map(str, given)) if isinstance(given, list) else given or "citypv"


def _print_error(message, status):
    """Print an error in one line to stderr, and return the exit status."""
    renew = "\r\x1b[2K" if sys.stderr.isatty() else ""  # clears the line of an unfinished stage
    print(f"{renew}citypv: error: {show_signs(' '.join(message.split()))}", file=sys.stderr)
    return status


def build_parser(asked=None):
    """Parser of all commands, whose options are added for the command that is asked for; None: for
    every one.
    """
    parser = _OneLineParser(
        prog="citypv",
        description="Irradiance and PV yield of the roofs and facades of a city.",
        epilog=(
            "docs/guide/command_line.md shows how to go on, "
            "docs/reference/files.md what is written."
        ),
    )
    parser.add_argument("--version", action="version", version=f"citypv {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, (run, words) in COMMANDS.items():
        command = commands.add_parser(name, help=words)
        command.set_defaults(run=run)
        if asked in (None, name):
            getattr(command_options, f"{name}_options")(command)
    return parser


def _run_simulate(options):
    """`citypv simulate`: status 130 if it was interrupted and partial results were kept."""
    pictures = [name for name in ("blend", "preview") if getattr(options, name)]
    for name in pictures:
        if options.draw is None or importlib.util.find_spec("bpy") is None:
            raise InputError(
                f"--{name}", "needs Blender's Python module", "type: pip install '.[blender]'"
            )
    request = read_request(options)
    from ..run.simulate import simulate
    from ..run.write_run import Output

    draw = partial(options.draw, pictures=pictures) if pictures else None
    output = Output(overwrite=options.overwrite, exports=options.exports, draw=draw)
    tiles = cluster_settings(options.cluster, options.tile)
    interrupted = simulate(
        options.city, options.out, request, output=output, log=options.log, cluster=tiles
    )
    _print_summary(options)
    if not interrupted:
        return 0
    print(interrupted, file=sys.stderr)
    return 130


def _run_yield(options):
    """`citypv yield`."""
    from ..run.simulate import recompute

    recompute(
        options.transfer,
        options.out,
        read_request(options),
        overwrite=options.overwrite,
        log=options.log,
    )
    _print_summary(options)


def _run_world(options):
    """`citypv world`."""
    from ..run.make_world import WorldSettings, make_world

    chosen = {field.name: getattr(options, field.name) for field in fields(WorldSettings)}
    settings = WorldSettings(**chosen | {"pictures": options.pictures == "on"})
    make_world(
        options.environment,
        options.out,
        read_request(options),
        settings,
        overwrite=options.overwrite,
        log=options.log,
        cluster=cluster_settings(options.cluster),
    )


def _run_variant(options):
    """`citypv variant`."""
    from ..run.variant import Change, make_variant
    from ..run.write_run import Output

    move, raised, albedo_of = (
        join_pairs(option, getattr(options, name))
        for option, name in (
            ("--move", "move"),
            ("--raise", "raised"),
            ("--albedo-of", "albedo_of"),
        )
    )
    told = move, raised, albedo_of, options.local, options.private
    change = Change(options.add, options.remove, *told)
    output = Output(overwrite=options.overwrite, exports=options.exports)
    make_variant(options.base, options.out, change, output=output, log=options.log)


def _run_compare(options):
    """`citypv compare`."""
    from ..results.compare import compare, describe_comparison

    named = {"language": options.language, "overwrite": options.overwrite}
    comparison = compare(options.before, options.after, options.out, **named)
    options.log.write("\n".join([*describe_comparison(comparison), f"Written to {options.out}"]))


def _run_plot(options):
    """`citypv plot`."""
    from .show import plot_results

    names = ("title", "attribution", "language", "districts", "private")
    words = {name: getattr(options, name) for name in names}
    options.log.write(f"Written to {', '.join(map(str, plot_results(options.folder, **words)))}")


def _run_site(options):
    """`citypv site`."""
    from ..results.write_site import NO_LICENCE, write_site

    named = {
        name: getattr(options, name)
        for name in (
            "title",
            "attribution",
            "private",
            "language",
            "districts",
            "basemap",
            "overwrite",
        )
    }
    site, log = write_site(options.folder, options.out, **named), options.log
    log.write("{buildings:,} buildings, {surfaces:,} surfaces: {files:,} files".format(**site))
    if not options.attribution:
        log.write(f"{NO_LICENCE} Give --attribution.")
    log.write(f"Written to {options.out} ({site['bytes'] / 1e6:,.1f} MB)")


def _run_inspect(options):
    """`citypv inspect`."""
    from .inspect_city import describe_city, inspect_city

    report = inspect_city(options.city, read_request(options), TerminalProgress(lasting=False))
    _print_found(options, report, describe_city(report))


def _run_effects(options):
    """`citypv effects`."""
    from .show import list_effects

    plan = list_effects(options.city, read_request(options), TerminalProgress(lasting=False))
    _print_found(options, [asdict(effect) for effect in plan.effects], plan.describe())


def _run_accuracy(options):
    """`citypv accuracy`."""
    request = read_request(options)
    from ..accuracy.yield_errors import SOURCES
    from .show import show_accuracy

    curve = show_accuracy(options.city, request, options.plot)
    words = {"sources": SOURCES, "unit": "s, percent of full load hours"}
    _print_found(options, asdict(curve) | words, curve.describe())


def _run_selfcheck(options):
    """`citypv selfcheck`: status 1 if a check fails."""
    from .selfcheck import describe_check, report_checks, selfcheck

    checks = selfcheck(None if options.json else lambda check: print_output(describe_check(check)))
    report, failed = report_checks(checks), sum(not check.passed for check in checks)
    outcome = f"{failed} FAILED" if failed else "all passed"
    _print_found(options, report, [f"{len(checks)} checks in {report['seconds']:.1f} s: {outcome}"])
    return int(failed > 0)


def _print_summary(options):
    """Print summary.json of what was written, where JSON is asked for."""
    if options.json:
        print_output(Path(options.out, "summary.json").read_text("utf-8"))


def _print_found(options, found, lines):
    """Print what a command found: as JSON where that is asked for, else as lines of text."""
    from ..results.write_summary import finite

    print_output(
        json.dumps(finite(found), indent=2, ensure_ascii=False)
        if options.json
        else "\n".join(lines)
    )


def read_request(options):
    """Checked settings that the options ask for: Request."""
    return request_of_settings(settings_of_options(options))


def _join_offset(arguments):
    """The arguments, with an offset such as -05:00 joined to its option, which it would seem to
    follow as another.
    """
    joined = list(arguments)
    for place in [row for row, text in enumerate(joined[:-1]) if text == "--time-axis"][::-1]:
        joined[place : place + 2] = [f"--time-axis={joined[place + 1]}"]
    return joined


# name -> (function that runs it, what it does); its options stand in command_options
COMMANDS = {
    "simulate": (_run_simulate, "trace a city and write full load hours of every surface"),
    "yield": (_run_yield, "compute the yield of a transfer.nc with other weather or modules"),
    "plot": (_run_plot, "draw the results of a folder: report.html, or the maps of a world"),
    "site": (_run_site, "a city's solar map for a web server: 3D Tiles, an index, a page"),
    "world": (_run_world, "full load hours of traced districts all over the world"),
    "variant": (_run_variant, "an edited city, from a run of simulate --editable, in seconds"),
    "compare": (_run_compare, "who gains and who loses between two results of a city"),
    "inspect": (_run_inspect, "report what is read, repaired and left out, and where it is"),
    "effects": (_run_effects, "list which effects a run on this city simulates, and why"),
    "accuracy": (_run_accuracy, "predict seconds and errors of each setting from a short pilot"),
    "selfcheck": (_run_selfcheck, "check the tracer against closed forms and hard cases"),
}
