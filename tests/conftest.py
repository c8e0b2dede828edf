"""What ends the suite, what its workers share, and whether a Blender window was tested.

Which tests run is decided by marks in their files alone: pyproject.toml says what each means.
"""

import os
import pickle
import signal
import socket
import sqlite3
from contextlib import closing, contextmanager, suppress

import pytest


@contextmanager
def hear_signals():
    """Signals that come in the meantime, whoever handles them: a list, filled at the end."""
    numbers, (ear, mouth) = [], socket.socketpair()
    with ear, mouth:
        ear.setblocking(False)
        mouth.setblocking(False)
        before = signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
        try:
            yield numbers
        finally:
            signal.set_wakeup_fd(before)
            with suppress(BlockingIOError):
                numbers += ear.recv(64)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """An interrupt ends the suite, although a command under test ends properly on it, so that its
    test alone would fail.
    """
    failed = item.session.testsfailed
    with hear_signals() as numbers:
        answer = yield
    if signal.SIGINT in numbers and item.session.testsfailed > failed:
        item.session.shouldstop = f"interrupted in {item.nodeid}"
    return answer


@pytest.fixture(scope="session")
def traced_once(tmp_path_factory):
    """Make a result once in a run of the suite, whichever worker needs it first.

    `traced_once(name, make)` returns what ``make(folder)`` returned, which must be picklable; the
    folder is new and stays until the run's temporary files go, the result is for reading only.
    """
    place = tmp_path_factory.getbasetemp()
    place = (place.parent if "PYTEST_XDIST_WORKER" in os.environ else place) / "traced_once"

    place.mkdir(exist_ok=True)
    taken = {}

    def take(name, make):
        if name in taken:
            return taken[name]
        folder, result = place / name, place / f"{name}.pickle"
        # A lock of SQLite is there on every system, and ends with the process that holds it.
        with closing(
            sqlite3.connect(place / f"{name}.lock", timeout=3600, isolation_level=None)
        ) as lock:
            lock.execute("BEGIN EXCLUSIVE")
            if result.exists():
                taken[name] = pickle.loads(result.read_bytes())
            else:
                folder.mkdir()
                taken[name] = make(folder)
                result.write_bytes(pickle.dumps(taken[name]))
        return taken[name]

    return take


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
