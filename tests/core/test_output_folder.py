"""Results are whole or not there at all: one run to a folder, and a disk that fills is one line."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from thorough import mark_cases

from citypv.core.results.output_folder import LOCK, SITE_FILES, SITE_NAMES, whole_folder
from citypv.core.settings.errors import InputError

OVER = "x" * 256
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
        assert (
            "out: another run is writing to it; wait for it to end, or choose another --out"
            in second.stderr
        )
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["faces.csv"]
    assert (tmp_path / "out" / "faces.csv").read_text() == "first"
    assert [file.name for file in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_the_system_does_not_allow_is_refused(tmp_path):
    """A name longer than the 255 bytes that file systems take; access rights do not stop the user
    root.
    """
    with (
        pytest.raises(InputError, match=r"cannot be used \(.+\); choose another --out"),
        whole_folder(tmp_path / OVER),
    ):
        pass
    longest = tmp_path / "new" / ("ü" * 127)
    with whole_folder(longest) as work:
        (work / "faces.csv").write_text("whole")
    assert [path.name for path in longest.iterdir()] == ["faces.csv"] and len(
        list(longest.parent.iterdir())
    ) == 1


@POSIX
def test_a_link_to_nothing_is_refused_at_once(tmp_path):
    (tmp_path / "out").symlink_to(tmp_path / "gone")
    with (
        pytest.raises(InputError, match=r"out: is a link to .+, which is not there"),
        whole_folder(tmp_path / "out"),
    ):
        pass
    (tmp_path / "gone").mkdir()
    with whole_folder(tmp_path / "out") as work:
        (work / "faces.csv").write_text("whole")
    assert (tmp_path / "gone" / "faces.csv").exists() and (tmp_path / "out").is_symlink()


def test_what_a_killed_run_left_is_taken_over(tmp_path):
    left = tmp_path / ".out.unfinished"
    (left / "deep").mkdir(parents=True)
    for name in (LOCK, "faces.csv", "deep/file"):
        (left / name).write_text("left")
    with whole_folder(tmp_path / "out") as work:
        assert not list(work.iterdir()) and {file.name for file in left.iterdir()} == {
            LOCK,
            work.name,
        }
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


def write_run(folder, word, names):
    """What a run leaves: files of one word, and a summary that tells whose they are."""
    for name in names:
        (folder / name).write_text(word)
    (folder / "summary.json").write_text(json.dumps({"versions": {"citypv": word}}))


def test_only_own_files_are_replaced_or_deleted(tmp_path):
    """A page, notes and a folder of somebody else stay; what the earlier run wrote and this one
    does not, goes.
    """
    out = tmp_path / "out"
    with whole_folder(out) as work:
        write_run(work, "old", ("faces.csv", "preview.png"))
    foreign = {"index.html": "theirs", "notes.txt": "mine", "tiles/deep/plan.txt": "kept"}
    for name, text in foreign.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text)
    with whole_folder(out, overwrite=True) as work:
        write_run(work, "new", ("faces.csv",))
    assert {name: (out / name).read_text() for name in foreign} == foreign
    assert {path.name for path in out.iterdir()} == {
        "index.html",
        "notes.txt",
        "tiles",
        "faces.csv",
        "summary.json",
    }
    assert (out / "faces.csv").read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_file_of_somebody_else_is_not_replaced(tmp_path):
    """Without the results of a run beside it, a table is not ours, whatever its name; a page is not
    ours for a map.
    """
    (tmp_path / "faces.csv").write_text("theirs")
    problem = "holds faces.csv without the results of a run of CityPV; move it away"
    with pytest.raises(InputError, match=problem), whole_folder(tmp_path, overwrite=True):
        pass
    (tmp_path / "faces.csv").rename(tmp_path / "index.html")
    with (
        pytest.raises(InputError, match=r"holds index\.html"),
        whole_folder(tmp_path, True, SITE_NAMES),
    ):
        pass
    assert (tmp_path / "index.html").read_text() == "theirs"


def test_of_a_map_only_its_own_files_go(tmp_path):
    out = tmp_path / "web"
    listed = ("index.html", "page/map.json", "page/files.txt", "tiles/1.glb")

    def write_map(word):
        with whole_folder(out, True, SITE_NAMES) as work:
            for name in listed:
                (work / name).parent.mkdir(exist_ok=True)
                (work / name).write_text("\n".join(listed) if name == SITE_FILES else word)

    write_map("old")
    for name in ("page/logo.png", "robots.txt"):
        (out / name).write_text("theirs")
    write_map("new")
    there = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert there == {*listed, "page/logo.png", "robots.txt"}
    assert (out / "tiles" / "1.glb").read_text() == "new" and (
        out / "page" / "logo.png"
    ).read_text() == "theirs"


KILLED = """
import os, sys
from pathlib import Path
from citypv.core.results import output_folder
from citypv.core.results.output_folder import whole_folder
sys.path.insert(0, sys.argv[3])
from test_output_folder import write_run
count, last = 0, int(sys.argv[2])
def end(event, values):
    global count
    if event.split(".")[0] in ("os", "open", "shutil", "ctypes"):
        count += 1
        if count == last:
            os.kill(os.getpid(), 9)
if sys.argv[4:]:
    output_folder._exchange = lambda *folders: False
with whole_folder(sys.argv[1], overwrite=True) as work:
    write_run(work, "new", ("faces.csv", "groups.csv"))
    sys.addaudithook(end)
print("done")
"""


@POSIX
@pytest.mark.slow
def test_an_overwrite_that_is_killed_leaves_the_old_or_the_new(tmp_path):
    """Killed before each thing that it asks of the system while results are exchanged, until it
    ends by itself.
    """
    seen, last = [], 0
    while not seen or seen[-1] != "done":
        last += 1
        out = tmp_path / f"{last}" / "out"
        out.mkdir(parents=True)
        write_run(out, "old", ("faces.csv", "preview.png"))
        (out / "notes.txt").write_text("mine")
        command = [sys.executable, "-c", KILLED, str(out), str(last), str(Path(__file__).parent)]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        assert ended.returncode in (0, -9), ended.stderr
        words = {path.name: path.read_text() for path in out.iterdir()}
        own = json.loads(words.pop("summary.json"))["versions"]["citypv"]
        names = {"old": ("faces.csv", "preview.png"), "new": ("faces.csv", "groups.csv")}[own]
        assert words == {"notes.txt": "mine"} | dict.fromkeys(names, own)
        seen.append("done" if ended.returncode == 0 else own)
        with whole_folder(
            out, overwrite=True
        ) as work:  # whatever was left does not stop the next run
            write_run(work, "next", ("faces.csv",))
        assert {path.name for path in out.iterdir()} == {"notes.txt", "faces.csv", "summary.json"}
        assert [path.name for path in out.parent.iterdir()] == ["out"]
    assert seen[0] == "old" and "new" in seen


@POSIX
def test_where_folders_cannot_be_exchanged_the_next_run_finds_the_old(tmp_path):
    """Of two renamings the second may not come: then the results before lie in the temporary
    folder.
    """
    left = tmp_path / ".out.unfinished"
    (left / "old").mkdir(parents=True)
    (left / LOCK).write_text("")
    write_run(left / "old", "old", ("faces.csv",))
    with pytest.raises(ValueError, match="stop"), whole_folder(tmp_path / "out", overwrite=True):
        raise ValueError("stop")
    assert (tmp_path / "out" / "faces.csv").read_text() == "old" and not left.exists()


@pytest.mark.slow
@POSIX
@pytest.mark.parametrize("limit", mark_cases([30_000, 0, 3_000, 100_000, 200_000], kept=1))
def test_a_disk_that_fills_while_netcdf_is_written_is_one_error(tmp_path, limit):
    """Whichever write meets the end of the disk: one OSError that names the file, and nothing on
    the error stream.
    """
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
    run = subprocess.run(
        [sys.executable, "-B", "-c", code, str(path)], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert len(run.stderr.strip().splitlines()) == 1, run.stderr
    assert run.stderr.startswith(f"{path}: ")
