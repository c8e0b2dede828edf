"""Read the environments that a user names: traced cities, or unshaded planes."""

from pathlib import Path

from ..results.read_transfer import read_transfer
from ..settings.errors import InputError
from ..sky.light_sources import model_traced
from .environment import build_environment
from .unshaded import unshaded_transfer

UNSHADED = "unshaded"
CURE = "give NAME=transfer.nc, a result folder, or unshaded"


def read_environments(texts, system, sky="isotropic", ground_albedo=0.25):
    """Environments from the command line's arguments.

    Parameters
    ----------
    texts : list of str
        "unshaded", a transfer.nc, or the folder of a run; "NAME=" before it gives a name, which is else that of the
        folder.
    system : PvSystem
    sky : {"isotropic", "perez", "auto"}
        Model of the sky; "auto": the one that all were traced for.
    ground_albedo : float
        Of the unshaded environment.

    Returns
    -------
    environments : list of Environment
    sky : str
        A key of `sky_models.MODELS`.

    Raises
    ------
    InputError
    """
    transfers = []
    for text in texts:
        name, path = split_name(text)
        if path == UNSHADED:
            transfers.append((name, "closed form", unshaded_transfer(ground_albedo)))
        else:
            file = find_transfer(Path(path))
            transfers.append((name, str(file), read_transfer(file)))
    if sky == "auto":
        sky = model_traced(set.intersection(*(set(one.sources) for *_, one in transfers)))
    found = [build_environment(*one, system, sky) for one in transfers]
    names = [one.name for one in found]
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        raise InputError("ENVIRONMENT", f"two are called {double[0]!r}", "name them: NAME=transfer.nc")
    return found, sky


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
