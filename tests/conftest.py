"""The order of files on several workers: those with long tests first, so that none is left over at the end."""

from collections import Counter

import pytest


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    if hasattr(config, "workerinput"):
        long = Counter(item.path for item in items if item.get_closest_marker("slow"))
        items.sort(key=lambda item: -long[item.path])
