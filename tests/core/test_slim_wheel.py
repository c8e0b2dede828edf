"""Wheels of the extension: large tests of packages are left out of the archive and of its list, nothing else."""

import importlib.util
import zipfile
from pathlib import Path

import numpy as np
import pytest

PATH = Path(__file__).parents[2] / "tools/slim_wheel.py"
RECORD = "toy-1.0.dist-info/RECORD"


@pytest.fixture
def copy_wheel():
    spec = importlib.util.spec_from_file_location("slim_wheel", PATH)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool.copy_wheel


def make_wheel(folder, weight):
    """A wheel whose tests take so many bytes, also when they are packed."""
    noise = np.random.default_rng(7).bytes(weight)
    files = {
        "toy/__init__.py": b"value = 1\n",
        "toy/testing.py": b"kept = True\n",
        "toy/tests/data.bin": noise,
        "toy/inner/test/test_it.py": b"assert True\n",
    }
    files[RECORD] = "".join(f"{name},sha256=x,1\n" for name in [*files, RECORD]).encode()
    path = folder / "toy-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path, files


def test_large_tests_are_left_out_of_archive_and_list(tmp_path, copy_wheel):
    path, files = make_wheel(tmp_path, 600_000)
    (tmp_path / "out").mkdir()
    copy_wheel(path, tmp_path / "out")
    kept = ["toy/__init__.py", "toy/testing.py", RECORD]
    with zipfile.ZipFile(tmp_path / "out" / path.name) as slim:
        assert slim.testzip() is None
        assert slim.namelist() == kept
        assert [line.split(",")[0] for line in slim.read(RECORD).decode().splitlines()] == kept
        assert slim.read("toy/testing.py") == files["toy/testing.py"]


def test_other_wheels_stay_as_they_are(tmp_path, copy_wheel):
    path, _ = make_wheel(tmp_path, 1000)
    (tmp_path / "out").mkdir()
    copy_wheel(path, tmp_path / "out")
    assert (tmp_path / "out" / path.name).read_bytes() == path.read_bytes()
