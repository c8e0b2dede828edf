"""Libraries that are missing or fail to load: what the panel says about them. Imports none
of them.
"""

import importlib.util
import platform
import re
import sys
from contextlib import contextmanager

NEEDED = (
    *(
        "cftime",
        "embreex",
        "h5netcdf",
        "h5py",
        "lxml",
        "mapbox_earcut",
        "numba",
        "pandas",
        "pvlib",
        "pyproj",
    ),
    *("scipy", "shapely", "sklearn", "threadpoolctl", "tifffile", "tsam", "xarray"),
)
PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"
DEBIAN = "3.14"  # the Python of Debian's own Blender

FAILURES = []  # what to say in the panel, and what to do: sentences, each once


def check_libraries():
    """Look for the libraries without importing them, and keep for the panel which are missing."""
    FAILURES.clear()
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        FAILURES.append(f"Missing for Python {PYTHON}: {', '.join(missing)}. {describe_cure()}")


@contextmanager
def name_libraries():
    """Turn an error of the system on loading a library into an ImportError, which a step
    can tell.
    """
    try:
        yield
    except OSError as error:
        if (
            re.search(
                r"shared object|shared library|dlopen|image not found|DLL|find/load",
                str(error),
                re.IGNORECASE,
            )
            is None
        ):
            raise
        raise ImportError(str(error)) from error


def describe_cure():
    """What to do where a library is missing or does not load: one sentence."""
    ending = {
        "3.11": "blender_4.5",
        "3.13": "blender_5.2",
        DEBIAN: f"blender_5.2_python_{DEBIAN}",
    }.get(PYTHON)
    if ending is None:
        return f"There is no zip of CityPV for Python {PYTHON}: use Blender 4.5 LTS or 5.2 LTS."
    system = {"linux": "linux_x64", "win32": "windows_x64"}.get(
        sys.platform, f"macos_{platform.machine()}"
    )
    name = f"citypv-…-{system.replace('x86_64', 'x64')}-{ending}.zip"
    return f"Remove CityPV in Preferences > Get Extensions, restart Blender, and install {name}."
