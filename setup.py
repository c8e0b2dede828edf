"""Says in one line where Embree has no wheel; all else of the package stands in pyproject.toml."""

import platform
import sys

from setuptools import setup

processor = platform.machine().lower()
if platform.system() in ("Linux", "Windows") and processor in ("aarch64", "arm64"):
    sys.exit(
        f"CityPV needs embreex, which has no wheel for {platform.system()} on {processor}: "
        "it runs on x86-64, and on Apple silicon"
    )
setup()
