"""What each run leaves out, in what order files run, and whether a Blender window was tested.

`make check` leaves out what is slow: what is marked so, and the functions of slow.txt, beyond its
budget when they were last measured (tools/measure_slow.py). `make test` leaves out what is
thorough: what is marked so, and of the functions of long.txt all but as many cases as stand there.
Of both, what is marked as a law stays all the same, and so does the one case of each law that LAWS
names. The second Python leaves out what is marked `once`: but for files in which a Python may
differ that is each function of slow.txt, and all cases of a function but the first.

On several workers the longest files come first, so that none is left over at the end. Between them
come files that need no compiled loops, so that what one worker compiles in a fresh checkout is not
compiled by the other at once.
"""

from collections import Counter
from functools import cache
from pathlib import Path

import pytest

SLOW, LONG = Path(__file__).parent / "slow.txt", Path(__file__).parent / "long.txt"
# Laws, closed forms and rules of the code that no fast test holds: the cases that begin so.
LAWS = (
    "core/test_effects.py::test_in_a_half_sphere_the_number_is_that_of_a_geometric_series[0.6]",
    "core/test_brdfs.py::test_share_is_what_the_law_says[Glossy(albedo=0.8, roughness=0.3)-60",
    "core/test_closed_forms.py::test_street_canyon[run_forward-1]",
    "core/test_closed_forms.py::test_street_canyon[run_gather-3]",
    "core/test_closed_forms.py::test_unshaded_surface[plan-",
    "core/test_closed_forms.py::test_unshaded_surface[rays-",
    "core/test_coincident.py::test_pairs_are_those_that_overlap[0]",
    "core/test_days_of_year.py::test_a_day_for_every_day_is_every_hour",
    "core/test_effects.py::test_a_dark_far_ground_costs_a_wall_what_pvlib_says[180",
    "core/test_energy.py::test_unshaded_surfaces_equal_pvlib[False-days",
    "core/test_energy.py::test_unshaded_surfaces_equal_pvlib[True-hourly",
    "core/test_forward.py::test_closed_furnace[0.25",
    "core/test_forward.py::test_where_the_light",
    "core/test_hard_edits.py::test_a_hard_edit_is_a_full_run[mirrors come]",
    "core/test_measure_effects.py::test_sun_that_a_wall",
    "core/test_places.py::test_far_from_an_edit_of_berlin_nothing_changes[add]",
    "core/test_plot.py::test_the_plan_has_the_shapes_of_the_city",
    "core/test_plot.py::test_the_sun_stands_where_spherical_trigonometry_says[52.5",
    "core/test_pv_system.py::test_tables_equal_pvlib_hour_by_hour[14.0",
    "core/test_python_api.py::test_the_same_files_as_the_command_line[few rays]",
    "core/test_rack_light.py::test_narrow_rows_shade",
    "core/test_sky.py::test_stated_errors_of_the",
    "core/test_specular.py::test_sun_in_a_mirror_facade[forward-30.0-1]",
    "core/test_suns.py::test_sky_grid_interpolates_any_latitude[52.5",
    "core/test_timeline.py::test_shaded_surfaces_have_the_shares_of_their_skyline",
    "core/test_world_plots.py::test_gain_under_an_overcast_sky",
    "hard/test_forward_cases.py::test_nothing_is_brighter_than_the_sky[1.0-0]",
    "hard/test_inside_something.py::test_cover_of_a_block_does_not_depend_on_the_seed[4.0",
    "hard/test_which_geometry.py::test_a_closed_box_around_everything_is_dark[1.0-0]",
    "hard/test_which_light.py::test_closed_furnace[0.25-1]",
    "test_rooms.py::",
)
# Blender, processes and signals: all runs on both Pythons. Of options, readers and writers what is
# cheap does. Elsewhere numbers come from numpy and compiled loops, the same on every Python: the
# second one runs the first case.
PROCESSES = (
    "blender/",
    "hard/test_broken",
    "hard/test_long_runs",
    "core/test_cancel_command",
    "core/test_cluster",
)
MAY_DIFFER = (
    *("core/test_output", "core/test_exports", "core/test_results", "core/test_read"),
    *(
        "core/test_city",
        "core/test_weather",
        "core/test_plot",
        "core/test_refused",
        "core/test_obj",
    ),
    *("core/test_raster", "core/test_own_terrain"),
)
BEGUN = Counter()  # cases collected of each function
LONGEST = [
    "core/test_fuzz_readers.py",
    "blender/test_extension.py",
    "core/test_cluster.py",
    "hard/test_budget_is_true.py",
    "core/test_guide.py",
    "blender/test_edit_city.py",
    "core/test_variant.py",
    "core/test_cancel_command.py",
    "core/test_measure_effects.py",
    "core/test_python_api.py",
    "hard/test_floating_houses.py",
    "hard/test_real_open_models.py",
    "core/test_weather_checks.py",
    "core/test_sky.py",
    "core/test_command_line.py",
    "hard/test_slabs_and_sheets.py",
    "core/test_forward.py",
    "core/test_days_of_year.py",
    "core/test_standard_errors.py",
    "core/test_town.py",
    "core/test_reading_progress.py",
    "hard/test_hollows.py",
    "hard/test_errors_of_full_load_hours.py",
    "hard/test_forward_laws.py",
    "core/test_forward_agrees.py",
    "core/test_trees.py",
]


def name_function(nodeid):
    """File and function of a test, as slow.txt has them."""
    return nodeid.partition("[")[0].removeprefix("tests/")


@pytest.hookimpl(tryfirst=True)
def pytest_itemcollected(item):
    name = name_function(item.nodeid)
    law = item.nodeid.removeprefix("tests/").startswith(LAWS)
    if law:
        item.add_marker(pytest.mark.law)
    if name in read_slow():
        item.add_marker(pytest.mark.slow)
    if BEGUN[name] >= read_long().get(name, BEGUN[name] + 1) and not law:
        item.add_marker(pytest.mark.thorough)
    again = BEGUN[name] and not name.startswith(MAY_DIFFER)
    if not name.startswith(PROCESSES) and (name in read_slow() or again):
        item.add_marker(pytest.mark.once)
    BEGUN[name] += 1


@cache
def read_slow():
    """Functions that were slow when they were measured: set of str."""
    return set(SLOW.read_text("utf-8").splitlines())


@cache
def read_long():
    """Functions of which `make test` runs the first cases only: dict of str to the number
    of them.
    """
    lines = [line.split() for line in LONG.read_text("utf-8").splitlines()]
    return {name: int(count) for name, count in lines}


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    if hasattr(config, "workerinput"):
        order = {name: number for number, name in enumerate(LONGEST)}
        items.sort(key=lambda item: order.get("/".join(item.path.parts[-2:]), len(order)))


def pytest_terminal_summary(terminalreporter):
    found = {}
    for state in ("passed", "failed", "error", "skipped"):
        found[state] = [
            report
            for report in terminalreporter.getreports(state)
            if "/test_window" in report.fspath
        ]
    told = [f"{len(reports)} {state}" for state, reports in found.items() if reports]
    if told:
        reason = f" ({found['skipped'][0].longrepr[2]})" if found["skipped"] else ""
        terminalreporter.write_line(f"tests in a Blender window: {', '.join(told)}{reason}")
