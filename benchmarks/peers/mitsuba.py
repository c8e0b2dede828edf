"""The tracer's task, done by another engine: Mitsuba 3 on the processor (LLVM variant, Embree
inside).

    python benchmarks/peers/mitsuba.py [--scene FILE] [--work FOLDER] [--llvm FILE] [--runs 5]
    [--threads 2] [--json]

What it needs. Python ≥ 3.11 and the network once: FOLDER/venv (build/peers/venv where --work is not
given) is made with its own Mitsuba, of the version below; nothing of it enters the environment that
citypv runs in. And LLVM ≥ 16 as a shared library with the C interface, which Mitsuba's compiler
Dr.Jit loads while it runs: the file named by --llvm, else by DRJIT_LIBLLVM_PATH, else the newest of
the usual places (the system's folders, Homebrew, conda, and the one that every Rust toolchain
carries). On Debian or Ubuntu `apt install libllvm19` brings it. LLVM 14 is refused by Dr.Jit; 15 is
taken, but stops at the first maximum of two floats on x86 ("Cannot select: fmaximum").

The task, as citypv's estimator gather does it: the town of tests/data/town.npz (91,764 triangles,
143 suns), 256 hemisphere rays per triangle (closest hit), shadow rays from 16 points per triangle
to each sun in front of it, the sparse matrix of hits F, and three reflections at albedo 0.25 for
every sun and the diffuse sky. Rays that leave below the horizon carry nothing. scene_in_mitsuba.py
does it, with the choices that serve our tracer (one four-dimensional sequence for places and
directions; 16 points that lie evenly for shadows, here the centroids of congruent cells; light
divided by the uncovered share of a triangle), but without standard errors, without a search for
covered cells (each ray that meets a back speaks for itself), without one for sheets, and for this
one kind of scene.

--scene names another .npz: `vertices` (v, 3) [m], `triangles` (n, 3) with their fronts
counterclockwise, `sun` (s, 3)
towards the suns, `weight` (s,) of them (all alike where there is none), and the reference:
`triangle` (k,), their numbers, and `light` (k,), their light of a year.

What is timed. One run that is not counted compiles the kernels; then the median of --runs. The
scene (Embree's tree) is built before and given apart. `cpu` is the time of all threads together:
where the machine does other things too, wall seconds say little, and cpu divided by the threads is
what an idle one would come close to. Errors are rms differences per triangle from the reference in
the same file.

With --json one object goes to standard output and everything else to standard error, so that
another script can call this one: `whole` and `whole_runs`, `seconds` and `cpu_seconds` by stage,
`cpu_whole`, `scene_seconds`, `rays`, `year` (rms of the light of a year in percent of its mean),
`versions`; of the town also `rms` by part and `bias_reflected`.
"""

import argparse
import ctypes
import json
import os
import subprocess
import sys
import venv
from math import isqrt
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOWN = ROOT / "tests" / "data" / "town.npz"
PACKAGES = ("mitsuba==3.9.1", "numpy>=2.2", "scipy>=1.15")
LEAST_LLVM = 16
PLACES = (
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib/*/libLLVM*.so*",
    "/usr/lib*/libLLVM*.so*",
    "/usr/local/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
    "${CONDA_PREFIX}/lib/libLLVM*.so*",
    "${RUSTUP_HOME}/toolchains/*/lib/libLLVM*.so*",
    "${HOME}/.rustup/toolchains/*/lib/libLLVM*.so*",
    "${ProgramFiles}/LLVM/bin/LLVM-C.dll",
)


def version_of_llvm(path):
    """Version of a shared library of LLVM: three ints, or None where it cannot serve.

    Asked of the library itself. LLVM 15 and older have no `LLVMGetVersion`; some libraries of that
    name lack the C interface, or need other libraries that are not there.
    """
    try:
        library = ctypes.CDLL(str(path))
        numbers = [ctypes.c_uint() for _ in range(3)]
        library.LLVMGetVersion(*(ctypes.byref(number) for number in numbers))
        version = tuple(number.value for number in numbers)
        return (
            version
            if version[0] >= LEAST_LLVM and library.LLVMCreateMCJITCompilerForModule
            else None
        )
    except (OSError, AttributeError):
        return None


def list_places():
    """Files in the usual places; one that hangs on a variable of the environment counts where that
    is set.
    """
    for place in PLACES:
        path = Path(os.path.expandvars(place))
        if path.is_absolute():
            yield from Path(path.anchor).glob(str(path.relative_to(path.anchor)))


def find_llvm(named):
    """The LLVM to use: (path, version). A file that was named is used or refused, never replaced.

    Raises
    ------
    SystemExit
        If there is none.
    """
    named = named or os.environ.get("DRJIT_LIBLLVM_PATH")
    files = {path.resolve() for path in ([Path(named)] if named else list_places())}
    usable = [(version, path) for path in files if (version := version_of_llvm(path))]
    if usable:
        version, path = max(usable)
        return path, version
    where = named or "the usual places"
    sys.exit(
        f"{where}: no shared library of LLVM {LEAST_LLVM} or newer that can be loaded; give its "
        "path with --llvm "
        "(Debian, Ubuntu: apt install libllvm19; macOS: brew install llvm; Windows: LLVM-C.dll of "
        "LLVM's installer)"
    )


def prepare_environment(work):
    """Make WORK/venv with Mitsuba where it is not there already: its Python."""
    python = work / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    mark = work / "venv" / "installed.txt"
    if not mark.exists() or mark.read_text() != "\n".join(PACKAGES):
        print(f"{work / 'venv'}: installing {', '.join(PACKAGES)}", file=sys.stderr)
        venv.create(work / "venv", with_pip=True, clear=True)
        install = [
            python,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            *PACKAGES,
        ]
        subprocess.run(install, check=True, stdout=sys.stderr)
        mark.write_text("\n".join(PACKAGES))
    return python


def read_options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--work", type=Path, default=ROOT / "build" / "peers", help="folder for the environment"
    )
    parser.add_argument(
        "--llvm", metavar="FILE", help=f"shared library of LLVM {LEAST_LLVM} or newer"
    )
    parser.add_argument("--json", action="store_true", help="one object instead of a table")
    parser.add_argument(
        "--scene", type=Path, default=TOWN, help="file with triangles, suns and reference"
    )
    parser.add_argument(
        "--samples", type=int, default=256, help="hemisphere rays per triangle (256)"
    )
    parser.add_argument(
        "--shadow-samples", type=int, default=16, help="points per triangle, a square number (16)"
    )
    parser.add_argument("--runs", type=int, default=5, help="runs that count (5)")
    parser.add_argument("--threads", type=int, default=2, help="threads (2)")
    parser.add_argument("--seed", type=int, default=0, help="of the random shifts (0)")
    options = parser.parse_args()
    if isqrt(max(options.shadow_samples, 0)) ** 2 != options.shadow_samples:
        parser.error(
            f"--shadow-samples {options.shadow_samples}: not a square number; give 4, 9, 16, 25 …"
        )
    if (
        min(options.samples, options.shadow_samples, options.runs, options.threads) < 1
        or options.seed < 0
    ):
        parser.error("numbers must be positive")
    return options


def measure(options):
    """Run the task in its environment: the text it prints, one JSON object."""
    llvm, version = find_llvm(options.llvm)
    print(f"LLVM {'.'.join(map(str, version))}: {llvm}", file=sys.stderr)
    python = prepare_environment(options.work.resolve())
    numbers = {
        name: getattr(options, name)
        for name in ("samples", "shadow_samples", "runs", "threads", "seed")
    }
    # -P keeps this folder off the path: there, `import mitsuba` would find this file.
    task = [python, "-P", Path(__file__).with_name("scene_in_mitsuba.py")]
    task.append(json.dumps(numbers | {"scene": str(options.scene.resolve())}))
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": str(llvm)}
    done = subprocess.run(task, check=False, env=environment, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"Mitsuba stopped with {done.returncode}")
    return done.stdout


def report(found):
    """Print what was measured."""
    names = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    print(
        f"{found['variant']} on {found['threads']} threads ({names}), {os.cpu_count()} processors"
    )
    for stage, seconds in found["seconds"].items():
        speed = (
            f", {found['rays'][stage] / seconds / 1e6:.1f} M rays/s"
            if stage in found["rays"]
            else ""
        )
        print(f"{stage:>12} {seconds:6.2f} s, cpu {found['cpu_seconds'][stage]:.2f} s{speed}")
    runs = ", ".join(f"{seconds:.2f}" for seconds in found["whole_runs"])
    print(
        f"{'whole':>12} {found['whole']:6.2f} s, cpu {found['cpu_whole']:.2f} s; median of {runs}"
    )
    print(f"{'scene':>12} {found['scene_seconds']:6.2f} s before")
    print(f"error of the light of a year {found['year']:.2f} %")
    if "rms" in found:
        print("rms " + ", ".join(f"{name} {value:.4f}" for name, value in found["rms"].items()))
        print(f"bias of the reflected light {found['bias_reflected']:+.2%}")


def main():
    options = read_options()
    found = measure(options)
    if options.json:
        print(found, end="")
    else:
        report(json.loads(found))


if __name__ == "__main__":
    main()
