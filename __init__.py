"""CityPV: what the sun gives to the roofs and facades of a real city.

Blender loads this file as an extension, Python as the package `citypv`. Nothing is imported at
module level, so that reading the package costs nothing and `citypv.core` works without Blender.
"""

FUNCTIONS = ("simulate", "read_results", "compare", "inspect", "world", "Result", "InputError")


def __getattr__(name):
    """What Python users call, and `citypv.__version__`: imported when it is asked for."""
    if name == "__version__":
        from .core.settings.version import __version__

        return __version__
    if name in FUNCTIONS:
        from .core.commands import python_api

        return getattr(python_api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__():
    """Names for completion."""
    return sorted([*globals(), *FUNCTIONS, "__version__"])


def register():
    """Enable the add-on (called by Blender)."""
    from . import citypv_addon

    citypv_addon.register()


def unregister():
    """Disable the add-on (called by Blender)."""
    from . import citypv_addon

    citypv_addon.unregister()
