"""`citypv selfcheck`: closed forms and hard cases on the user's own machine, with numbers."""

import math
import time
from dataclasses import asdict, dataclass

from ..settings.version import __version__
from .closed_form_checks import closed_form_checks
from .hard_checks import hard_checks


@dataclass
class _Check:
    """Expected and found value of one check."""

    name: str
    expected: float
    found: float | None  # None if it failed with an error
    standard_error: float | None
    allowance: float  # for rounding
    seconds: float
    passed: bool
    problem: str = ""  # the error with which it failed


def selfcheck(report=None):
    """Run all checks.

    Parameters
    ----------
    report : callable, optional
        Called with each Check when it is done.

    Returns
    -------
    list of Check
    """
    done = []
    for name, expected, allowance, find in (*closed_form_checks(), *hard_checks()):
        started, passed, problem = time.perf_counter(), False, ""
        try:
            value, standard_error = find()
            if not (math.isfinite(value) and math.isfinite(standard_error)):
                raise ArithmeticError(f"found {value} ± {standard_error}")
            # Within four standard errors; seeds are fixed, so that a check that passed once never
            # fails by chance.
            passed = bool(abs(value - expected) <= 4 * standard_error + allowance)
        except Exception as error:  # counts as failure
            value, standard_error, problem = None, None, f"{type(error).__name__}: {error}"
        seconds = time.perf_counter() - started
        own = _Check(
            name, float(expected), value, standard_error, float(allowance), seconds, passed, problem
        )
        done.append(own)
        if report:
            report(own)
    return done


def describe_check(check):
    """One line of text."""
    word = "pass" if check.passed else "FAIL"
    line = f"{word}  {check.name:<65} expected {check.expected:<11.7g}"
    if check.found is None:
        return f"{line} error: {check.problem}"
    return (
        f"{line} found {check.found:<11.7g} ± {check.standard_error:<8.1g} {check.seconds:5.2f} s"
    )


def report_checks(checks):
    """Plain types only, for JSON."""
    return {
        "version": __version__,
        "passed": all(check.passed for check in checks),
        "seconds": sum(check.seconds for check in checks),
        "checks": [asdict(check) for check in checks],
    }
