"""A reader who leaves before the end, as `head` does, causes neither an error nor a message."""

import subprocess
import sys
from pathlib import Path

CITY = Path(__file__).parents[1] / "data" / "citygml" / "hannover_LGLN_LoD2_32_550_5802_3bld.gml"


def test_a_reader_may_leave_before_the_end():
    command = [sys.executable, "-m", "citypv", "inspect", str(CITY), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(60) == 0
