"""The faces and buildings that a user leaves without modules, from a file of their ids."""

from ..city.city import whole_of_cell
from ..read.open_input import read_rows
from ..settings.errors import InputError, id_of_cell, list_some


def read_left_out(path):
    """Read the ids that carry no modules, each with the words of the user on it.

    Parameters
    ----------
    path : str or path-like
        CSV with the header `id,words`, or `id` alone. An id is one of a surface, of a polygon that
        was cut into cells, or of a building.

    Returns
    -------
    dict of str to str

    Raises
    ------
    InputError
        The file cannot be read, has other columns, or has an id twice.
    """
    rows = read_rows(path, "give a CSV file with the columns id,words")
    header = next(rows, None)
    if header not in (["id", "words"], ["id"]):
        raise InputError(path, "line 1 is not the header id,words", "add it")
    left_out = {}
    for number, row in enumerate(rows, start=2):
        if not 1 <= len(row) <= len(header):
            raise InputError(path, f"line {number} is not an id and words", "write id,words")
        name = id_of_cell(row[0])
        if name in left_out:
            raise InputError(path, f"line {number} has {name!r} again", "name each id once")
        left_out[name] = row[1] if len(row) > 1 else ""
    return left_out


def _list_unknown(surfaces, left_out):
    """Ids to be left out that name neither a surface nor a building: list of str."""
    names = set(surfaces.surface_id)
    known = names | set(map(whole_of_cell, names)) | set(map(str, surfaces.building_id))
    return [name for name in left_out if name not in known]


def check_left_out(surfaces, path):
    """Refuse a file of `--leave-out`, or None, with an id that is neither a surface nor a building.

    Raises
    ------
    InputError
    """
    unknown = _list_unknown(surfaces, read_left_out(path)) if path else []
    if unknown:
        problem = f"{unknown[0]!r} is neither a surface nor a building of this city"
        raise InputError(path, problem, "take surface_id or building_id from faces.csv")


def describe_gone(surfaces, path):
    """Say which ids of a file of `--leave-out`, or None, name nothing in an edited city: str; "" if
    there are none.
    """
    gone = _list_unknown(surfaces, read_left_out(path)) if path else []
    if not gone:
        return ""
    return f"To be left out, but not in this city any more: {list_some(gone, 5)}"


def words_of_surfaces(surfaces, left_out):
    """The user's words on each surface: (n,) list of str, None of those that are not left out.

    Its own line goes before the line of the polygon that it was cut from, and before its
    building's.
    """
    words = []
    for name, building in zip(surfaces.surface_id, map(str, surfaces.building_id), strict=True):
        keys = (name, whole_of_cell(name), building)
        words.append(next((left_out[key] for key in keys if key in left_out), None))
    return words
