"""Helpers beside these tests and beside those of the core can be imported by their names; most run
on one Python.

Cases of geometry and light are numbers of compiled loops, which are the same on every Python; the
tests of the core run these loops on all. What depends on Python itself, as errors and signals do,
is in the files named here.
"""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core")]
ON_EVERY_PYTHON = {"test_broken_cities.py", "test_broken_numbers.py", "test_long_runs.py"}


def pytest_itemcollected(item):
    if item.path.name not in ON_EVERY_PYTHON:
        item.add_marker(pytest.mark.once)
