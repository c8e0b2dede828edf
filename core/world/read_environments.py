"""Read the environments that a user names: traced cities, or unshaded planes."""

from pathlib import Path

from ..errors import InputError
from ..results.read_transfer import read_transfer
from .environment import build_environment
from .unshaded import unshaded_transfer

UNSHADED = "unshaded"
CURE = "give NAME=transfer.nc, a result folder, or unshaded"


def read_environments(texts, system, ground_albedo=0.25):
    """Environments from the command line's arguments.

    Parameters
    ----------
    texts : list of str
        "unshaded", a transfer.nc, or the folder of a run; "NAME=" before it gives a name, which is else that of the
        folder.
    system : PvSystem
    ground_albedo : float
        Of the unshaded environment.

    Returns
    -------
    list of Environment

    Raises
    ------
    InputError
    """
    found = []
    for text in texts:
        name, path = split_name(text)
        if path == UNSHADED:
            found.append(build_environment(name, "closed form", unshaded_transfer(ground_albedo), system))
        else:
            file = find_transfer(Path(path))
            found.append(build_environment(name, str(file), read_transfer(file), system))
    names = [one.name for one in found]
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        raise InputError("ENVIRONMENT", f"two are called {double[0]!r}", "name them: NAME=transfer.nc")
    return found


def split_name(text):
    """Name and path of an argument."""
    name, equals, path = text.partition("=")
    if equals:
        if not (name and path):
            raise InputError(text, "is not NAME=PATH", CURE)
        return name, path
    if text == UNSHADED:
        return text, text
    path = Path(text)
    named = path.absolute() if path.is_dir() else path.absolute().parent if path.name == "transfer.nc" else path
    return (named.stem if named.suffix == ".nc" else named.name), text


def find_transfer(path):
    """The transfer.nc of a path."""
    if path.is_dir():
        path = path / "transfer.nc"
    if not path.exists():
        raise InputError(path, "there is no such file", CURE)
    return path
