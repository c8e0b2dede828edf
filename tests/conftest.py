"""Which files run together on several workers and in what order, and whether a Blender window was tested.

The longest files come first, so that none is left over at the end. Between them come files that need no compiled loops,
so that what one worker compiles in a fresh checkout is not compiled by the other at the same time.
"""

from pathlib import PurePath

import pytest

# Files whose tests trace the same scenes, and do so once where they run in one process.
TOGETHER = {
    "hard/test_walls_that_touch.py": "hard/test_gather_is_forward.py",
}
LONGEST = [
    "blender/test_window.py",
    "hard/test_gather_is_forward.py",
    "blender/test_extension.py",
    "core/test_cancel_command.py",
    "core/test_reading_progress.py",
    "core/test_forward_agrees.py",
    "hard/test_forward_laws.py",
    "hard/test_real_open_models.py",
    "core/test_town.py",
    "core/test_cancel.py",
    "core/test_forward.py",
    "core/test_cluster.py",
    "hard/test_narrow_gaps.py",
    "hard/test_floating_houses.py",
    "hard/test_budget_is_true.py",
    "hard/test_laws.py",
    "core/test_rack_light.py",
    "core/test_sky.py",
    "hard/test_which_light.py",
]


def name_group(path):
    """File, or the file beside whose tests those of this one run."""
    name = "/".join(PurePath(path).parts[-2:])
    return TOGETHER.get(name, name)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    if hasattr(config, "workerinput"):
        order = {name: number for number, name in enumerate(LONGEST)}
        items.sort(key=lambda item: order.get(name_group(item.path), len(order)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from xdist.scheduler import LoadFileScheduling

    class Scheduler(LoadFileScheduling):
        def _split_scope(self, nodeid):
            return name_group(super()._split_scope(nodeid))

    return Scheduler(config, log)


def pytest_terminal_summary(terminalreporter):
    found = {}
    for state in ("passed", "failed", "error", "skipped"):
        found[state] = [report for report in terminalreporter.getreports(state) if "/test_window" in report.fspath]
    told = [f"{len(reports)} {state}" for state, reports in found.items() if reports]
    if told:
        reason = f" ({found['skipped'][0].longrepr[2]})" if found["skipped"] else ""
        terminalreporter.write_line(f"tests in a Blender window: {', '.join(told)}{reason}")
