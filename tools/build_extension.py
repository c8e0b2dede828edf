"""Build the Blender extension: a zip for each platform and Python, with all packages of core as
wheels.

    .venv/bin/python tools/build_extension.py [--platform linux-x64 …] [--python 3.11 …]
    [--no-wheels | --whole-wheels] [--manual build/docs] [--website URL] [--out dist]

NumPy is not among the wheels, for it would shadow Blender's. Large tests of packages are left out
of theirs, unless the wheels have to stay as they were published (--whole-wheels), as Blender's own
platform asks. What is bundled, and under which licence, is written to bundled.csv beside the zips.
"""

import argparse
import csv
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from email import message_from_bytes
from importlib import metadata, util
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename
from slim_wheel import copy_wheel

ROOT = Path(__file__).resolve().parent.parent
CONTENTS = (
    "__init__.py",
    "__main__.py",
    "LICENSE",
    "core",
    "operators",
    "citypv_addon",
    "examples/berlin",
)
LEFT_OUT = {"numpy", "pyomo", "highspy"}  # Blender's own; the last two serve tsam's k-medoids only
MANYLINUX = [f"manylinux_2_{minor}_x86_64" for minor in range(28, 4, -1)]
MANYLINUX += ["manylinux2014_x86_64", "manylinux2010_x86_64", "manylinux1_x86_64"]
# Blender's platform: (pip's platforms, Pythons that Blender has there, environment of the
# requirements)
TARGETS = {
    "linux-x64": (MANYLINUX, ("3.11", "3.13", "3.14"), ("posix", "linux", "Linux", "x86_64")),
    "windows-x64": (["win_amd64"], ("3.11", "3.13"), ("nt", "win32", "Windows", "AMD64")),
    "macos-arm64": (
        ["macosx_14_0_arm64"],
        ("3.11", "3.13"),
        ("posix", "darwin", "Darwin", "arm64"),
    ),
    "macos-x64": (["macosx_14_0_x86_64"], ("3.11",), ("posix", "darwin", "Darwin", "x86_64")),
}
LINES = {  # Python: (end of the zip's name, first Blender, first Blender that it is not for)
    "3.11": ("blender_4.5", "4.5.0", "5.1.0"),
    "3.13": ("blender_5.2", "5.1.0", None),
    "3.14": ("blender_5.2_python_3.14", "5.1.0", None),  # Debian's own Blender
}


def main():
    """Download the wheels, assemble the extension's folder, and validate and zip it with Blender's
    own tool.
    """
    parser = argparse.ArgumentParser(description="build the extension for Blender")
    parser.add_argument("--platform", action="append", choices=TARGETS, help="default: all")
    parser.add_argument("--python", action="append", choices=LINES, help="default: all")
    parser.add_argument(
        "--no-wheels", action="store_true", help="for a Blender that already has the packages"
    )
    parser.add_argument(
        "--whole-wheels", action="store_true", help="leave wheels as they were published"
    )
    parser.add_argument("--manual", type=Path, help="the manual's pages, to be taken along")
    parser.add_argument("--website", metavar="URL", help="address for the manifest")
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    parser.add_argument(
        "--folder", type=Path, default=ROOT / "build/extension", help="build folder"
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for platform in options.platform or TARGETS:
        if options.no_wheels:
            report(build_zip(options, platform, None, []))
            continue
        for python in TARGETS[platform][1]:
            if not options.python or python in options.python:
                wheels = fetch_wheels(platform, python)
                report(build_zip(options, platform, python, wheels), wheels)
                list_bundled(wheels, options.out / "bundled.csv")


def build_zip(options, platform, python, wheels):
    """Build the extension for one platform and Python: path of the zip."""
    lay_out(options, platform, python, wheels)
    run_blender_tool("validate", options.folder)
    with tempfile.TemporaryDirectory(dir=options.out) as folder:
        run_blender_tool(
            "build", "--source-dir", options.folder, "--output-dir", folder, "--split-platforms"
        )
        built = next(Path(folder).glob("*.zip"))
        name = f"{built.stem}-{LINES[python][0]}.zip" if python else built.name
        return built.replace(options.out / name)


def report(path, wheels=()):
    """Say how large a zip is, and its largest parts."""
    largest = sorted(wheels, key=lambda wheel: -wheel.stat().st_size)[:6]
    parts = [
        f"{parse_wheel_filename(wheel.name)[0]} {wheel.stat().st_size / 1e6:.1f}"
        for wheel in largest
    ]
    print(
        f"[extension] {path.name}: {path.stat().st_size / 1e6:.0f} MB  {', '.join(parts)}",
        flush=True,
    )


def list_bundled(wheels, path):
    """Write what a zip bundles: package, version, licence and size of each wheel."""
    rows = []
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as archive:
            name = next(name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
            said = message_from_bytes(archive.read(name))
        named = [text for text in said.get_all("Classifier", ()) if text.startswith("License :: ")]
        words = str(said["License"] or "").strip()
        licence = said["License-Expression"] or (named[0].rpartition(" :: ")[2] if named else words)
        if "Redistributions in binary form" in licence:  # the whole text in place of a name
            licence = "BSD-3-Clause" if "endorse or promote" in licence else "BSD-2-Clause"
        rows.append([said["Name"], said["Version"], licence, f"{wheel.stat().st_size / 1e6:.1f}"])
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([["package", "version", "licence", "MB"], *rows])


def fetch_wheels(platform, python):
    """Download the wheels of one platform and Python.

    Returns
    -------
    list of Path
        One wheel for each package that core needs there.
    """
    tags, _, (os_name, sys_platform, system, machine) = TARGETS[platform]
    environment = {"os_name": os_name, "sys_platform": sys_platform, "platform_system": system}
    environment |= {
        "platform_machine": machine,
        "python_version": python,
        "python_full_version": f"{python}.0",
    }
    environment |= {
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
        "extra": "",
    }
    pinned = read_versions(environment)
    wanted = {name: pinned[name] for name in collect_packages(environment)}
    folder = ROOT / "wheels" / f"{platform}-{python}"
    for path in list(folder.glob("*.whl")):
        name, version, *_ = parse_wheel_filename(path.name)
        if wanted.get(name) != str(version):
            path.unlink()
    print(f"[extension] {platform}, Python {python}: {len(wanted)} wheels", flush=True)
    command = [
        sys.executable,
        "-m",
        "pip",
        "download",
        "--quiet",
        "--disable-pip-version-check",
        "--no-deps",
    ]
    command += [
        "--only-binary=:all:",
        "--implementation=cp",
        f"--python-version={python}",
        f"--dest={folder}",
    ]
    command += [f"--platform={tag}" for tag in tags]
    subprocess.run(
        [*command, *(f"{name}=={version}" for name, version in wanted.items())], check=True
    )
    return sorted(folder.glob("*.whl"))


def read_versions(environment):
    """Return the version of each package of `tools/versions.txt` in an environment."""
    lines = (ROOT / "tools/versions.txt").read_text("utf-8").splitlines()
    requirements = [Requirement(line) for line in lines if line and not line.startswith("#")]
    return {
        canonicalize_name(requirement.name): str(requirement.specifier).removeprefix("==")
        for requirement in requirements
        if requirement.marker is None or requirement.marker.evaluate(environment)
    }


def collect_packages(environment):
    """Return the names of all packages that core needs in an environment, with indirect
    dependencies.
    """
    installed = {
        canonicalize_name(package.metadata["Name"]) for package in metadata.distributions()
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    waiting, names = [Requirement(text) for text in project["dependencies"]], set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        needed = requirement.marker is None or requirement.marker.evaluate(environment)
        if not needed or name in names | LEFT_OUT:
            continue
        names.add(name)
        # Packages of other platforms are not installed here; those used (colorama) have no
        # dependencies.
        if name in installed:
            waiting += [Requirement(text) for text in metadata.requires(name) or ()]
    return sorted(names)


def lay_out(options, platform, python, wheels):
    """Copy the packages, the manual and the wheels to an empty folder, with a manifest that lists
    them.
    """
    folder = options.folder
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "wheels").mkdir(parents=True)
    for name in CONTENTS:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(
                source, folder / name, ignore=shutil.ignore_patterns("__pycache__", "ruff.toml")
            )
        else:
            shutil.copy(source, folder)
    if options.manual:
        unread = shutil.ignore_patterns("_sources", "objects.inv", ".buildinfo", "*.map")
        shutil.copytree(options.manual, folder / "manual", ignore=unread)
    for wheel in wheels:
        (shutil.copy if options.whole_wheels else copy_wheel)(wheel, folder / "wheels")
    _, first, beyond = LINES[python] if python else (None, None, None)
    changed = {"platforms": f'platforms = ["{platform}"]'}
    if first:
        changed["blender_version_min"] = f'blender_version_min = "{first}"'
    if beyond:
        changed["blender_version_min"] += f'\nblender_version_max = "{beyond}"'
    if options.website:
        changed["type"] = f'type = "add-on"\nwebsite = "{options.website}"'
    if wheels:
        names = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
        changed["platforms"] += f"\nwheels = [\n{names}]"
    lines = (ROOT / "blender_manifest.toml").read_text("utf-8").splitlines()
    lines = [changed.get(line.partition(" = ")[0], line) for line in lines]
    (folder / "blender_manifest.toml").write_text("\n".join(lines) + "\n", "utf-8")


def run_blender_tool(*arguments):
    """Run Blender's extension tool, which comes with bpy and runs without Blender."""
    tool = next(
        Path(util.find_spec("bpy").origin).parent.glob(
            "*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
        )
    )
    subprocess.run([sys.executable, tool, *map(str, arguments)], check=True)


if __name__ == "__main__":
    main()
