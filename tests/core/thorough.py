"""How much of a test each run takes: `make test` a part, `make test-all` all, `make check` a few
cases of each law.
"""

import os

import pytest

THOROUGH = os.environ.get("CITYPV_THOROUGH") == "1"
QUICK = os.environ.get("CITYPV_QUICK") == "1"


def draw_count(whole, part, few=None):
    """Number of random cases: the whole, a part in an ordinary run, or a few in a quick one."""
    return whole if THOROUGH else few if QUICK and few else part


def mark_cases(cases, kept=None, law=(), single=False):
    """Cases for `parametrize` with their marks.

    Parameters
    ----------
    cases : iterable
        A case is one value or a tuple of values; a `pytest.param` stays as it is.
    kept : int, optional
        So many from the first on are run by `make test`; the others are thorough, but for laws.
    law : tuple of int
        Which of them `make check` runs although the test is slow.
    single : bool
        A tuple is one value.
    """
    marked = []
    for number, case in enumerate(cases):
        if hasattr(case, "marks"):
            marked.append(case)
            continue
        values = case if isinstance(case, tuple) and not single else (case,)
        marks = [pytest.mark.law] if number in law else []
        if kept is not None and number >= kept and not marks:
            marks = [pytest.mark.thorough]
        marked.append(pytest.param(*values, marks=marks))
    return marked
