"""The version of CityPV, stated once for Python; blender_manifest.toml and pyproject.toml repeat
it.
"""

__version__ = "0.3.0"
