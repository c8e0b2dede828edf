"""Set up `make demo` and `make test` on a bare machine: Python, its packages, system libraries.

    python3 tools/set_up.py one    one environment; `.venv` points to it
    python3 tools/set_up.py all    an environment for each Python that Blender exists for and this
                                   machine has

Plain standard library, for any python3 from 3.9 on. A second call finds everything in place and
returns at once.
"""

import ctypes
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VERSIONS = ("3.13", "3.11")  # the Pythons of Blender 5.2 LTS and 4.5 LTS, the preferred one first
UV = ROOT / ".venv-uv"
PROGRAMS = "Scripts" if os.name == "nt" else "bin"  # of an environment
BUILDING = threading.Lock()  # of the package itself, whose folder all environments share
SYSTEM_LIBRARIES = {  # what Blender loads, and the Debian package that brings it
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
}
SOFTWARE_RENDERER = "libgl1-mesa-dri"  # comes along when a graphics library is missing
# as in tests/core/browser.py
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
)
NO_NETWORK = re.compile(
    r"ConnectionError|connection error|timed out|Temporary failure|resolve|Network is "
    r"unreachable|ProxyError"
    r"|Failed to fetch|No matching distribution|error sending request|403 Forbidden",
    re.IGNORECASE,
)


def main(which):
    """Set up one environment or all."""
    if platform.system() == "Linux" and platform.machine() != "x86_64":
        stop(
            f"for Linux on {platform.machine()} there is no Blender as a Python module, only for "
            "x86_64"
        )
    pythons = find_pythons() or bring_python()
    if which == "one":
        pythons = dict(list(pythons.items())[:1])
    for version in VERSIONS:
        if which == "all" and version not in pythons:
            say(f"Python {version} is not on this machine: the tests run without it")
    packages = [
        package for version, path in pythons.items() for package in missing_venv(path, version)
    ]
    if "CITYPV_NEEDS_BROWSER" in os.environ and not any(
        map(shutil.which, BROWSERS)
    ):  # as .ci/run says
        packages.append(BROWSERS[0])
    install_system_packages([*packages, *missing_libraries()])
    with ThreadPoolExecutor() as side_by_side:
        folders = list(side_by_side.map(make_environment, pythons.keys(), pythons.values()))
    link_environment(ROOT / ".venv", folders[0])
    say("ready: " + ", ".join(f"Python {version} ({path})" for version, path in pythons.items()))


def link_environment(link, folder):
    """Let `.venv` lead to an environment, if it does not yet: tests may run by it meanwhile."""
    if link.exists() and link.resolve() == folder:
        return
    if os.name == "nt":  # a junction needs no rights that a symbolic link does
        from _winapi import CreateJunction

        if link.exists():
            link.rmdir()
        CreateJunction(str(folder), str(link))
        return
    link.unlink(missing_ok=True)
    link.symlink_to(folder.name)


def say(text):
    """Print one message."""
    print(f"[set-up] {text}\n", end="", flush=True)


def stop(text):
    """Exit with the reason and what to do."""
    sys.exit(f"[set-up] {text}")


def find_pythons():
    """Find Pythons for which Blender exists as a module: on the PATH, of pyenv and of uv.

    Returns
    -------
    dict of str to str
        Version and path of the interpreter, the preferred one first.
    """
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    uv = Path(os.environ.get("XDG_DATA_HOME", Path.home() / ".local/share")) / "uv/python"
    pythons = {}
    for version in VERSIONS:
        names = (f"python{version}", "python3", "python")
        candidates = [
            shutil.which(name, path=folder) for name in names for folder in os.get_exec_path()
        ]
        for folder in (pyenv, uv, UV / "python"):
            candidates += sorted(folder.glob(f"*{version}.*/bin/python3"))
        paths = (interpreter(candidate, version) for candidate in candidates if candidate)
        path = next(filter(None, paths), None)
        if path:
            pythons[version] = path
    return pythons


def interpreter(candidate, version):
    """Return the true path of a Python (behind shims and virtual environments) if it is of that
    version.
    """
    question = (
        "import sys; print('%d.%d' % sys.version_info[:2], getattr(sys, '_base_executable', "
        "sys.executable))"
    )
    answer = ask([candidate, "-c", question])
    found, _, path = answer.stdout.strip().partition(" ")
    return path if answer.returncode == 0 and found == version else None


def bring_python():
    """Install a Python: with apt where its packages have one (Debian 13), else with uv (Ubuntu
    24.04).
    """
    version = VERSIONS[0]
    say(f"Blender exists for Python {' and '.join(VERSIONS)} only, and neither is here")
    packages = [f"python{version}", f"python{version}-venv"]
    if shutil.which("apt-get") and is_in_apt(packages[0]):
        install_system_packages(packages)
        return find_pythons() or stop(
            f"Python {version} is still not found; type: sudo apt-get install -y {packages[0]}"
        )
    say(f"uv brings Python {version}")
    uv = shutil.which("uv")
    if not uv:
        install_system_packages(
            missing_venv(sys.executable, ".".join(platform.python_version_tuple()[:2]))
        )
        run([sys.executable, "-m", "venv", "--clear", UV])
        pip_install(UV / PROGRAMS / "python", "uv")
        uv = UV / PROGRAMS / "uv"
    fetched = ask([uv, "python", "install", version, "--install-dir", UV / "python", "--no-bin"])
    pythons = find_pythons()
    if fetched.returncode or not pythons:
        stop(
            f"uv could not fetch Python {version} ({last_line(fetched.stdout)}); "
            f"{describe_other_ways(version)}"
        )
    return pythons


def is_in_apt(package):
    """Whether apt could install a package."""
    known = ask(["apt-cache", "policy", package]).stdout if shutil.which("apt-cache") else ""
    return "Candidate:" in known and "Candidate: (none)" not in known


def describe_other_ways(version):
    """What to type where uv may not fetch a Python from the network."""
    if read_os_release().get("ID") == "ubuntu":
        tool = "apt-get update && apt-get install -y software-properties-common"
        archive = "add-apt-repository -y ppa:deadsnakes/ppa"
        return (
            f"type: {as_root(f'{tool} && {archive} && apt-get install -y python{version}-venv')} "
            "&& make demo"
        )
    mirror = "UV_PYTHON_INSTALL_MIRROR=https://HOST/PATH make demo"
    return f"from a mirror, type: {mirror} (or install Python {version} yourself)"


def read_os_release(path=Path("/etc/os-release")):
    """The lines of /etc/os-release: dict."""
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {name: value.strip('"') for name, _, value in (line.partition("=") for line in lines)}


def missing_venv(python, version):
    """Debian package that this Python needs to create virtual environments, if missing."""
    return (
        [f"python{version}-venv"]
        if ask([python, "-c", "import ensurepip, venv"]).returncode
        else []
    )


def missing_libraries():
    """Debian packages of libraries that Blender needs and this machine does not have."""
    if platform.system() != "Linux":
        return []
    packages = []
    for library, package in SYSTEM_LIBRARIES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            packages.append(package)
    return [*packages, SOFTWARE_RENDERER] if {"libgl1", "libegl1"} & set(packages) else packages


def install_system_packages(packages):
    """Install Debian packages if permitted, else print the command to run."""
    if not packages:
        return
    purpose = describe_purpose(packages)
    install = ["apt-get", "install", "-y", "--no-install-recommends", *packages]
    if not shutil.which("apt-get"):
        stop(
            f"missing {purpose}; install what Debian calls {' '.join(packages)}, and type: make "
            "demo"
        )
    sudo = ["sudo", "-n"] if os.geteuid() else []
    if sudo and (not shutil.which("sudo") or ask([*sudo, "true"]).returncode):
        command = as_root(f"apt-get update && {' '.join(install)}")
        stop(f"missing {purpose}; type: {command} && make demo")
    say(f"installing {purpose}: {' '.join(packages)}")
    quiet = [*sudo, "env", "DEBIAN_FRONTEND=noninteractive"]
    run([*quiet, "apt-get", "update"])
    run([*quiet, *install])


def as_root(command):
    """A line that runs a command as root; without sudo, as in a bare Debian, root's password is
    asked for.
    """
    if not os.geteuid():
        return f"sh -c '{command}'"
    return f"sudo sh -c '{command}'" if shutil.which("sudo") else f"su -c '{command}'"


def describe_purpose(packages):
    """What packages are for, as words."""
    python = [name for name in packages if name.startswith("python")]
    browser = [name for name in packages if name in BROWSERS]
    blender = [name for name in packages if name not in python + browser]
    words = [f"Python and its virtual environments ({len(python)} packages)"] if python else []
    words += (
        [f"window and graphics libraries that Blender loads ({len(blender)} packages)"]
        if blender
        else []
    )
    words += ["a browser for the tests of the report"] if browser else []
    return " and ".join(words)


def make_environment(version, python):
    """Create the virtual environment `.venv-VERSION` with Blender, CityPV (editable) and test
    tools.
    """
    folder = ROOT / f".venv-{version}"
    # Tool settings in pyproject.toml do not affect the installation.
    package = (ROOT / "pyproject.toml").read_text("utf-8").partition("[tool.pytest")[0]
    sources = package + (ROOT / "tools/versions.txt").read_text("utf-8")
    wanted = "\n".join([python, str(ROOT), hashlib.sha256(sources.encode()).hexdigest()])
    stamp = folder / "set-up.stamp"
    if (folder / PROGRAMS).exists() and stamp.exists() and stamp.read_text() == wanted:
        return folder
    started = time.monotonic()
    say(
        f"Python {version}: installing Blender and the packages into {folder.name} (1.4 GB, about "
        "a minute)"
    )
    run([python, "-m", "venv", "--clear", folder])
    # The list is whole, so that nothing need be resolved; what is imported is compiled then.
    pip_install(folder / PROGRAMS / "python", "--no-deps", "-r", "tools/versions.txt")
    with BUILDING:
        pip_install(folder / PROGRAMS / "python", "--no-deps", "-e", ".")
    run([folder / PROGRAMS / "python", "-m", "pip", "check"])
    stamp.write_text(wanted)
    say(f"Python {version}: ready after {time.monotonic() - started:.0f} s")
    return folder


def pip_install(python, *arguments):
    """Run `pip install`; show large downloads and the last step, and the full output if
    it fails.
    """
    pip = [
        python,
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "--no-input",
        "--no-compile",
        "--progress-bar",
        "off",
    ]
    command = [str(part) for part in (*pip, *arguments)]
    said = []
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        for line in process.stdout:
            said.append(line)
            large = re.search(r"Downloading (\S+) \((\d\d+)[.\d]* MB\)", line)
            if large:
                say(f"  downloading {large[1].split('/')[-1]} ({large[2]} MB)")
            elif line.startswith("Installing collected packages") and "," in line:
                say(
                    f"  unpacking {line.count(',') + 1} packages into "
                    f"{Path(python).parents[1].name}"
                )
    if process.returncode:
        print("".join(said[-40:]), flush=True)
        stop(f"failed: {' '.join(command[1:6])} …; {describe_network(''.join(said))}")


def describe_network(output):
    """What to do about a command that failed, from its output."""
    if NO_NETWORK.search(output) is None:
        return "its output is above"
    return (
        "no way to the packages? Type: HTTPS_PROXY=http://HOST:PORT "
        "PIP_INDEX_URL=https://HOST/simple make demo"
    )


def last_line(text):
    """The last line of an output."""
    return (text.strip().splitlines() or ["no output"])[-1].strip()


def run(command):
    """Run a command silently; show its output if it fails."""
    done = ask(command)
    if done.returncode:
        print(done.stdout[-4000:], flush=True)
        stop(f"failed: {' '.join(map(str, command))}; {describe_network(done.stdout)}")


def ask(command):
    """Run a command; return its output and exit status."""
    return subprocess.run(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )


if __name__ == "__main__":
    if sys.argv[1:] not in (["one"], ["all"]):
        stop("usage: python3 tools/set_up.py one|all")
    main(sys.argv[1])
