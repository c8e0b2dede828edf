"""Settings of a run from those that are given: checked, and completed by what method and preset
imply.
"""

import difflib
import os
from collections.abc import Iterable
from numbers import Real

from ..results.exports import EXPORTS
from ..settings.errors import InputError
from ..settings.presets import METHODS, PRESETS
from ..settings.request import Request, declared_settings

KINDS = {  # of a setting -> (what it has to be, in words, and as types)
    "number": ("a number", Real),
    "switch": ("True or False", bool),
    "pairs": ("a dict of names and True or False", dict),
    "shares": ("a dict of names and shares", dict),
    "names": ("a list of names", list | tuple | str),
    "texts": ("a path or a list of paths", list | tuple | str | os.PathLike),
    "place": ("latitude and longitude", list | tuple),
    "text": ("text or a path", str | os.PathLike),
}
KINDS |= {"integer": KINDS["number"], "flag": KINDS["switch"], "choice": KINDS["text"]}


def request_of_settings(settings, *groups, others=()):
    """Checked settings: those given, before those that method and preset imply, before the
    defaults.

    Parameters
    ----------
    settings : dict
        By name.
    *groups : str
        Groups of settings that mean something here; none: all.
    others : collection of str
        Further names, for the message about one that does not exist.

    Returns
    -------
    Request

    Raises
    ------
    InputError
        A setting does not exist, is of the wrong kind, or out of range.
    """
    known = {name: (default, details) for name, default, details in declared_settings(*groups)}
    given = {}
    for name, value in settings.items():
        if name not in known:
            near = difflib.get_close_matches(name, [*known, *others], 1)
            cure = f"did you mean {near[0]}?" if near else "leave it out"
            if name in EXPORTS and "exports" in others:
                cure = f'give exports=["{name}"]'
            raise InputError(name, "is not a setting here", cure)
        given[name] = _take(name, value, *known[name])
    implied = _implied_settings(given)
    if "effects" in implied and "effects" in given:
        given["effects"] = {**implied["effects"], **given["effects"]}
    request = Request(**{**implied, **given})
    request.check()
    return request


def _implied_settings(given):
    """Settings that the method, the preset and a time budget imply; what the method implies wins:
    dict.
    """
    # The fewer rays the first round has, the shorter a time can be kept: further rounds add them.
    first_round = (
        {"samples": PRESETS["draft"]["samples"]} if given.get("time_budget") is not None else {}
    )
    return {
        **first_round,
        **PRESETS.get(given.get("preset"), {}),
        **METHODS.get(given.get("method"), {}),
    }


def _take(name, value, default, details):
    """A setting in the form that Request has."""
    if (value is None and (default is None or details.none)) or (
        details.none and value == details.none
    ):
        return None
    words, types = KINDS[details.kind]
    no_number = types is Real and isinstance(value, bool)
    if not isinstance(value, types) or no_number or (details.kind == "place" and len(value) != 2):
        raise InputError(name, f"{value!r} is not {words}", f"give {words}")
    return TAKE[details.kind](value) if details.kind in TAKE else value


def _take_integer(value):
    # others are refused by `check_request`
    return int(value) if float(value).is_integer() else value


def _take_names(value):
    return (value,) if isinstance(value, str) else tuple(value)


def _take_texts(value):
    texts = [
        os.fspath(text) for text in ([value] if isinstance(value, str | os.PathLike) else value)
    ]
    return texts[0] if len(texts) == 1 else texts


# The declared type, whatever the caller's: an integer as a latitude, a number of numpy, a
# pathlib.Path.
TAKE = {
    "number": float,
    "integer": _take_integer,
    "switch": bool,
    "flag": bool,
    "names": _take_names,
}
TAKE |= {
    "texts": _take_texts,
    "place": lambda value: tuple(map(float, value)),
    "text": os.fspath,
    "choice": os.fspath,
}
TAKE["shares"] = lambda value: {key: float(share) for key, share in value.items()}


def take_paths(city):
    """Files and folders of a city: list of the one or of the several that are given.

    Raises
    ------
    InputError
        There are none, or something is no path.
    """
    paths = [city] if isinstance(city, str | os.PathLike) else city
    if not isinstance(paths, Iterable) or isinstance(paths, bytes | dict):
        raise InputError("city", f"{city!r} is no path", "give a file, a folder, or a list of them")
    paths = list(paths)
    for path in paths:
        if not isinstance(path, str | os.PathLike):
            raise InputError(
                "city", f"{path!r} is no path", "give a file, a folder, or a list of them"
            )
    if not paths:
        raise InputError("city", "is an empty list", "give at least one file or folder")
    return paths


def cluster_settings(cluster, tile=None):
    """What `--cluster` and `--tile` ask for: ClusterSettings, or None without the first.

    Raises
    ------
    InputError
        Tiles without a cluster.
    """
    if cluster is None:
        if tile is not None:
            raise InputError(
                "--tile",
                "is for cities traced in tiles",
                "give --cluster local:N or --cluster serial too",
            )
        return None
    from ..run.trace_tiles import ClusterSettings

    return ClusterSettings(cluster) if tile is None else ClusterSettings(cluster, tile)
