"""Results are whole or not there at all: one run to a folder, and a disk that fills is one line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from citypv.core.results.output_folder import LOCK, whole_folder
from citypv.core.settings.errors import InputError

POSIX = pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")


def test_a_second_run_into_the_same_new_folder_is_refused(tmp_path):
    """From its first moment, not when the results are moved; the first one ends as if alone."""
    with whole_folder(tmp_path / "out") as work:
        (work / "faces.csv").write_text("first")
        code = (
            "import sys; from citypv.core.settings.errors import InputError\n"
            "from citypv.core.results.output_folder import whole_folder\n"
            "try:\n    with whole_folder(sys.argv[1]): pass\n"
            "except InputError as error: raise SystemExit(str(error))"
        )
        command = [sys.executable, "-c", code, str(tmp_path / "out")]
        second = subprocess.run(command, capture_output=True, text=True, check=False)
        assert second.returncode == 1
        assert "out: another run is writing to it; wait for it to end, or choose another --out" in second.stderr
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["faces.csv"]
    assert (tmp_path / "out" / "faces.csv").read_text() == "first"
    assert [file.name for file in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_the_system_does_not_allow_is_refused(tmp_path):
    """A name longer than the 255 bytes that file systems take; access rights do not stop the user root."""
    folder = tmp_path / "new" / ("x" * 250)
    with pytest.raises(InputError, match=r"cannot be made \(.+\); choose another --out"), whole_folder(folder):
        pass


def test_what_a_killed_run_left_is_taken_over(tmp_path):
    left = tmp_path / ".out.unfinished"
    (left / "deep").mkdir(parents=True)
    for name in (LOCK, "faces.csv", "deep/file"):
        (left / name).write_text("left")
    with whole_folder(tmp_path / "out") as work:
        assert {file.name for file in work.iterdir()} == {LOCK}
        (work / "groups.csv").write_text("new")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["groups.csv"]
    assert not left.exists()


def test_a_folder_that_fills_while_the_run_goes_on_is_not_overwritten(tmp_path):
    with pytest.raises(InputError, match="is not empty"), whole_folder(tmp_path / "out") as work:
        (work / "faces.csv").write_text("ours")
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "faces.csv").write_text("theirs")
    assert (tmp_path / "out" / "faces.csv").read_text() == "theirs"
    assert not list(tmp_path.glob(".*"))


@POSIX
@pytest.mark.parametrize(
    "limit", [30_000, *(pytest.param(limit, marks=pytest.mark.once) for limit in (0, 3_000, 100_000, 200_000))]
)
def test_a_disk_that_fills_while_netcdf_is_written_is_one_error(tmp_path, limit):
    """Whichever write meets the end of the disk: one OSError that names the file, and nothing on the error stream."""
    code = (
        "import resource, signal, sys, numpy as np\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from transfers import Horizons\n"
        "from citypv.core.sun.sky_grid import sky_grid_suns\n"
        "from citypv.core.results.transfer_file import write_transfer\n"
        "from pathlib import Path\n"
        "transfer = Horizons(400).transfer(sky_grid_suns(300))\n"
        "transfer.visible_share = np.random.default_rng(0).random((400, 300), dtype=np.float32)\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n"
        "try:\n    write_transfer(Path(sys.argv[1]), transfer)\n"
        "except OSError as error: raise SystemExit(f'{error.filename}: {error.strerror}')\n"
    )
    path = tmp_path / "transfer.nc"
    run = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert len(run.stderr.strip().splitlines()) == 1, run.stderr
    assert run.stderr.startswith(f"{path}: ")
