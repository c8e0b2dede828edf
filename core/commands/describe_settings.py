"""Settings of the functions for Python, as their docstrings list them."""

import textwrap

from ..settings.request import declared_settings

TYPES = {  # of a setting -> as Python has it
    "number": "float",
    "integer": "int",
    "switch": "bool",
    "flag": "bool",
    "text": "str",
    "names": "list of str",
    "texts": "path-like or list",
    "pairs": "dict of str to bool",
    "shares": "dict of str to float",
    "place": "(float, float)",
}


def list_settings(*groups):
    """A decorator that lists settings in a docstring, as "Other Parameters".

    Parameters
    ----------
    *groups : str
        Groups of settings; none: all. What the function names itself is left out.
    """

    def complete(function):
        code = function.__code__
        named = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        first, _, rest = function.__doc__.partition("\n")
        lines = [first, *textwrap.dedent(rest).rstrip().splitlines()]
        lines += ["", "Other Parameters", "----------------"]
        for name, default, details in declared_settings(*groups):
            if name not in named:
                lines += _describe_setting(name, default, details)
        function.__doc__ = "\n".join(lines)
        return function

    return complete


def _describe_setting(name, default, details):
    """A setting's entry: its name, type and default, and what it means, with its unit."""
    kind = f"{{{', '.join(map(repr, details.choices))}}}" if details.choices else None
    kind = kind or TYPES[details.kind]
    stated = ", optional" if default is None else f", default {default!r}"
    unit = f"[{details.unit}] " if details.unit else ""
    return [
        f"{name} : {kind}{stated}",
        *textwrap.wrap(unit + details.words, 92, initial_indent="    ", subsequent_indent="    "),
    ]
