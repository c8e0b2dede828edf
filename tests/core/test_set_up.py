"""The set-up stops with one line that can be pasted, on machines of several kinds, played by faked
programs.
"""

import os
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from load_tool import load_tool

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(os.name == "nt", reason="make and apt are not for Windows")


@pytest.fixture
def tool():
    return load_tool("set_up")


@pytest.fixture
def machine(tool, tmp_path, monkeypatch):
    """A machine with nothing but the programs that a test puts there; returns the function that
    does so.
    """
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    for name in ("PYENV_ROOT", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "nowhere"))
    monkeypatch.setattr(tool, "UV", tmp_path / ".venv-uv")
    monkeypatch.setattr(tool.os, "geteuid", lambda: 1000)

    def put(name, script="exit 0"):
        (folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / name).chmod(0o755)

    return put


def stopped(function, *arguments):
    """The one line that the set-up stops with."""
    with pytest.raises(SystemExit) as told:
        function(*arguments)
    line = str(told.value)
    assert line.startswith("[set-up] ") and "\n" not in line
    return line


def can_be_pasted(line):
    """Whether the shell takes what stands behind "type: " without complaint about its form."""
    command = line.split("type: ")[1] if "type: " in line else line.split("Type: ")[1]
    return (
        subprocess.run(["/bin/sh", "-n", "-c", command.split(" (")[0]], check=False).returncode == 0
    )


def test_missing_packages_are_one_line_with_what_they_are_for(tool, machine):
    machine("apt-get")
    packages = ["python3.13-venv", "libx11-6", "libgl1"]
    line = stopped(tool.install_system_packages, packages)
    assert (
        "missing Python and its virtual environments" in line
        and "graphics libraries that Blender loads" in line
    )
    assert (
        "type: su -c" in line
        and all(package in line for package in packages)
        and can_be_pasted(line)
    )
    machine("sudo", "exit 1")  # wants a password
    line = stopped(tool.install_system_packages, packages)
    assert "type: sudo sh -c 'apt-get update && apt-get install -y" in line and can_be_pasted(line)


@pytest.mark.parametrize(
    "case",
    [
        (
            "ID=ubuntu\nVERSION_ID=24.04\n",
            "add-apt-repository -y ppa:deadsnakes/ppa && apt-get install -y python3.13-venv",
        ),
        ("ID=fedora\n", "type: UV_PYTHON_INSTALL_MIRROR=https://HOST/PATH make demo"),
    ],
)
def test_uv_without_a_network_says_what_to_type(tool, machine, tmp_path, monkeypatch, case):
    """As in Ubuntu 24.04, whose apt has no Python that Blender exists for."""
    system, cure = case
    machine("apt-cache", "echo python3.13:; echo '  Candidate: (none)'")
    machine("apt-get")
    machine("uv", "echo trying; echo 'error: error sending request for url'; exit 2")
    (tmp_path / "os-release").write_text(system)
    release = tool.read_os_release(tmp_path / "os-release")
    monkeypatch.setattr(tool, "read_os_release", lambda: release)
    line = stopped(tool.bring_python)
    assert "uv could not fetch Python 3.13 (error: error sending request for url)" in line
    assert cure in line and can_be_pasted(line)


def test_make_without_any_python_is_one_line(tmp_path):
    make = next((path for path in ("/usr/bin/make", "/bin/make") if Path(path).exists()), None)
    if make is None:
        pytest.skip("make is not on this machine")
    (tmp_path / "sh").symlink_to("/bin/sh")
    (tmp_path / "id").write_text("#!/bin/sh\necho 1000\n")
    (tmp_path / "id").chmod(0o755)
    done = subprocess.run(
        [make, "demo"],
        cwd=ROOT,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    install = "'apt-get update && apt-get install -y python3 python3-venv' && make demo"
    assert f"type: su -c {install}" in done.stdout  # a bare Debian has no sudo
    assert len(done.stdout.strip().splitlines()) == 1
    (tmp_path / "sudo").symlink_to("/bin/true")
    done = subprocess.run(
        [make, "demo"],
        cwd=ROOT,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"type: sudo sh -c {install}" in done.stdout


# -- wheels of the extension: tests of packages are left out of archive and list, no more --
RECORD = "toy-1.0.dist-info/RECORD"


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


def test_large_tests_are_left_out_of_archive_and_list(tmp_path):
    path, files = make_wheel(tmp_path, 600_000)
    (tmp_path / "out").mkdir()
    load_tool("slim_wheel").copy_wheel(path, tmp_path / "out")
    kept = ["toy/__init__.py", "toy/testing.py", RECORD]
    with zipfile.ZipFile(tmp_path / "out" / path.name) as slim:
        assert slim.testzip() is None
        assert slim.namelist() == kept
        assert [line.split(",")[0] for line in slim.read(RECORD).decode().splitlines()] == kept
        assert slim.read("toy/testing.py") == files["toy/testing.py"]
