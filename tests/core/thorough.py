"""How large tests with random input are: `make test` draws a part, CITYPV_THOROUGH=1 all."""

import os

THOROUGH = os.environ.get("CITYPV_THOROUGH") == "1"


def draw_count(whole, part):
    """Number of cases: the whole, or a part in an ordinary run."""
    return whole if THOROUGH else part


def draw_cases(*more):
    """Further cases of a test, if all are wanted."""
    return more if THOROUGH else ()
