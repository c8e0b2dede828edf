"""Which tests `make check` can afford: the cheapest ones, up to a budget; the others ->
tests/slow.txt, by function.

    CITYPV_QUICK=1 PYTHONPATH=tools python -m pytest -p measure_slow -m "law or not (slow or
    thorough or window)"

A case costs what it spends itself and its share of the fixtures that it has in common with others.
The function whose cases cost most on average goes, until the rest keeps the budget; what fewer
cases share then costs each of them more. Laws stay whatever they cost. What did not run keeps its
place in the list.
"""

import os
from collections import Counter, defaultdict
from pathlib import Path

import pytest

SLOW = Path(__file__).parents[1] / "tests/slow.txt"
BUDGET = 80.0  # [s] of a processor; two workers take 20 s more to start
OWN = {}  # case: seconds
SHARED = defaultdict(float)  # name of a fixture, and the part of the tests that shares one: seconds


def processor_seconds():
    """Seconds of this process and of those that it waited for: other work on the machine does not
    count.
    """
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request):
    """Measure what cases share."""
    begin = processor_seconds()
    try:
        return (yield)
    finally:
        if fixturedef.scope != "function":
            SHARED[fixturedef.argname, request.node.nodeid or fixturedef.baseid] += (
                processor_seconds() - begin
            )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Measure what a case spends beside that."""
    begin = processor_seconds() - sum(SHARED.values())
    try:
        return (yield)
    finally:
        OWN[item] = processor_seconds() - sum(SHARED.values()) - begin


def pytest_terminal_summary(terminalreporter):
    """Write the list anew and say what remains."""
    laws, functions = [], defaultdict(list)
    for item in OWN:
        (laws if item.get_closest_marker("law") else functions[name_function(item)]).append(item)
    dear, seconds = choose_dear(laws, functions)
    kept = [name for name in SLOW.read_text("utf-8").splitlines() if name not in functions]
    SLOW.write_text("\n".join(sorted([*dear, *kept])) + "\n", "utf-8")
    terminalreporter.write_line(
        f"{seconds:.0f} s of a processor: {len(laws)} cases of laws, and "
        f"{len(functions) - len(dear)} of "
        f"{len(functions)} functions; the others -> {SLOW}"
    )


def name_function(item):
    """File and function of a test, as slow.txt has them."""
    return item.nodeid.partition("[")[0].removeprefix("tests/")


def choose_dear(laws, functions):
    """Leave out functions, the dearest first, until the others and the laws keep the budget.

    Parameters
    ----------
    laws : list
        Cases that stay.
    functions : dict of str to list
        Cases of each function.

    Returns
    -------
    dict of str to float
        Functions left out, and what a case of them costs [s].
    float
        What the rest costs [s].
    """
    uses = {
        item: [
            key for key in SHARED if key[0] in item.fixturenames and item.nodeid.startswith(key[1])
        ]
        for item in OWN
    }
    kept, dear = dict(functions), {}
    while True:
        users = Counter(
            key for items in (laws, *kept.values()) for item in items for key in uses[item]
        )
        costs = {
            item: seconds + sum(SHARED[key] / users[key] for key in uses[item] if users[key])
            for item, seconds in OWN.items()
        }
        total = sum(costs[item] for items in (laws, *kept.values()) for item in items)
        if total <= BUDGET or not kept:
            return dear, total
        means = {
            name: sum(costs[item] for item in items) / len(items) for name, items in kept.items()
        }
        dearest = max(means, key=means.get)
        dear[dearest] = means[dearest]
        del kept[dearest]
