"""The extension builds, installs and enables in a Blender of its own, and loads nothing heavy by
that.
"""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HERE = {"linux": "linux-x64", "darwin": "macos-arm64", "win32": "windows-x64"}[sys.platform]
PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"
HEAVY = [
    "embreex",
    "h5py",
    "lxml",
    "numba",
    "pandas",
    "pvlib",
    "scipy",
    "shapely",
    "pyproj",
    "sklearn",
]
HEAVY += ["tifffile", "tsam", "xarray"]
BLENDERS_OWN = [
    "bpy",
    "numpy*",
    "requests",
    "urllib3",
    "certifi",
    "idna",
    "charset_normalizer",
    "zstandard",
]
BLENDERS_OWN += ["attr", "attrs", "cattr", "cattrs", "typing_extensions.py"]

INSTALL = """
import json, os, pathlib, sys, time
import bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
loaded = sorted(sys.modules)
enabled = "bl_ext.user_default.citypv" in bpy.context.preferences.addons
settings = hasattr(bpy.types.Scene, "citypv")
module = "bl_ext.user_default.citypv"
bpy.ops.preferences.addon_disable(module=module)
left = hasattr(bpy.types.Scene, "citypv")
began = time.process_time()
bpy.ops.preferences.addon_enable(module=module)
seconds = time.process_time() - began
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", overwrite=True)
updated = module in bpy.context.preferences.addons and hasattr(bpy.types.Scene, "citypv")
repository = [repo.module for repo in bpy.context.preferences.extensions.repos].index("user_default")
bpy.ops.extensions.package_uninstall(repo_index=repository, pkg_id="citypv")
folder = pathlib.Path(os.environ["BLENDER_USER_RESOURCES"])
print(json.dumps({"loaded": loaded, "enabled": enabled, "settings": settings, "left": left, "seconds": seconds,
                  "updated": updated, "preferences": module in bpy.context.preferences.addons,
                  "classes": [name for name in dir(bpy.types) if "citypv" in name.lower()],
                  "modules": [name for name in sys.modules if name.startswith("bl_ext.") and "citypv" in name],
                  "files": [str(path) for path in folder.rglob("*citypv*")]}))
"""

IMPORT_ALL = """
import importlib, json, pkgutil, sys
sys.path.insert(0, sys.argv[2])
import bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
core = importlib.import_module("bl_ext.user_default.citypv.core")
for module in pkgutil.walk_packages(core.__path__, core.__name__ + "."):
    # with matplotlib, which no extension carries
    if module.name.rpartition(".")[2].startswith(("draw_", "picture")):
        continue
    importlib.import_module(module.name)
importlib.import_module("tsam")  # which core loads only where days are clustered
files = {name: sys.modules[name].__file__ for name in json.loads(sys.argv[3]) if name in sys.modules}
print(json.dumps(files))
"""


def run(command, **settings):
    """Run a program that must succeed; return what it said."""
    done = subprocess.run(
        [*map(str, command)], check=False, capture_output=True, text=True, **settings
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def run_python(folder, *arguments):
    """Run a script with Blender's settings in a folder of its own; return what its last
    line says.
    """
    done = run(
        [sys.executable, *arguments], env=os.environ | {"BLENDER_USER_RESOURCES": str(folder)}
    )
    assert "Traceback" not in done.stderr
    return json.loads(
        next(line for line in reversed(done.stdout.splitlines()) if line.startswith("{"))
    )


def build_extension(folder, *options):
    """Build the extension for this platform and return its zip; Blender's own tool validates it."""
    command = [
        sys.executable,
        ROOT / "tools/build_extension.py",
        "--platform",
        HERE,
        "--out",
        folder,
    ]
    done = run([*command, "--folder", folder / "contents", *options])
    assert "Success parsing TOML" in done.stdout
    return next(folder.glob("*.zip"))


@pytest.mark.slow
def test_the_extension_installs_enables_updates_and_leaves_nothing_behind(tmp_path):
    path = build_extension(tmp_path, "--no-wheels")
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    assert {name.split("/")[0] for name in names} == {
        *(
            "__init__.py",
            "__main__.py",
            "LICENSE",
            "blender_manifest.toml",
            "core",
            "operators",
            "citypv_addon",
        ),
        "examples",
    }
    tables = ("weather/climate_grid", "world/coast_lines")
    data = {f"core/{name}.{ending}" for name in tables for ending in ("npz", "LICENSES.txt")}
    berlin = "ATTRIBUTION.md", "berlin_3910_5817.gml", "era5_berlin_2017.nc"
    page = ("page.html", "page.css", "viewer_tables.html", "three.LICENSES.txt", "de.json")
    page += tuple(
        f"{name}.{ending}" for name in ("viewer", "building") for ending in ("html", "css")
    )
    scripts = ("viewer", "supply", "report", "map", "three", "tiles", "building", "basemap")
    page += tuple(f"{name}.js" for name in scripts)
    data |= {f"core/results/web/{name}" for name in page}
    data |= {"core/rays/loops.txt", *(f"examples/berlin/{name}" for name in berlin)}
    assert {name for name in names if "/" in name and not name.endswith((".py", "/"))} == data
    said = run_python(tmp_path / "blender", "-c", INSTALL, path)
    assert said["enabled"] and said["settings"] and not said["left"]
    assert "bl_ext.user_default.citypv" in said["loaded"]
    assert not set(HEAVY) & set(said["loaded"])
    assert said["seconds"] < 0.3  # of the processor
    assert said["updated"]
    assert not said["preferences"]
    assert said["classes"] == said["modules"] == said["files"] == []


@pytest.mark.thorough
def test_the_wheels_are_all_that_core_needs_beside_blender(tmp_path):
    path = build_extension(tmp_path, "--python", PYTHON)
    bare = tmp_path / "bare"
    bare.mkdir()
    packages = Path(next(entry for entry in sys.path if entry.endswith("site-packages")))
    for pattern in BLENDERS_OWN:
        for entry in packages.glob(pattern):
            (bare / entry.name).symlink_to(entry)
    # -S leaves out the folder of this Python's own packages.
    said = run_python(
        tmp_path / "blender", "-I", "-S", "-c", IMPORT_ALL, path, bare, json.dumps(HEAVY)
    )
    assert set(said) >= {"embreex", "pandas", "pvlib", "scipy", "tsam", "xarray"}
    assert all(file.startswith(str(tmp_path / "blender")) for file in said.values())
