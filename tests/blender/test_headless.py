"""The example for scripts runs as its text says."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "headless.py"
# The example as a script, with two rays per pixel instead of sixteen.
RUN = (
    "import runpy, sys; from citypv.operators.picture import draw_results; draw_results.SAMPLES = 2; "
    "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
)


@pytest.mark.slow
def test_the_example_writes_what_it_says(city_file, tmp_path):
    """Under plain Python with bpy, in a process of its own."""
    given = [sys.executable, "-c", RUN, str(EXAMPLE), str(city_file), str(tmp_path)]
    done = subprocess.run(given, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "city.blend").stat().st_size > 10_000
    assert (tmp_path / "city.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "city.City.citypv.nc").is_file()
    assert "All: " in done.stdout
    assert " MWh per year" in done.stdout
