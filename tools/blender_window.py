"""Drive a real Blender with a window for tests: installed from Debian packages in a folder, on a
virtual screen.

    .venv/bin/python tools/blender_window.py build ROOT    build the folder (Debian or Ubuntu, root; 2 minutes, 3 GB)
    .venv/bin/python tools/blender_window.py open ROOT     open its window and take a picture: window.png
    .venv/bin/python tools/blender_window.py find          print a ROOT, building one where that is possible

`tests/blender/test_window.py` drives it where the environment variable CITYPV_BLENDER names such a
ROOT; `make test` finds or builds one and says so. Debian's unstable suite is the one that has
Blender 5.2; it moves, so that building may fail on some days.
"""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
SUITE, PYTHON = "sid", "3.14"
TOOLS = ["debootstrap", "xvfb", "xdotool", "x11-utils", "imagemagick"]
PACKAGES = ["blender", "python3-numpy", "python3-requests", "python3-zstandard", "python3-cattr"]
PACKAGES += ["libegl1", "libgl1", "libgl1-mesa-dri", "libglx-mesa0", "libegl-mesa0"]
NEEDED = """certifi cftime charset-normalizer cloudpickle embreex h5netcdf h5py idna joblib llvmlite lxml mapbox-earcut
    narwhals numba packaging pandas pvlib pyproj python-dateutil pytz requests scikit-learn scipy shapely threadpoolctl
    tifffile tqdm tsam typing-extensions tzdata urllib3 xarray"""
BUILT_FROM = " ".join([SUITE, PYTHON, *PACKAGES, *NEEDED.split()])
SIZE = (1600, 1000)
EXCHANGE = "exchange"  # folder of ROOT that both sides see; inside it is /exchange
# A clean environment: Blender as a module sets variables for its own libraries.
ENVIRONMENT = ["env", "-i", "PATH=/usr/local/bin:/usr/bin:/bin", "HOME=/root", "LANG=C.UTF-8"]
ENVIRONMENT += [f"BLENDER_USER_RESOURCES=/{EXCHANGE}/settings"]

_held = {}  # root -> descriptor of its lock

# Runs inside Blender: executes what the other side leaves in /exchange/ask.py and answers with what
# `answer` holds.
DRIVER = """
import bpy, json, pathlib, traceback
ask, reply = pathlib.Path("/exchange/ask.py"), pathlib.Path("/exchange/reply.json")
bpy.context.preferences.view.show_splash = False
def listen():
    if ask.exists():
        code = ask.read_text()
        ask.unlink()
        names = {"bpy": bpy, "answer": None}
        try:
            exec(code, names)
            told = {"answer": names["answer"]}
        except Exception:
            told = {"error": traceback.format_exc()}
        draft = reply.with_suffix(".part")
        draft.write_text(json.dumps(told))
        draft.rename(reply)
    return 0.01
bpy.app.timers.register(listen, persistent=True)
"""


def main():
    """Build a root, open its window, or find one."""
    if sys.argv[1:] == ["find"]:
        root, reason = find_root()
        print(f"[test] window tests: {reason}", file=sys.stderr, flush=True)
        print(root or "")
        return
    if len(sys.argv) != 3 or sys.argv[1] not in ("build", "open"):
        sys.exit(__doc__)
    root = Path(sys.argv[2]).resolve()
    if sys.argv[1] == "build":
        build_root(root)
        return
    install_extension(root)
    with Window(root) as window:
        window.ask("answer = bpy.app.version_string")
        time.sleep(3)  # until everything is drawn
        window.take_picture("window.png")


def find_root():
    """Folder with Blender: the one given by CITYPV_BLENDER, an existing one, or a new one.

    Returns
    -------
    root : Path or None
    reason : str
        Where it comes from, or why there is none.
    """
    if os.environ.get("CITYPV_BLENDER"):
        return Path(
            os.environ["CITYPV_BLENDER"]
        ), f"run in {os.environ['CITYPV_BLENDER']} (CITYPV_BLENDER)"
    root = (
        Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
        / "citypv"
        / f"blender-{SUITE}"
    )
    if os.geteuid() or not shutil.which("apt-get"):
        return (
            None,
            "skipped: building a Blender with a window needs root and apt-get; or name one by "
            "CITYPV_BLENDER",
        )
    ready = root / EXCHANGE / "ready"
    if ready.exists() and ready.read_text() == BUILT_FROM:
        return root, f"run in {root}, built before"
    started = time.monotonic()
    try:
        build_root(root)
    except RuntimeError as error:
        return None, f"skipped: no Blender could be built ({' '.join(str(error).split())[-300:]})"
    ready.write_text(BUILT_FROM)
    return root, f"run in {root}, built in {time.monotonic() - started:.0f} s"


def hold_root(root):
    """Keep a root for this process until it ends; others wait for it."""
    if root not in _held:
        _held[root] = os.open(f"{root}.lock", os.O_CREAT | os.O_RDWR)
        fcntl.flock(_held[root], fcntl.LOCK_EX)


def build_root(root):
    """Install Debian with Blender, and the Python packages of core, into a folder."""
    root.parent.mkdir(parents=True, exist_ok=True)
    hold_root(root)
    run(["apt-get", "update", "-q"])
    run(["apt-get", "install", "-y", "-q", "--no-install-recommends", *TOOLS])
    root.mkdir(parents=True, exist_ok=True)
    if not (root / "usr/bin/apt-get").exists():
        mirror = run(["apt-get", "indextargets", "--format", "$(SITE)", "Origin: Debian"]).split()[
            0
        ]
        run(["debootstrap", "--variant=minbase", SUITE, root, mirror])
    mount_proc(root)
    run(["chroot", root, "apt-get", "install", "-y", "-q", "--no-install-recommends", *PACKAGES])
    (root / EXCHANGE).mkdir(exist_ok=True)
    install_packages(root / f"usr/local/lib/python{PYTHON}/dist-packages")


def install_packages(folder):
    """Install the packages of core for the root's Python; NumPy is Debian's."""
    platforms = [f"manylinux_2_{minor}_x86_64" for minor in range(28, 4, -1)] + [
        "manylinux2014_x86_64"
    ]
    target = [
        "--target",
        folder,
        "--python-version",
        PYTHON,
        "--implementation",
        "cp",
        "--only-binary=:all:",
    ]
    target += [word for platform in platforms for word in ("--platform", platform)]
    target += ["--constraint", REPOSITORY / "tools/versions.txt", "--upgrade"]
    run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", *target, *NEEDED.split()])


def install_extension(root):
    """Install and enable the add-on as a user would, with fresh settings; return Blender's
    output.
    """
    hold_root(root)
    mount_proc(root)
    folder = root / EXCHANGE / "citypv"
    for old in (folder, root / EXCHANGE / "settings"):
        shutil.rmtree(old, ignore_errors=True)
    (root / EXCHANGE / "settings").mkdir()
    build = [
        sys.executable,
        REPOSITORY / "tools/build_extension.py",
        "--platform",
        "linux-x64",
        "--no-wheels",
    ]
    run([*build, "--folder", folder / "contents", "--out", folder / "zip"])
    package = next((folder / "zip").glob("*.zip"))
    inside = f"/{EXCHANGE}/citypv/zip/{package.name}"
    return blender(
        root, "--command", "extension", "install-file", "-r", "user_default", "-e", inside
    )


def blender(root, *arguments):
    """Run the root's Blender in background mode; return its output."""
    return run(["chroot", root, *ENVIRONMENT, "blender", *arguments])


def mount_proc(root):
    """Mount /proc in the root, which Blender needs to start."""
    if not (root / "proc/self").exists():
        run(["mount", "-t", "proc", "proc", root / "proc"])


def run(command):
    """Run a command; return its output, or exit with it on failure."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command[:4]))} …: {done.stdout}{done.stderr}")
    return done.stdout


class Window:
    """Blender's window on a virtual screen: run Python in it, send input, take screenshots.

    Another process that opens the same root waits until this one ends.
    """

    def __init__(self, root, size=SIZE):
        self.root, self.size, self.exchange = root, size, root / EXCHANGE
        self.work = Path(tempfile.mkdtemp(prefix="citypv-window-"))

    def __enter__(self):
        """Open screen and window."""
        hold_root(self.root)
        mount_proc(self.root)
        for name in ("ask.py", "reply.json"):
            (self.exchange / name).unlink(missing_ok=True)
        (self.exchange / "driver.py").write_text(DRIVER)
        width, height = map(str, self.size)
        read, write = os.pipe()
        screen = [
            "Xvfb",
            "-displayfd",
            str(write),
            "-screen",
            "0",
            f"{width}x{height}x24",
            "-nolisten",
            "tcp",
        ]
        with (self.work / "xvfb.log").open("w") as log:
            self.screen = subprocess.Popen(screen, stdout=log, stderr=log, pass_fds=[write])
        os.close(write)
        with os.fdopen(read) as number:
            self.display = ":" + number.readline().strip()
        environment = [
            f"DISPLAY={self.display}",
            "LIBGL_ALWAYS_SOFTWARE=1",
            "XDG_RUNTIME_DIR=/root",
        ]
        program = [
            "blender",
            "--gpu-backend",
            "opengl",
            "--window-geometry",
            "0",
            "0",
            width,
            height,
        ]
        command = [
            "chroot",
            str(self.root),
            *ENVIRONMENT,
            *environment,
            *program,
            "--python",
            f"/{EXCHANGE}/driver.py",
        ]
        with (self.work / "blender.log").open("w") as log:
            self.blender = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
        return self

    def __exit__(self, *_):
        """Close both."""
        for process in (self.blender, self.screen):
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def ask(self, code, patience=60.0):
        """Run Python in Blender's main thread; return the value of `answer`."""
        draft, reply = self.exchange / "ask.part", self.exchange / "reply.json"
        draft.write_text(code)
        draft.rename(self.exchange / "ask.py")
        end = time.monotonic() + patience
        while not reply.exists():
            if self.blender.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"Blender does not answer:\n{self.read_log()}")
            time.sleep(0.01)
        told = json.loads(reply.read_text())
        reply.unlink()
        if "error" in told:
            raise RuntimeError(told["error"])
        return told["answer"]

    def wait_for(self, expression, patience=60.0):
        """Poll until an expression is true."""
        end = time.monotonic() + patience
        while not self.ask(f"answer = bool({expression})"):
            if time.monotonic() > end:
                raise RuntimeError(f"in vain: {expression}\n{self.read_log()}")
            time.sleep(0.2)

    def point(self, *arguments):
        """Move the mouse, click, press keys: commands of xdotool."""
        run(["env", f"DISPLAY={self.display}", "xdotool", *map(str, arguments)])

    def take_picture(self, path):
        """Save a screenshot."""
        run(["env", f"DISPLAY={self.display}", "import", "-window", "root", path])

    def read_log(self):
        """Read Blender's output."""
        return (self.work / "blender.log").read_text()


if __name__ == "__main__":
    main()
