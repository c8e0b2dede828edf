"""Says in one line where Embree has no wheel; all else of the package stands in pyproject.toml."""

import platform
import sys


def install():
    """Install, unless the rays could not be traced."""
    system, processor = platform.system(), platform.machine().lower()
    if system in ("Linux", "Windows") and processor in ("aarch64", "arm64"):
        sys.exit(
            f"CityPV needs embreex, which has no wheel for {system} on {processor}: it runs on "
            "x86-64, and on Apple silicon"
        )
    from setuptools import setup

    setup()


install()
