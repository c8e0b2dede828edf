"""What a run says at its end: the hours of its groups, and whether it took longer than its time budget."""

import time


def report_outcome(log, folder, energy):
    """Report the groups' full load hours, and the folder of the results."""
    interval = energy.interval.total_seconds() / 3600  # [h]
    hours = energy.capacity_factor.sum(axis=0) * interval / energy.years  # (groups,) [h]
    groups = zip(energy.groups, hours, energy.group_count, energy.group_area, strict=True)
    for (kind, orientation), full_load_hours, count, area in groups:
        log.write(f"  {kind} {orientation}: {full_load_hours:.0f} h, {count:,} surfaces, {area:,.0f} m²")
    if not len(energy.groups):
        log.write("  no surface is eligible for modules: groups.csv is empty; faces.csv has the hours of every surface")
    log.write(f"Written to {folder} in {sum(log.clock.seconds.values()):.1f} s")


def describe_overrun(request, log, record):
    """That the time budget was exceeded, by what, and what would take less: lines of text, none if it was kept.

    Parameters
    ----------
    request : Request
    log : RunLog
    record : TraceRecord
    """
    took = time.monotonic() - log.started
    if request.time_budget is None or took <= request.time_budget:
        return []
    reading = sum(log.clock.seconds.get(stage, 0.0) for stage in ("read city", "read weather"))
    tracing = sum(record.seconds.values())
    planning = max(log.clock.seconds.get("trace", 0.0) - tracing, 0.0)
    writing = max(took - reading - planning - tracing, 0.0)
    traced = f"{tracing:.1f} s for tracing" + (
        " a single round, which is always finished" if record.rounds == 1 else ""
    )
    parts = (
        f"{reading:.1f} s for reading",
        f"{planning:.1f} s for the plan and checks of accuracy",
        traced,
        f"{writing:.1f} s for electricity and files",
    )
    return [
        f"--time-budget {request.time_budget:g} was exceeded: the run took {took:.1f} s, {', '.join(parts)}",
        "  a larger --patch-size and --preset draft take less",
    ]
