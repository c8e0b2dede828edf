"""What a run says of itself, and the seconds of its stages."""

import os
import sys
import time
from pathlib import Path

from ..settings.errors import count_of, list_some, show_number, show_signs
from ..settings.progress import Clock, TerminalProgress, describe_duration, silent


class RunLog:
    """Prints messages, and measures the seconds of each stage.

    Parameters
    ----------
    stream : text stream, optional
        For messages, and for progress where nothing else receives it.
    progress : callable, optional
        See `core.settings.progress`.
    verbose : bool
        Whether details are printed too.
    """

    def __init__(self, stream=None, progress=silent, *, verbose=False):
        self.stream, self.verbose = stream, verbose
        self.progress = TerminalProgress(stream) if stream else progress
        self.clock, self.started = Clock(), time.monotonic()

    def write(self, text):
        """Print one line."""
        if self.stream:
            print(show_signs(text), file=self.stream, flush=True)

    def detail(self, text):
        """Print a line for who wants to know how results come about."""
        if self.verbose:
            self.write(text)

    def show(self, transfer):
        """Receive the Transfer of all rounds so far, after each of them."""


def print_output(text):
    """Print text and a line end; what a reader who has left does not take is dropped.

    Parameters
    ----------
    text : str
    """
    try:
        print(show_signs(text), flush=True)
    except BrokenPipeError:
        # Otherwise the interpreter flushes the buffer once more at its end, and reports the error
        # there.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from error


def report_outcome(log, folder, energy, totals, report=None):
    """Write to the log the groups' full load hours, the totals (of summary.json) and the folder of
    the results.

    An ImportReport, where there is one, tells buildings without a shape.
    """
    from ..city.choose_levels import SHAPELESS
    from ..energy.counted_area import LEFT_OUT
    from ..results.describe_run import describe_detail, describe_strings
    from ..results.read_results import kind_title

    # Hours of each group, and its size; a line says if there is none.
    interval = energy.interval.total_seconds() / 3600  # [h]
    hours = energy.capacity_factor.sum(axis=0) * interval / energy.years  # (groups,) [h]
    groups = zip(energy.groups, hours, energy.group_count, energy.group_area, strict=True)
    for (kind, orientation), full_load_hours, count, area in groups:
        name = f"{kind_title(kind).lower()} {orientation}".removesuffix(" none")
        log.write(
            f"  {name}: {full_load_hours:.0f} h, {count_of(count, 'surface')}, {area:,.0f} m²"
        )
    if not len(energy.groups):
        log.write(
            "  no surface carries modules: groups.csv is empty; faces.csv has the hours of "
            "every surface"
        )
    # Hours, surfaces, nominal power and energy of all, then of each kind that has modules.
    for kind, one in {"all": totals, **totals["kinds"]}.items():
        if one["kwp"] > 0:
            name = kind if kind == "all" else kind_title(kind).lower()
            power = f"{one['kwp']:,.0f} kWp, {one['mwh_per_year']:,.0f} MWh a year"
            log.write(
                f"  {name}: {one['full_load_hours']:.0f} h, {count_of(one['count'], 'surface')}, "
                f"{power}"
            )
    # With modules in rows, what every square metre would give is told, too.
    if totals["layout"] == "rows":
        every = totals["every_square_metre"]
        log.write(
            f"  {totals['module_count']:,.0f} modules in rows; on every square metre (--layout "
            f"area) {every['kwp']:,.0f} kWp, {every['mwh_per_year']:,.0f} MWh a year"
        )
    # What carries no modules, and why; what counts though it is dark; what blocks without roofs
    # mean for the sums; buildings without any shape, by name.
    for key, one in totals["without_modules"].items():
        if not one["count"] and one["area"] < 1:
            continue
        log.write(
            f"  without modules: {count_of(one['count'], 'surface')}, {one['area']:,.0f} m²: "
            f"{LEFT_OUT[key]}"
        )
    # What strings of modules lose in shade.
    log.write(f"  {describe_strings(totals)}")
    if (dark := totals["dark"])["count"]:
        log.write(
            f"  in the dark all year, counted: {count_of(dark['count'], 'surface')}, "
            f"{dark['area']:,.0f} m²"
        )
    for line in describe_detail(vars(report)) if report else ():
        log.write(f"  {line}")
    for reason, names in report.skipped.items() if report else ():
        if reason.startswith(SHAPELESS):
            told = list_some(names, 5)
            log.write(
                f"  {count_of(len(names), 'building')}, {reason.removeprefix('building ')}: {told}"
            )
    # At the end the time that it took, and the files that were written.
    took = describe_duration(sum(log.clock.seconds.values()))
    names = sorted(path.name for path in Path(folder).iterdir())
    log.write(f"Written to {folder} in {took}: {', '.join(names)}")


def describe_overrun(request, log):
    """Say by what the time budget was exceeded, and what would take less: lines of text, none if it
    was kept.
    """
    took = time.monotonic() - log.started
    if request.time_budget is None or took <= request.time_budget:
        return []
    words = ", ".join(
        f"{seconds:.1f} s for {stage}" for stage, seconds in log.clock.seconds.items()
    )
    return [
        f"--time-budget {request.time_budget:g} was exceeded: the run took {took:.1f} s, {words}",
        "  a larger --patch-size or fewer --suns take less",
    ]


def tell_next(log, *commands):
    """Name the commands that a run leads to: (command, what it does) each."""
    for command, words in commands:
        log.write(f"Next: citypv {command}  # {words}")


def describe_scene(scene):
    """Counts and place as lines of text."""

    report, site = scene.report, scene.site
    kinds = ", ".join(
        f"{(scene.surfaces.kind == kind).sum():,} {kind}"
        for kind in sorted(set(scene.surfaces.kind))
    )
    lines = [
        f"{count_of(report.building_count, 'building')}, {count_of(report.part_count, 'part')}, "
        f"{count_of(len(scene.surfaces), 'surface')}: {kinds}",
        f"{len(scene.triangles):,} triangles, {(scene.surface_of_triangle < 0).sum():,} of them "
        "ground",
        f"latitude {show_number(site.latitude, 4)}°, longitude {show_number(site.longitude, 4)}°, "
        "grid north at "
        f"{show_number(site.convergence, 3, plus=True)}°",
    ]
    lines += [f"skipped {len(ids):,}: {reason}" for reason, ids in report.skipped.items()]
    lines += [
        f"repaired {count_of(len(ids), 'surface')}: {reason}"
        for reason, ids in report.repaired.items()
    ]
    return lines + list(report.notes)


def describe_extent(city):
    """A line on a city so wide that its ground and rays take long, before they do: list of str."""
    plan = city.points[:, :2]
    width = (plan.max(axis=0) - plan.min(axis=0)) / 1000  # [km]
    # A run of 30 km across or more says so before its ground is laid.
    if width.max() < 30.0:
        return []
    hints = [note for note in city.report.notes if "--unit" in note or "--up" in note]
    words = f"{width[0]:,.0f} × {width[1]:,.0f} km: a scene this wide takes minutes."
    return [
        f"{words} If the city is smaller, check --unit and where its outermost buildings stand.",
        *hints,
    ]


def describe_weather(weather, site):
    """The weather as lines of text: its label, its distance from the city, and notes."""

    told = "; ".join(filter(None, (weather.label, weather.describe_distance(site))))
    return "\n".join([f"Weather: {told}", *(f"  {note}" for note in weather.notes)])


def describe_interruption(record):
    """The suns on which an interrupted Transfer is based, and the resulting error; "" for a
    complete one.
    """
    if record.interrupted is None:
        return ""
    line = "Interrupted: kept {suns_traced:,} of {of:,} suns".format(**record.interrupted)
    line += (
        f" and {record.rounds:,} times the samples of the first round" if record.rounds > 1 else ""
    )
    if record.sun_sampling:
        bias, rms = (
            show_number(record.sun_sampling["bias"], 2, plus=True),
            record.sun_sampling["rms"],
        )
        line += (
            f"; this changes full load hours by {bias} %, those of single surfaces by {rms:.2f} % "
            "(rms)"
        )
    return line
