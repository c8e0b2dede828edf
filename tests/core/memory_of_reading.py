"""Read a file in a process of its own, and measure the memory that it takes."""

import subprocess
import sys

SCRIPT = """
import sys
from citypv.core.settings.errors import InputError
from citypv.core.read.read_city import read_city
from citypv.core.results.write_summary import peak_memory
before = peak_memory()
try: read_city(sys.argv[1])
except InputError as error: print(error.problem)
print(peak_memory() - before)
"""


def memory_of_refusal(path):
    """Problem that a city file is refused for, and growth of the process's own peak memory [bytes]:
    str, int.

    Not by the difference of `ru_maxrss`: on Linux that starts at the peak of the process that
    started this one.
    """
    told = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(path)], capture_output=True, text=True, check=True
    )
    problem, grown = told.stdout.splitlines()
    return problem, int(grown)
