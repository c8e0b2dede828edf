"""How large tests with random input are: `make test` draws a part, `make test-all` all, `make
check` a few.
"""

import os

THOROUGH = os.environ.get("CITYPV_THOROUGH") == "1"
QUICK = os.environ.get("CITYPV_QUICK") == "1"


def draw_count(whole, part, few=None):
    """Number of cases: the whole, a part in an ordinary run, or a few in a quick one."""
    return whole if THOROUGH else few if QUICK and few else part
